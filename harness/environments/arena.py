"""The arena: G games played together by one SUMO simulation. Its step is the only stepping loop there is.

| order | what happens in a step | where |
| --- | --- | --- |
| 1 | drivers decide from what they saw at the end of the step before; learners' actions come from outside | `drivers` |
| 2 | they reach pedals and wheel, late or in part; lapses of attention omit them | `game.limits`, `game.attention` |
| 3 | the players' cars move | `game.bicycle` |
| 4 | their poses go to SUMO, SUMO moves everyone else, and is read back | `traffic.simulation` |
| 5 | contact, goal and time decide outcomes | `game.quantities` |
| 6 | payoffs are worked out | `game.payoff` |
| 7 | who reached the goal leaves; who crashed stays as an obstacle | here |
| 8 | everyone looks | `game.observation` |

What can't be right ends the step with an error (`game.plausibility`): decisions before 3, motion and payoffs before 7,
observations after 8.

A game's chance is drawn when it starts (`game.start`). Training and assessment are two thin uses of this loop.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.drivers.protocol import Driver
from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.attention import release_controls
from harness.game.bicycle import move, requests
from harness.game.human_limits import PlayersLimits
from harness.game.initial_state import InitialState
from harness.game.neighbours import NOTICED_M
from harness.game.observation import SIZE, observe
from harness.game.payoff import Payoff
from harness.game.quantities import Quantities, terminations
from harness.game.sanity_checks import check_observation, check_step, checked_decisions, slack_m
from harness.game.state import Bodies, Outcome, State
from harness.traffic.open_simulation import open_simulation
from harness.traffic.route_file import Departure
from harness.traffic.scene import OpenScene
from harness.traffic.simulation import Reading

_RUNNING, _GOAL = int(Outcome.RUNNING), int(Outcome.GOAL)  # NumPy would ask the enumeration each time
NEAREST = 16  # others that a game's bodies have room for


@dataclass(frozen=True)
class Seat:
    """A player's place in the arena: who drives, and on what payoff (None: nobody asks)."""

    driver: Driver | None
    """None: a learner, whose actions are given to `Arena.step`."""
    payoff: Payoff | None = None


@dataclass
class Step:
    """What a step brought. Arrays are [G, P]."""

    payoff: FloatArray
    drove: BoolArray
    """Who was still driving when the step began."""
    quantities: Quantities
    """As of the end of the step, before anyone left."""


