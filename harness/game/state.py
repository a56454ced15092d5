"""What is true of G games at one moment."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray

EGO, NON_EGO = 0, 1
ROLES = ("ego", "non_ego")


class Outcome(IntEnum):
    """How a player's game ended; `name.lower()` is the word in every file."""

    RUNNING = 0
    GOAL = 1
    COLLISION = 2
    RAIL = 3
    TIMEOUT = 4
    ERROR = 5

    @property
    def word(self) -> str:
        return "" if self is Outcome.RUNNING else self.name.lower()


@dataclass
class State:
    """The players of G games. Every array is [G, P] unless it says otherwise.

    Poses are of the body's centre in the scene's network coordinates, heading in radians
    (0 east, counter-clockwise).
    """

    x_m: FloatArray
    y_m: FloatArray
    heading_rad: FloatArray
    speed_mps: FloatArray
    acceleration_mps2: FloatArray
    steering_rad: FloatArray
    station_m: FloatArray  # distance along the player's route
    outcome: IntArray
    present: BoolArray  # takes part and has not left the scene
    lapsed: BoolArray  # attention is elsewhere in this step
    overlooked_m: FloatArray  # others are seen from this far ahead of the player on; -inf: all around
    step: IntArray  # [G]

    @classmethod
    def empty(cls, games: int, players: int) -> State:
        shape = (games, players)
        return cls(
            x_m=np.zeros(shape),
            y_m=np.zeros(shape),
            heading_rad=np.zeros(shape),
            speed_mps=np.zeros(shape),
            acceleration_mps2=np.zeros(shape),
            steering_rad=np.zeros(shape),
            station_m=np.zeros(shape),
            outcome=np.zeros(shape, dtype=np.int8),
            present=np.zeros(shape, dtype=bool),
            lapsed=np.zeros(shape, dtype=bool),
            overlooked_m=np.full(shape, -np.inf),
            step=np.zeros(games, dtype=np.int64),
        )

    @property
    def running(self) -> BoolArray:
        """[G, P] players that still drive."""
        return self.present & (self.outcome == Outcome.RUNNING)

    def copy(self) -> State:
        return State(**{name: array.copy() for name, array in vars(self).items()})

    def of(self, games: IntArray) -> State:
        """A copy of some games [N]."""
        return State(**{name: array[games] for name, array in vars(self).items()})


@dataclass
class Bodies:
    """Everything with an extent in G games: the players first, then the nearest others. Arrays are [G, B]."""

    x_m: FloatArray
    y_m: FloatArray
    heading_rad: FloatArray
    speed_mps: FloatArray
    length_m: FloatArray
    width_m: FloatArray
    present: BoolArray

    def of(self, games: IntArray) -> Bodies:
        """A copy of some games [N]."""
        return Bodies(**{name: array[games] for name, array in vars(self).items()})
