"""The arena: G games in one SUMO simulation. Its step is the only stepping loop of the harness.

docs/architecture.md has the eight parts of a step. Impossible numbers end it with an error (`game.sanity_checks`):
decisions are checked before part 3, motion and payoffs before part 7, observations after part 8.

The random numbers of a game are drawn when it is reset (`game.initial_state`). Training and assessment use this loop.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from harness.drivers.protocol import Planner, planner_of
from harness.environments.cartesian_views import CartesianViews
from harness.environments.knowledge import Knowledge
from harness.environments.live_simulation import LiveSimulation
from harness.environments.nearby_bodies import NearbyBodies
from harness.environments.seats import Seat, taken_over, with_walkers
from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.bicycle import Requested, along_rail, move, requests, slide
from harness.game.human_factors import PlayersLimits
from harness.game.initial_state import InitialState
from harness.game.observation_layout import SIZE
from harness.game.outcome import Outcome
from harness.game.quantities import Quantities
from harness.game.sanity_checks import check_observation, check_step, checked_decisions
from harness.game.state import State, terminations
from harness.game.walking import walk
from harness.road.demand.route_file import Departure
from harness.road.scene.open_scene import OpenScene
from harness.sumo.scene_games import SceneGames
from harness.sumo.simulation import Reading, Simulation, with_game
from harness.sumo.subprocess_simulation import open_simulations

__all__ = ["Arena", "Seat", "Step"]

# comparing arrays with members of an enumeration is slower
_RUNNING, _GOAL = int(Outcome.RUNNING), int(Outcome.GOAL)
_COLLISION, _RAIL = int(Outcome.COLLISION), int(Outcome.RAIL)


@dataclass(kw_only=True)
class Step:
    """The result of a step, of `Arena.step`. Arrays are [G, P]."""

    payoff: FloatArray
    drove: BoolArray
    """Whether the player was still driving when the step began."""
    quantities: Quantities
    """At the end of the step, before a player is removed."""
    observation: FloatArray
    """[G, P, SIZE] what the players observe then."""


class _Placed(NamedTuple):
    """What a step knows of the time before it."""

    before: State
    drove: BoolArray
    sliding: BoolArray


class Arena(LiveSimulation):
    """G games on one scene with the same seats.

    >>> import harness
    >>> Arena(harness.open_scene("merge"), games=2, seats=[Seat(harness.SumoDriver())] * 2).close()
    """

    def __init__(
        self,
        scene: OpenScene,
        games: int,
        seats: Sequence[Seat | Sequence[Seat]],
        *,
        seed: int = 0,
        recorded: bool = False,
        simulation: Simulation | None = None,
    ) -> None:
        """Load SUMO, or use another `simulation`. Each game needs a `reset` before the first step.

        `seats` has one entry per player: a seat, or several, of which `InitialState.member` selects one per game. SUMO
        drives all seats of a player or none; where it can't, in the place of a pedestrian, an ordinary walker does.
        Another simulation drives all. `recorded`: `reading` contains all background vehicles in every step, not only
        those near a player; this costs time. Raises SimulationError if SUMO can't load the scene.
        """
        self.scene, self.world, self.games = scene, scene.world, games
        self.seats = tuple((each,) if isinstance(each, Seat) else tuple(each) for each in seats)
        if simulation is None:
            self.seats = with_walkers(self.seats, scene.world)
        self._learns = np.array([of_player[0].driver is None for of_player in self.seats])
        self._taken_over = np.array(taken_over(self.seats))
        self._on_wheels = self._taken_over & ~self.world.walks
        if simulation is None:
            own = SceneGames(scene=scene, games=games, taken_over=taken_over(self.seats), recorded=recorded)
            [simulation] = open_simulations([own], seed=seed)
        self.simulation = simulation
        players = len(self.seats)
        self.state = State.empty(games, players, len(self.world.right_of_way.signal_links))
        self.observation: FloatArray = np.zeros((games, players, SIZE), dtype=np.float32)
        self.member: IntArray = np.zeros((games, players), dtype=np.int64)  # the seat that a player has in a game
        drivers = [seat.driver for of_player in self.seats for seat in of_player if seat.driver is not None]
        self._has_drivers = any(driver.takes_over for driver in drivers)
        self._noise = np.zeros((games, players, self.world.steps if self._has_drivers else 0, 2))
        self._course_rad: FloatArray = np.zeros((games, players))  # of players that slide
        self._limits = PlayersLimits(games, players, self.world.steps)
        self._road_steering_rad: FloatArray = np.zeros((games, players))
        self._all_games = np.arange(games)
        self.reading: Reading | None = None
        self.signal_texts = [""] * games
        """States of the traffic lights as `Reading.signal_texts`; up to date if games are recorded."""
        self.nearby = NearbyBodies(self.world, scene.obstacles, games)
        self.knowledge = Knowledge(scene, games, (self._limits, self.nearby), self._taken_over)
        self._views = CartesianViews(scene, (self.nearby, self.simulation), self._taken_over)

    def reset(
        self, starts: Mapping[int, InitialState], departures: Mapping[int, list[Departure]] | None = None
    ) -> None:
        """Reset games, each to its `InitialState` and with its departures of background traffic, and observe."""
        for game, start in starts.items():
            self._place(game, start)
            at_reset = self.simulation.reset(game, start, list((departures or {}).get(game, [])))
            self.state.signals[game], self.state.signal_s[game] = at_reset.states, at_reset.since_s
            self.signal_texts[game] = at_reset.text
            if at_reset.background is not None:
                self.reading = with_game(self.reading, self.games, game, at_reset.background)
            elif self.reading is not None:
                self.reading.present[game] = False
        games = np.array(sorted(starts), dtype=np.int64)
        for _, seat, plays in self._seats_in(np.ones(self.state.present.shape, dtype=bool)):
            if seat.driver is not None:
                seat.driver.reset(games[plays[games]])
        self._views.reset(games)
        self.knowledge.reset(starts, self.state)
        quantities = self.first_quantities(games)
        observation = self.observation[games] = self._observed(quantities, games, advance=True)
        self._road_steering_rad[games] = quantities.along.road_steering_rad
        check_observation(observation, games, self.state.step)

    def reload(self, seed: int) -> None:
        """Reload SUMO with a seed, as assessment does before each game."""
        self.simulation.reload(seed)
        self.reading = None

    def step(self, actions: FloatArray | None = None) -> Step:
        """Play one step of every game. `actions` [G, P, 2] are the learners'; entries of other seats are ignored.

        Raises ImpossibleNumber if a number is impossible (`game.sanity_checks`), SimulationError if SUMO fails.
        """
        self.place(actions)
        return self.advance()

    def place(self, actions: FloatArray | None = None) -> None:
        """The first half of `step`: the players decide and move. Arenas whose simulations share a SUMO do this before
        one of them goes on. Raises as `step` does."""
        before = self.state
        state = self.state = before.copy()  # the quantities of the step before refer to the old state
        drove = state.running
        acceleration, steering = self._decide(actions, drove)
        world = self.world
        requested = Requested(acceleration, steering, drove & self._on_wheels)
        move(state, requested, world.actuators, world.step_s)
        if world.walks.any():
            walk(state, requested._replace(moving=drove & world.walks), world.actuators, world.step_s)
        sliding = self._sliding(drove)
        if sliding.any():
            slide(state, sliding, self._course_rad, world.step_s)
        self.simulation.place(state.x_m, state.y_m, state.heading_rad)
        self._placed = _Placed(before, drove, sliding)

    def advance(self) -> Step:
        """The second half of `step`: SUMO's step, and what follows from it. Raises as `step` does."""
        before, drove, sliding = self._placed
        state, world = self.state, self.world
        reading = self.reading = self.simulation.step()
        self.signal_texts = list(reading.signal_texts or self.signal_texts)
        reading.write_to(state, drove & ~self._taken_over, world.step_s)
        state.station_m, offset_m = world.road.routes.locate(state.x_m, state.y_m, before.station_m)
        quantities = self._quantities(state, before, offset_m)
        state.step = state.step + 1
        if self._limits.lapses.held.any():
            self._limits.end_glances(state, quantities.leader_ttc_s)
        if self._limits.misjudges:
            self._limits.look(state)
        distances_m = (quantities.goal_m, quantities.vehicle_clearance_m, quantities.rail_clearance_m)
        terminations(state.outcome, drove, (self._taken_over, state.step >= world.steps), distances_m)
        payoff = self._payoffs(quantities, drove)
        check_step(before, quantities, drove=drove, payoff=payoff, taken_over=self._taken_over)
        observation = self._finish(quantities, drove, sliding)
        check_observation(self.observation, self._all_games, state.step)
        return Step(payoff=payoff, drove=drove, quantities=quantities, observation=observation)

    def close(self) -> None:
        self.simulation.close()

    # --- the parts of a step -------------------------------------------------------------------------------------

    def _decide(self, actions: FloatArray | None, drove: BoolArray) -> tuple[FloatArray, FloatArray]:
        state = self.state
        now = np.minimum(state.step, self.world.steps - 1)
        chosen: FloatArray = np.zeros((*drove.shape, 2))
        if actions is not None:
            chosen[:, self._learns] = np.asarray(actions, dtype=float)[:, self._learns]
        for player, seat, plays in self._seats_in(drove):
            games = np.flatnonzero(plays)
            if seat.driver is not None and seat.driver.takes_over and len(games):
                noise = self._noise[games, player, now[games]]
                if (planner := planner_of(seat.driver)) is not None:
                    self._show(planner, player, games)
                decided = seat.driver.decide(games, self.observation[games, player], noise)
                of = f"{self.world.roles[player]}, {type(seat.driver).__name__},"
                chosen[games, player] = checked_decisions(decided, of, games, state.step)
        acceleration, steering = requests(chosen, state.speed_mps, self._road_steering_rad, self.world.actuators)
        if self._limits.spares:
            acceleration, steering = self._limits.within(acceleration, steering)
        road, wheelbase_m = (self._road_steering_rad, self.world.road.routes), self.world.actuators.wheelbase_m
        state.lapsed = self._limits.lapses.omit_actions((acceleration, steering), state, road, wheelbase_m, drove)
        return acceleration, steering

    def _payoffs(self, quantities: Quantities, drove: BoolArray) -> FloatArray:
        payoff = np.zeros(drove.shape)
        for player, seat, paid in self._seats_in(drove):
            if seat.payoff is not None:
                payoff[paid, player] = seat.payoff.total(quantities, player)[paid]
        return payoff

    def _seats_in(self, plays: BoolArray) -> Iterator[tuple[int, Seat, BoolArray]]:
        """Each seat with its player, and the games [G] of `plays` [G, P] in which the player has this seat."""
        for player, seats in enumerate(self.seats):
            for member, seat in enumerate(seats):
                own = plays[:, player]
                yield player, seat, own if len(seats) == 1 else own & (self.member[:, player] == member)

    def _sliding(self, drove: BoolArray) -> BoolArray:
        """[G, P] players that have crashed and still move."""
        crashed = (self.state.outcome == _COLLISION) | (self.state.outcome == _RAIL)
        return crashed & ~drove & self._on_wheels & self.state.present & (self.state.speed_mps > 0.0)

    def _finish(self, quantities: Quantities, drove: BoolArray, sliding: BoolArray) -> FloatArray:
        """Remove players that reached their goal, let those that crashed slide, and observe. Returns the observations
        before that."""
        outcome = self.state.outcome
        ended = drove & (outcome != _RUNNING)
        changed = np.flatnonzero((ended | sliding).any(1))
        if not len(changed):
            return self._remember_and_observe(quantities, changed)
        for (game, player), reached in zip(np.argwhere(ended).tolist(), outcome[ended].tolist(), strict=True):
            if reached == _GOAL:
                self.simulation.remove(game, player)
            else:
                self.simulation.halt(game, player)
        state = self.state = self.state.copy()  # `quantities` refers to the old state
        state.present &= ~(ended & (outcome == _GOAL))
        slides = ended & self._on_wheels & (outcome != _GOAL) & (state.step[:, None] < self.world.steps)
        self._course_rad = np.where(slides, state.heading_rad, self._course_rad)
        at_rail = (slides | sliding) & (quantities.rail_clearance_m <= 0.0)
        if at_rail.any():
            self._course_rad = along_rail(state, at_rail, self._course_rad, self.world.road.routes)
        state.speed_mps[ended & ~slides] = 0.0
        state.acceleration_mps2[ended] = 0.0
        state.lapsed[ended] = False
        return self._remember_and_observe(quantities, changed)

    def _remember_and_observe(self, quantities: Quantities, changed: IntArray) -> FloatArray:
        """Observe what the players know, and keep the steering that follows the road for the next decisions.

        `quantities` are those before players were removed, stopped or turned along a rail in the games `changed` [N].
        Returns the observations of that time.
        """
        self.knowledge.remember(self.state)
        self._road_steering_rad = quantities.along.road_steering_rad
        observed = self.observation = self._observed(quantities, self._all_games, advance=True)
        if len(changed):
            # Positions are unchanged: only speeds are, and which players are present.
            state = self.state.of(changed)
            columns = ("advanced_m", "lateral_offset_m", "gained_mps2")
            of_games = {name: getattr(quantities, name)[changed] for name in columns}
            bodies = self.nearby.of(state, self.reading, changed)
            after = Quantities(world=self.world, state=state, bodies=bodies, **of_games)
            self.observation = observed.copy()
            self.observation[changed] = self._observed(after, changed)
            self._road_steering_rad = self._road_steering_rad.copy()
            self._road_steering_rad[changed] = after.along.road_steering_rad
        return observed

    def _observed(self, quantities: Quantities, games: IntArray, *, advance: bool = False) -> FloatArray:
        return self.knowledge.observations(quantities, self.state.step, self.reading, games, advance=advance)

    def _show(self, planner: Planner, player: int, games: IntArray) -> None:
        """Show a planner what its player sees in games [N]; the players' ways do not matter for it."""
        state = self.state.of(games)
        quantities = self._quantities(state, state, np.zeros(state.x_m.shape), games)
        known = self.knowledge.seen(quantities, self.state.step, self.reading, games)
        self._views.show(planner, player, games, (quantities, known, self.reading))

    # --- observations ------------------------------------------------------------------------------------

    def _place(self, game: int, start: InitialState) -> None:
        state = self.state
        state.x_m[game], state.y_m[game], state.heading_rad[game] = start.x_m, start.y_m, start.heading_rad
        state.speed_mps[game], state.present[game] = start.speed_mps, start.present
        state.station_m[game] = start.station_m
        state.friction[game], state.visibility_m[game] = start.friction, start.visibility_m
        state.limit_share[game] = start.limit_share
        state.acceleration_mps2[game] = state.steering_rad[game] = 0.0
        state.shoulder_glance[game], self.member[game] = start.shoulder_glance, start.member
        state.outcome[game], state.lapsed[game], state.step[game] = _RUNNING, False, 0
        self.nearby.place(game, start)
        for player in range(len(self.seats)):
            self._limits.reset(game, player, start.limits[player], start.lapses[player], state)
        if self._has_drivers:
            self._noise[game] = start.noise

    def first_quantities(self, games: IntArray) -> Quantities:
        """Quantities of games [N] after a reset."""
        state, routes = self.state.of(games), self.world.road.routes
        state.station_m, offset_m = routes.locate(state.x_m, state.y_m, state.station_m)
        self.state.station_m[games] = state.station_m
        return self._quantities(state, state, offset_m, games)

    def _quantities(
        self, state: State, before: State, offset_m: FloatArray, games: IntArray | slice = slice(None)
    ) -> Quantities:
        """Quantities of `games`, whose players have this state, the one before, and a lateral offset."""
        return Quantities(
            world=self.world,
            state=state,
            bodies=self.nearby.of(state, self.reading, games),
            advanced_m=state.station_m - before.station_m,
            lateral_offset_m=offset_m,
            gained_mps2=state.acceleration_mps2 - before.acceleration_mps2,
        )