class Arena:
    """G games on one scene, in which the same seats are taken."""

    def __init__(
        self,
        scene: OpenScene,
        games: int,
        seats: Sequence[Seat | Sequence[Seat]],
        seed: int = 0,
        recorded: bool = False,
    ) -> None:
        """Load SUMO. Every game has to be started with `reset` before the first step.

        A player may have several seats: `InitialState.member` says whose game it is. SUMO drives all of them or none.
        `recorded`: `reading` tells of all others in every step, and not only of those near a player (at a price).
        Raises SimulationError if SUMO can't load the scene.
        """
        self.scene, self.world, self.games = scene, scene.world, games
        self.seats = tuple((each,) if isinstance(each, Seat) else tuple(each) for each in seats)
        first = [of_player[0].driver for of_player in self.seats]
        self._taken_over = np.array([driver is None or driver.takes_over for driver in first])
        self._slack_m = slack_m(self._taken_over)
        self.simulation = open_simulation(scene, games, self._taken_over.tolist(), seed, recorded)
        players = len(self.seats)
        self.state = State.empty(games, players)
        self.observation: FloatArray = np.zeros((games, players, SIZE), dtype=np.float32)
        self._member = np.zeros((games, players), dtype=np.int64)
        drivers = [seat.driver for of_player in self.seats for seat in of_player if seat.driver is not None]
        self._asks_drivers = any(driver.takes_over for driver in drivers)
        self._noise = np.zeros((games, players, self.world.steps if self._asks_drivers else 0, 2))
        self._lapsed = np.zeros((games, players, self.world.steps), dtype=bool)
        self._lapsed_steering_rad = np.zeros((games, players, self.world.steps))
        self._limits = PlayersLimits(games, players, self.world.steps)
        self._all_games = np.arange(games)
        self.reading: Reading | None = None
        self._players_length = np.tile(self.world.length_m, (games, 1))
        self._players_width = np.tile(self.world.width_m, (games, 1))

    def reset(
        self, starts: Mapping[int, InitialState], departures: Mapping[int, list[Departure]] | None = None
    ) -> None:
        """(Re)start games, each from its `InitialState`, and look."""
        for game, start in starts.items():
            self._place(game, start)
            self.simulation.reset(game, start, list((departures or {}).get(game, [])))
            if self.reading is not None:
                self.reading.present[game] = False
        games = np.array(sorted(starts), dtype=np.int64)
        for player, seats in enumerate(self.seats):
            for member, seat in enumerate(seats):
                if seat.driver is not None:
                    seat.driver.reset(games if len(seats) == 1 else games[self._member[games, player] == member])
        seen = self.observation[games] = observe(self._first_quantities(games))
        check_observation(seen, games, self.state.step)

    def reload(self, seed: int) -> None:
        """Start SUMO anew from a seed, as assessment does before each game."""
        self.simulation.reload(seed)
        self.reading = None

    def step(self, actions: FloatArray | None = None) -> Step:
        """Play one step of every game. `actions` [G, P, 2] are the learners'; other seats' entries are ignored.

        Raises ImpossibleNumber where what came of it can't be right (`game.plausibility`), SimulationError where SUMO
        fails.
        """
        before = self.state
        state = self.state = before.copy()  # the quantities of the step before stay what they were
        drove = state.running
        acceleration, steering = self._decide(actions, drove)
        move(state, acceleration, steering, drove & self._taken_over, self.world.actuators, self.world.step_s)
        reading = self.simulation.step(state.x_m, state.y_m, state.heading_rad)
        self.reading = reading
        self._take_back(reading, drove)
        quantities = Quantities(self.world, state, self._bodies(state), *self._locate())
        state.step = state.step + 1
        if self._limits.misjudges:
            self._limits.look(state)
        self._terminations(quantities, drove)
        payoff = self._payoffs(quantities, drove)
        check_step(before, quantities, drove, payoff, self._slack_m)
        self._finish(quantities, drove)
        check_observation(self.observation, self._all_games, state.step)
        return Step(payoff, drove, quantities)

    def close(self) -> None:
        """Give SUMO back."""
        self.simulation.close()

    # --- the parts of a step -------------------------------------------------------------------------------------

    def _decide(self, actions: FloatArray | None, drove: BoolArray) -> tuple[FloatArray, FloatArray]:
        state = self.state
        now = np.minimum(state.step, self.world.steps - 1)
        chosen = np.zeros((*drove.shape, 2)) if actions is None else np.array(actions, dtype=float)
        for player, seats in enumerate(self.seats):
            if seats[0].driver is not None:
                chosen[:, player] = 0.0
            for member, seat in enumerate(seats):
                if seat.driver is None:
                    continue
                games = np.flatnonzero(drove[:, player] if len(seats) == 1 else self._theirs(drove, player, member))
                if seat.driver.takes_over and len(games):
                    noise = self._noise[games, player, now[games]]
                    decided = seat.driver.decide(games, self.observation[games, player], noise)
                    chosen[games, player] = checked_decisions(decided, seat.driver, player, games, state.step)
        if self._limits.delays:
            chosen = self._limits.arriving(chosen, now)
        acceleration, steering = requests(chosen, state.speed_mps, self.world.actuators)
        if self._limits.spares:
            acceleration, steering = self._limits.within(acceleration, steering)
        state.lapsed = release_controls(acceleration, steering, self._lapsed, self._lapsed_steering_rad, now, drove)
        return acceleration, steering

    def _take_back(self, reading: Reading, drove: BoolArray) -> None:
        if reading.players is None:
            return
        state = self.state
        for player in np.flatnonzero(~self._taken_over):
            games = np.flatnonzero(drove[:, player])
            x, y, heading, speed = reading.players[games, player].T
            gained = np.where(state.step[games] > 0, speed - state.speed_mps[games, player], 0.0)
            state.acceleration_mps2[games, player] = gained / self.world.step_s
            state.x_m[games, player], state.y_m[games, player] = x, y
            state.heading_rad[games, player], state.speed_mps[games, player] = heading, speed

    def _locate(self) -> tuple[FloatArray, FloatArray]:
        """How far each player came along its route, and where it is across it."""
        state, before = self.state, self.state.station_m
        state.station_m, offset = self.world.road.routes.locate(state.x_m, state.y_m, before)
        return state.station_m - before, offset

    def _terminations(self, quantities: Quantities, drove: BoolArray) -> None:
        state = self.state
        clearances_m = (quantities.vehicle_clearance_m, quantities.rail_clearance_m)
        time_is_up = state.step >= self.world.steps
        terminations(state.outcome, drove, self._taken_over, time_is_up, quantities.goal_m, *clearances_m)

    def _payoffs(self, quantities: Quantities, drove: BoolArray) -> FloatArray:
        payoff = np.zeros(drove.shape)
        for player, seats in enumerate(self.seats):
            for member, seat in enumerate(seats):
                if seat.payoff is not None:
                    paid = drove[:, player] if len(seats) == 1 else self._theirs(drove, player, member)
                    payoff[:, player] = np.where(paid, seat.payoff.total(quantities, player), payoff[:, player])
        return payoff

    def _theirs(self, drove: BoolArray, player: int, member: int) -> BoolArray:
        """[G] the games in which a player drove who is this one of its drivers."""
        return drove[:, player] & (self._member[:, player] == member)

    def _finish(self, quantities: Quantities, drove: BoolArray) -> None:
        """Who reached the goal leaves, who crashed stands; then everyone looks."""
        outcome = self.state.outcome
        ended = drove & (outcome != _RUNNING)
        if not ended.any():
            self.observation = observe(quantities)
            return
        for (game, player), how in zip(np.argwhere(ended).tolist(), outcome[ended].tolist(), strict=True):
            if how == _GOAL:
                self.simulation.remove(game, player)
            else:
                self.simulation.halt(game, player)
        self.state = self.state.copy()  # `quantities` keeps what was true at the end of the step
        self._stop(ended)
        # Everyone is in the same place, though some are slower, or gone.
        there = (self._bodies(self.state), quantities.advanced_m, quantities.lateral_offset_m)
        self.observation = observe(Quantities(self.world, self.state, *there))

    def _stop(self, ended: BoolArray) -> None:
        state = self.state
        state.present &= ~(ended & (state.outcome == _GOAL))
        state.speed_mps[ended] = 0.0
        state.acceleration_mps2[ended] = 0.0
        state.lapsed[ended] = False

    # --- what the players see ------------------------------------------------------------------------------------

    def _place(self, game: int, start: InitialState) -> None:
        state = self.state
        state.x_m[game], state.y_m[game], state.heading_rad[game] = start.x_m, start.y_m, start.heading_rad
        state.speed_mps[game], state.present[game] = start.speed_mps, start.present
        state.acceleration_mps2[game] = state.steering_rad[game] = 0.0
        state.unseen_behind_m[game], self._member[game] = start.unseen_behind_m, start.member
        state.outcome[game], state.lapsed[game], state.step[game] = _RUNNING, False, 0
        for player in range(len(self.seats)):
            self._lapsed[game, player] = start.lapses[player].lapsed
            self._lapsed_steering_rad[game, player] = start.lapses[player].steering_rad
            self._limits.reset(game, player, start.limits[player], state)
        if self._asks_drivers:
            self._noise[game] = start.noise

    def _first_quantities(self, games: IntArray) -> Quantities:
        """Of games [N] that start: nobody knows yet where along its route a player is."""
        state, routes = self.state.of(games), self.world.road.routes
        start = routes.find(state.x_m, state.y_m)
        state.station_m, offset = routes.locate(state.x_m, state.y_m, start)
        self.state.station_m[games] = state.station_m
        return Quantities(self.world, state, self._bodies(state, games), np.zeros_like(offset), offset)

    def _bodies(self, state: State, games: IntArray | slice = slice(None)) -> Bodies:
        """Players first, then the others nearest to them: in all games, or in some, of which the state is."""
        reading, motion = self.reading, (state.x_m, state.y_m, state.heading_rad, state.speed_mps)
        players = Bodies(*motion, self._players_length[games], self._players_width[games], state.present.copy())
        if reading is None or not reading.present.size:
            return players
        others = Bodies(
            reading.x_m[games],
            reading.y_m[games],
            reading.heading_rad[games],
            reading.speed_mps[games],
            reading.length_m[games],
            reading.width_m[games],
            reading.present[games],
        )
        return players.with_nearest(others, NEAREST, NOTICED_M)
