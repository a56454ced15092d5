"""The interface of a SUMO simulation that plays G games, in this process or in another one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.initial_state import InitialState
from harness.road.demand.route_file import Departure


@dataclass
class Reading:
    """The background vehicles [G, M] after a step, padded where not present, and the players that SUMO drives.

    A reading has at least the background vehicles within `neighbours.NOTICED_M` of a player, and all of them if games
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

    @property
    def bodies(self) -> list[NDArray[Any]]:
        """The columns [G, M] of the background vehicles, in the order of the fields."""
        return [getattr(self, name) for name in _OF_VEHICLES]


class AtReset(NamedTuple):
    """A game after a reset: states of signal links [L], seconds since they changed [L], the text of its lights, and the
    background vehicles on the road [1, M] (None: there are none)."""

    states: IntArray
    since_s: FloatArray
    text: str
    background: Reading | None = None


NO_SIGNALS = AtReset(np.zeros(0, dtype=np.int8), np.zeros(0), "")
_OF_VEHICLES = ("names", "types", "x_m", "y_m", "heading_rad", "speed_mps", "length_m", "width_m", "present")


def with_game(reading: Reading | None, games: int, game: int, background: Reading) -> Reading:
    """A reading of `games` games in which one game has the background vehicles [1, M] of `background`; None: empty."""
    most = background.present.shape[1]
    columns = {}
    for name in _OF_VEHICLES:
        row = getattr(background, name)
        column = row[:, :0].repeat(games, axis=0) if reading is None else getattr(reading, name)
        nothing = None if row.dtype == object else 0
        more = np.full((games, max(most - column.shape[1], 0)), nothing, dtype=row.dtype)
        columns[name] = np.concatenate((column, more), axis=1)
        columns[name][game] = nothing
        columns[name][game, :most] = row[0]
    return Reading(**columns) if reading is None else replace(reading, **columns)


def side_by_side(first: Reading, second: Reading) -> Reading:
    """A reading [G, M + N] with the bodies of two readings [G, M] and [G, N]."""
    return Reading(*(np.concatenate(pair, axis=1) for pair in zip(first.bodies, second.bodies, strict=True)))


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

    def step(self, x_m: FloatArray, y_m: FloatArray, heading_rad: FloatArray) -> Reading:
        """Place the players that the harness drives at poses [G, P] of their centres, step SUMO, read its vehicles."""
        ...

    def close(self) -> None:
        """Release SUMO. A second call has no effect."""
