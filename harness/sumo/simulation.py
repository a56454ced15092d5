"""The interface of a SUMO simulation that plays G games, in this process or in another one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import NamedTuple, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.initial_state import InitialState
from harness.game.jit import compiled
from harness.game.state import Bodies, State
from harness.game.traffic_rules import since_change_s
from harness.road.demand.route_file import Departure
from harness.road.net.levels import on_players_level

Players: TypeAlias = tuple[FloatArray, FloatArray, BoolArray]
"""x_m and y_m of the players' centres, and which are present, [G, P] each."""


@dataclass
class Reading:
    """The background vehicles [G, M] after a step, padded where not present, and the players that SUMO drives.

    A reading has at least the background vehicles within `game.state.NOTICED_M` of a player, and all of them if games
    are recorded. Poses are those of the body's centre.
    """

    names: NDArray[np.object_]
    types: NDArray[np.object_]
    x_m: FloatArray
    y_m: FloatArray
    heading_rad: FloatArray
    speed_mps: FloatArray
    length_m: FloatArray
    width_m: FloatArray
    present: BoolArray
    players: FloatArray | None = None
    """[G, P, 4] x_m, y_m, heading_rad, speed_mps; NaN for players that the harness drives, None if it drives all."""
    signals: IntArray | None = None
    """[G, L] int8 states of the signal links of the scene's right of way; None if it has none."""
    signal_texts: tuple[str, ...] | None = None
    """[G] the whole states of the traffic lights on the players' routes, as `id=state` separated by spaces, if games
    are recorded."""

    def write_to(self, state: State, driven: BoolArray, step_s: float) -> None:
        """Write the signals, and the motion of the players that SUMO drives, `driven` [G, P], to the state of the step
        before."""
        if self.signals is not None:
            state.signal_s = since_change_s(state.signals, self.signals, state.signal_s, step_s)
            state.signals = self.signals
        if self.players is not None and driven.any():
            x_m, y_m, heading_rad, speed_mps = self.players[driven].T
            gained_mps = np.where(state.step[np.nonzero(driven)[0]] > 0, speed_mps - state.speed_mps[driven], 0.0)
            state.acceleration_mps2[driven] = gained_mps / step_s
            state.x_m[driven], state.y_m[driven] = x_m, y_m
            state.heading_rad[driven], state.speed_mps[driven] = heading_rad, speed_mps


class AtReset(NamedTuple):
    """A game after a reset: states of signal links [L], seconds since they changed [L], the text of its lights, and the
    background vehicles on the road [1, M] (None: there are none)."""

    states: IntArray
    since_s: FloatArray
    text: str
    background: Reading | None = None


TURN_SIGNALS = ("off", "right", "left", "both")
"""By the two lowest bits of SUMO's vehicle signals, the right and the left indicator."""
NO_SIGNALS = AtReset(np.zeros(0, dtype=np.int8), np.zeros(0), "")
_OF_VEHICLES = ("names", "types", *Bodies._fields)


def with_game(reading: Reading | None, games: int, game: int, background: Reading) -> Reading:
    """A reading of `games` games in which one game has the background vehicles [1, M] of `background`; None: empty."""
    most = background.present.shape[1]
    columns = {}
    for name in _OF_VEHICLES:
        row = getattr(background, name)
        column = row[:, :0].repeat(games, axis=0) if reading is None else getattr(reading, name)
        nothing = None if row.dtype == object else 0
        more = max(most - column.shape[1], 0)
        wider = (column, np.full((games, more), nothing, dtype=row.dtype))
        columns[name] = np.concatenate(wider, axis=1) if more else column.copy()
        columns[name][game] = nothing
        columns[name][game, :most] = row[0]
    return Reading(**columns) if reading is None else replace(reading, **columns)


def side_by_side(first: Reading, second: Reading) -> Reading:
    """A reading [G, M + N] with the bodies of two readings [G, M] and [G, N]."""
    pairs = ((getattr(first, name), getattr(second, name)) for name in _OF_VEHICLES)
    return Reading(*(np.concatenate(pair, axis=1) for pair in pairs))


def reading_of(
    games: int,
    of_game: IntArray,
    *,
    names: Sequence[str] | NDArray[np.object_],
    types: Sequence[str] | NDArray[np.object_],
    motion: Sequence[FloatArray],
    sizes_m: Sequence[FloatArray | Sequence[float]],
) -> Reading:
    """The reading of bodies [n], sorted by their game: names, types, motion [4, n] (x_m and y_m of the front bumper,
    heading_rad, speed_mps) and sizes [2, n] (length and width)."""
    (front_x_m, front_y_m, heading_rad, speed_mps), (length_m, width_m) = motion, np.array(sizes_m)
    back_x_m, back_y_m = 0.5 * length_m * np.cos(heading_rad), 0.5 * length_m * np.sin(heading_rad)
    values = (front_x_m - back_x_m, front_y_m - back_y_m, heading_rad, speed_mps, length_m, width_m)
    column, numbers, present = _padded(np.array(values), of_game, games)
    words = np.full((2, *present.shape), None, dtype=object)
    words[0, of_game, column], words[1, of_game, column] = names, types
    x_m, y_m, heading_rad, speed_mps, length_m, width_m = numbers
    return Reading(words[0], words[1], x_m, y_m, heading_rad, speed_mps, length_m, width_m, present)


