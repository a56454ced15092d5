"""One recorded game: everything that is computed of a game is computed from this record of its trace.

The games' axis of `game.quantities`, on which payoffs and observations are based, is the steps' axis here: row t of
arrays [T, P] is step t, and row 0 is the start. P are the players, B all bodies: players, other road users, obstacles.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from harness.evaluation.encounters import Encounter, encounters_of
from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.geometry import Box, box_distance
from harness.game.junctions import SIGNALS, Signal
from harness.game.outcome import Outcome
from harness.game.quantities import Quantities
from harness.game.roles import EGO
from harness.game.state import Bodies, PlayersMotion, State, nearest_to_players
from harness.game.traffic_rules import since_change_s
from harness.game.world import World


@dataclass(frozen=True, kw_only=True)
class BodyKind:
    """A vehicle type, as far as contacts depend on it. The defaults are those of SUMO."""

    length_m: float = 5.0
    width_m: float = 1.8
    vehicle_class: str = "passenger"


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedGame:
    """A game from its trace, the constants of its scene, and the vehicle types (SUMO's default without an entry)."""

    trace: pd.DataFrame
    """Columns of a schema of `trace_file.schema_of`."""
    world: World
    kinds: Mapping[str, BodyKind]

    @cached_property
    def obstacles(self) -> tuple[str, ...]:
        """The names of the obstacles, in the order of the scene."""
        return tuple(f"obstacle_{number}" for number in range(1, len(self.world.hiding.obstacles) + 1))

    @cached_property
    def names(self) -> tuple[str, ...]:
        others = set(self.trace["player"]) - {*self.world.roles, *self.obstacles}
        return (*self.world.roles, *sorted(others), *self.obstacles)

    @cached_property
    def body_kinds(self) -> tuple[BodyKind, ...]:
        """[B] by the vehicle type in the trace; that of an absent body is the default."""
        first = self.trace.drop_duplicates("player")
        types = dict(zip(first["player"], first["vehicle_type"], strict=True))
        return tuple(self.kinds.get(str(types.get(name)), BodyKind()) for name in self.names)

    @cached_property
    def bodies(self) -> Bodies:
        """All bodies, [T, B]. A body that is not present in a step has no place there."""
        sizes = np.array([(kind.length_m, kind.width_m) for kind in self.body_kinds])
        present = self._present
        length_m, width_m = (np.tile(column, (len(present), 1)) * present.any(0) for column in sizes.T)
        x_m, y_m, heading_rad, speed_mps = map(self._filled, ("x_m", "y_m", "heading_rad", "speed_mps"))
        return Bodies(x_m, y_m, heading_rad, speed_mps, length_m, width_m, present)

    def box(self, step: int, body: int) -> Box:
        return Box(*(float(getattr(self.bodies, name)[step, body]) for name in Box._fields))

    def velocity_mps(self, step: int, body: int) -> FloatArray:
        heading = self.bodies.heading_rad[step, body]
        return np.array([np.cos(heading), np.sin(heading)]) * self.bodies.speed_mps[step, body]

    def nearest(self, step: int, player: int) -> int | None:
        """The body that is nearest to a player by the distance of their boxes; None if no other is present."""
        others = [body for body in np.flatnonzero(self.bodies.present[step]).tolist() if body != player]
        own = self.box(step, player)
        return min(others, key=lambda body: box_distance(own, self.box(step, body)), default=None)

    @cached_property
    def outcomes(self) -> tuple[Outcome, ...]:
        """[P] how each player's game ended; `RUNNING` for a player that is absent or was still driving."""
        ended = self.trace[self.trace["outcome"] != ""].drop_duplicates("player")
        words = dict(zip(ended["player"], ended["outcome"], strict=True))
        return tuple(_OUTCOMES[words.get(role, "")] for role in self.world.roles)

    @cached_property
    def drove(self) -> BoolArray:
        """[T, P] whether a player was driving: present, and its game had not ended in an earlier step."""
        players = len(self.world.roles)
        running = self._filled("outcome", self.trace["outcome"].to_numpy() == "")[:, :players]
        before = np.concatenate((np.ones((1, players), dtype=bool), running[:-1]))
        return self._present[:, :players] & before

    def last_step(self, player: int) -> int | None:
        """The step in which a player's game ended; None for an absent player."""
        steps = np.flatnonzero(self.drove[:, player])
        return int(steps[-1]) if len(steps) else None

    @cached_property
    def steers(self) -> BoolArray:
        """[P] whether the harness moved a player: the steering of SUMO's own models is not known."""
        return np.asarray(self._filled("steers")[:, : len(self.world.roles)].any(0))

    def flags(self, column: str) -> BoolArray | None:
        """[T, P] where `trace_columns.SHIELDED` is true, or a column of `PERCEIVED` says something; None: the arm has
        no shield, or no perception errors."""
        if column not in self.trace.columns:
            return None
        return self._filled("", self.trace[column].to_numpy().astype(bool))[:, : len(self.world.roles)]

    def lost_by_ego(self, body: int) -> BoolArray:
        """[T] whether the ego's perception has lost a body."""
        if "ego_lost" not in self.trace.columns:
            return np.zeros(len(self._present), dtype=bool)
        lost = self._filled("ego_lost")[:, EGO]
        return np.array([self.names[body] in str(names).split() for names in lost], dtype=bool)

    @cached_property
    def payoff(self) -> FloatArray:
        """[T, P] each player's payoff of the step."""
        return self._filled("payoff")[:, : len(self.world.roles)]

    @cached_property
    def quantities(self) -> Quantities:
        """The quantities of every step as they were when the game was played: among the bodies that a game considers
        (the `NEAREST` others within `NOTICED_M` of a player)."""
        state, routes = self._state, self.world.road.routes
        before_m = np.concatenate((state.station_m[:1], state.station_m[:-1]))
        state.station_m, offset_m = routes.locate(state.x_m, state.y_m, before_m)
        bodies = self.bodies._replace(present=self.bodies.present & self._considered)
        gained_mps2 = np.diff(state.acceleration_mps2, axis=0, prepend=state.acceleration_mps2[:1])
        return Quantities(self.world, state, bodies, state.station_m - before_m, offset_m, gained_mps2)

    @cached_property
    def lane_centre_m(self) -> FloatArray:
        """[T, P] the centre of the lane nearest to each player, to the left of its route."""
        routes, state = self.world.road.routes, self.quantities.state
        return nearest_lane_m(routes.lane_offset_m[routes.rows(state.station_m)], self.quantities.lateral_offset_m)

    @cached_property
    def _considered(self) -> BoolArray:
        """[T, B]"""
        players, result = len(self.world.roles), np.ones(self.bodies.present.shape, dtype=bool)
        others = slice(players, len(self.names) - len(self.obstacles))
        of_others, of_players = (
            Bodies._make(np.ascontiguousarray(column[:, each]) for column in self.bodies)
            for each in (others, slice(players))
        )
        nearest, considered = nearest_to_players(of_others, of_players)
        result[:, others] = False
        np.put_along_axis(result[:, others], nearest, considered, axis=1)
        return result

    @cached_property
    def encounters(self) -> tuple[tuple[Encounter, ...], ...]:
        """[P] the encounters of each player with other road users at junctions, near or far."""
        q = self.quantities
        everyone = Quantities(q.world, q.state, self.bodies, q.advanced_m, q.lateral_offset_m, q.gained_mps2)
        return tuple(tuple(encounters_of(everyone, player, drove)) for player, drove in enumerate(self.drove.T))

    def while_driving(self, values: NDArray, player: int) -> NDArray:
        """[N] the values [T, P] of a player in the steps that it drove, without the start."""
        return np.asarray(values[1:][self.drove[1:, player], player])

    @cached_property
    def _places(self) -> tuple[IntArray, IntArray]:
        column = self.trace["player"].map({name: place for place, name in enumerate(self.names)})
        return self.trace["step"].to_numpy(dtype=np.int64), column.to_numpy(dtype=np.int64)

    def _filled(self, name: str, values: NDArray | None = None) -> NDArray:
        """[T, B] a column of the trace, or other values of its rows; 0 where a body is absent."""
        values = self.trace[name].to_numpy() if values is None else values
        filled = np.zeros((int(self._places[0].max()) + 1, len(self.names)), dtype=values.dtype)
        filled[self._places] = values
        return filled

    @cached_property
    def _present(self) -> BoolArray:
        return self._filled("", np.ones(len(self.trace), dtype=bool))

    @cached_property
    def _state(self) -> State:
        players, links = len(self.world.roles), self.world.right_of_way.signal_links
        state = State.empty(len(self._present), players, len(links))
        for name in _PLAYERS:
            setattr(state, name, self._filled(name)[:, :players].copy())
        state.present = self._present[:, :players].copy()
        state.step = np.arange(len(self._present))
        start = self.trace.iloc[0]
        state.friction[:], state.limit_share[:] = start["friction"], start["limit_share"]
        if links:
            steps = self.trace.drop_duplicates("step")
            states = [_states_of(str(text), tuple(links)) for text in steps["signals"]]
            state.signals[steps["step"]] = states
            state.signal_s = _since_s(state.signals, str(start["signal_s"]), self.world.step_s)
        return state


_PLAYERS = (*PlayersMotion._fields, "lapsed")
_OUTCOMES = {outcome.word: outcome for outcome in Outcome}


def nearest_lane_m(lanes_m: FloatArray, offset_m: FloatArray) -> FloatArray:
    """[...] the centre of the lane nearest to each offset [...], of lanes with the centres [..., L] (NaN: none)."""
    away_m = np.abs(lanes_m - offset_m[..., None])
    nearest = np.where(np.isnan(away_m), np.inf, away_m).argmin(-1)
    return np.take_along_axis(lanes_m, nearest[..., None], -1)[..., 0]


@lru_cache(maxsize=1024)
def _states_of(text: str, links: tuple[tuple[str, int], ...]) -> tuple[int, ...]:
    """The states of links in a cell of the trace, `id=state` of each light separated by spaces."""
    lights = dict(each.rpartition("=")[::2] for each in text.split())  # an id may contain '='
    letters = (lights.get(light, "")[link : link + 1] for light, link in links)
    return tuple(int(SIGNALS.get(letter, Signal.OFF)) for letter in letters)


def _since_s(signals: IntArray, at_start: str, step_s: float) -> FloatArray:
    """[T, L] seconds since each signal changed, from its states [T, L] and the seconds at the start."""
    seconds = np.zeros(signals.shape)
    seconds[0] = [float(each) for each in at_start.split()]
    for step in range(1, len(signals)):
        before, now = slice(step - 1, step), slice(step, step + 1)
        seconds[now] = since_change_s(signals[before], signals[now], seconds[before], step_s)
    return seconds
