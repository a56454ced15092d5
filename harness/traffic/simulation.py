"""A SUMO simulation that plays G games, as the arena knows it: a few verbs, wherever it runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from harness.game.arrays import BoolArray, FloatArray
from harness.game.initial_state import InitialState
from harness.traffic.route_file import Departure


@dataclass
class Reading:
    """What SUMO's own vehicles did. Others are [G, M], padded where not present; players that SUMO drives are [G, P],
    None without any.

    Of the others there are at least those within `nearby.NOTICED_M` of a player, and all where games are recorded.
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
    players: FloatArray | None = None  # [G, P, 4] x_m, y_m, heading_rad, speed_mps; NaN where the harness drives


class Simulation(Protocol):
    """What the arena asks of SUMO. Every verb but `close` raises SimulationError if SUMO refuses or has died."""

    def reload(self, seed: int) -> None:
        """Start SUMO anew, with its random numbers from `seed`: every game has to be started again."""

    def reset(self, game: int, start: InitialState, departures: list[Departure]) -> None:
        """Clear a game's tile and put its players at their start; others depart as time goes by."""

    def halt(self, game: int, player: int) -> None:
        """Whoever drove a player, from now on it stands where `step` says."""

    def remove(self, game: int, player: int) -> None:
        """Take a player out of the traffic."""

    def step(self, x_m: FloatArray, y_m: FloatArray, heading_rad: FloatArray) -> Reading:
        """Place the players that are taken over at poses [G, P] of their centres, let SUMO step, read the rest."""
        ...

    def close(self) -> None:
        """Give SUMO back. Closing twice is closing once."""