@compiled
def _padded(values: FloatArray, of_game: IntArray, games: int) -> tuple[IntArray, FloatArray, BoolArray]:
    """The column [n] of each body in its game, the values [V, n] of the bodies as [V, G, M], and [G, M] where a body
    is. `of_game` [n] is sorted."""
    column, most = np.zeros(len(of_game), dtype=np.int64), min(len(of_game), 1)
    for k in range(1, len(of_game)):
        column[k] = column[k - 1] + 1 if of_game[k] == of_game[k - 1] else 0
        most = max(most, column[k] + 1)
    numbers, present = np.zeros((len(values), games, most)), np.zeros((games, most), dtype=np.bool_)
    for k in range(len(of_game)):
        present[of_game[k], column[k]] = True
        for row in range(len(values)):
            numbers[row, of_game[k], column[k]] = values[row, k]
    return column, numbers, present


def distance_to_player_m(fronts_m: FloatArray, of_game: IntArray, players: Players) -> FloatArray:
    """[n] distances of front bumpers [n, 2] in games [n] to the nearest player that is present; inf without one."""
    x_m, y_m, present = (column[of_game] for column in players)
    distances_m = np.hypot(fronts_m[:, :1] - x_m, fronts_m[:, 1:] - y_m)
    return np.where(present, distances_m, np.inf).min(1)


class TypeNames(NamedTuple):
    """The names that the vehicle types of a scene have in SUMO."""

    prefix: str
    own: frozenset[str]
    """The ids of the scene's types. Others are SUMO's own, such as `DEFAULT_VEHTYPE`."""

    def in_sumo(self, vehicle_type: str) -> str:
        return self.prefix + vehicle_type if vehicle_type in self.own else vehicle_type

    def plain(self, in_sumo: str) -> str:
        return in_sumo.removeprefix(self.prefix)


@dataclass(frozen=True, kw_only=True)
class Tiles:
    """The tiles of the games: copies of the net, side by side."""

    prefixes: Sequence[str]
    """Of all names in the tile of each game."""
    offsets_m: FloatArray
    """[G] in y"""
    roads_m: FloatArray | None
    """[n, 3] points of the players' roads; None if all roads are on one level."""
    types: TypeNames

    def has(self, name: str) -> bool:
        """Whether a name in SUMO is one of these tiles."""
        return name.startswith(tuple(self.prefixes))

    def points_m(self, points: Iterable[tuple[float, ...]], of_game: IntArray, size: int = 2) -> FloatArray:
        """[n, size] the points of SUMO in games [n], in the coordinates of the net."""
        found = np.fromiter(chain.from_iterable(points), float, size * len(of_game)).reshape(-1, size)
        found[:, 1] -= self.offsets_m[of_game]
        return found

    def on_level(self, points: Iterable[tuple[float, ...]], of_game: IntArray) -> BoolArray:
        """[n] whether points of SUMO in games [n], with their heights, are on the level of the players' roads."""
        if self.roads_m is None or not len(of_game):
            return np.ones(len(of_game), dtype=bool)
        return on_players_level(self.roads_m, self.points_m(points, of_game, 3))


class Simulation(Protocol):
    """A SUMO simulation of G games. Every method but `close` raises SimulationError if SUMO refuses or has died."""

    def reload(self, seed: int) -> None:
        """Load SUMO again, with its random numbers from `seed`. Every game needs a `reset` afterwards."""

    def reset(self, game: int, start: InitialState, departures: list[Departure]) -> AtReset:
        """Clear a game's tile and place its players at their start. Background vehicles depart at their times.

        Traffic lights are set to their place in the cycle. Vehicles of a warm-up are on the road at once.
        """
        ...

    def halt(self, game: int, player: int) -> None:
        """Stop a player. From now on it stands at the pose given to `step`, even if SUMO drove it before."""

    def remove(self, game: int, player: int) -> None:
        """Remove a player from the traffic."""

    def place(self, x_m: FloatArray, y_m: FloatArray, heading_rad: FloatArray) -> None:
        """Place the players that the harness drives at poses [G, P] of their centres."""

    def step(self) -> Reading:
        """Step SUMO, and read its vehicles. Every step needs a `place` before it."""
        ...

    def turn_signals(self, vehicles: Sequence[tuple[int, str]]) -> list[str]:
        """The turn signals, one of `TURN_SIGNALS`, of vehicles that SUMO drives: each by its game and its name there,
        that of a player or of a `Reading`."""
        ...

    def close(self) -> None:
        """Release SUMO. A second call has no effect."""
