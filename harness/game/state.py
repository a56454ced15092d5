"""What is true of G games at one moment."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.jit import compiled

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


_RUNNING = int(Outcome.RUNNING)  # NumPy would ask the enumeration each time


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
    unseen_behind_m: FloatArray  # others are seen from this far ahead of the player on; -inf: all around
    sight_m: FloatArray  # others are seen up to this far away
    distance_error: FloatArray  # share by which others seem farther away (+) or nearer (-) than they are
    closing_error_per_s: FloatArray  # what others seem to move away (+) or nearer (-), per distance
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
            unseen_behind_m=np.full(shape, -np.inf),
            sight_m=np.full(shape, np.inf),
            distance_error=np.zeros(shape),
            closing_error_per_s=np.zeros(shape),
            step=np.zeros(games, dtype=np.int64),
        )

    @property
    def running(self) -> BoolArray:
        """[G, P] players that still drive."""
        return self.present & (self.outcome == _RUNNING)

    def copy(self) -> State:
        return State(**{name: array.copy() for name, array in vars(self).items()})

    def of(self, games: IntArray) -> State:
        """A copy of some games [N]."""
        return State(**{name: array.take(games, axis=0) for name, array in vars(self).items()})


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

    def with_nearest(self, others: Bodies, most: int, within_m: float) -> Bodies:
        """These, the players, and behind them so many of the others as are nearest to one of them, the nearest first;
        who is farther from all players than `within_m` is not present."""
        players, beside = (
            (each.x_m, each.y_m, each.heading_rad, each.speed_mps, each.length_m, each.width_m)
            for each in (self, others)
        )
        columns, present = _with_nearest(players, self.present, beside, others.present, most, within_m)
        x_m, y_m, heading_rad, speed_mps, length_m, width_m = columns
        return Bodies(x_m, y_m, heading_rad, speed_mps, length_m, width_m, present)


@compiled
def _with_nearest(
    players: tuple[Any, ...],
    players_present: BoolArray,
    others: tuple[Any, ...],
    others_present: BoolArray,
    most: int,
    within_m: float,
) -> tuple[FloatArray, BoolArray]:
    games, seats = players_present.shape
    taken = min(most, others_present.shape[1])
    columns = np.empty((len(players), games, seats + taken))
    present = np.empty((games, seats + taken), dtype=np.bool_)
    nearest, nearest_m = np.empty(most + 1, dtype=np.int64), np.empty(most + 1)
    for g in range(games):
        count = 0
        for other in range(others_present.shape[1]):
            away_m = np.inf
            if others_present[g, other]:
                for p in range(seats):
                    if players_present[g, p]:
                        dx, dy = others[0][g, other] - players[0][g, p], others[1][g, other] - players[1][g, p]
                        away_m = min(away_m, np.hypot(dx, dy))
            place = count  # behind those that are as near
            while place > 0 and away_m < nearest_m[place - 1]:
                nearest[place], nearest_m[place] = nearest[place - 1], nearest_m[place - 1]
                place -= 1
            nearest[place], nearest_m[place] = other, away_m
            count = min(count + 1, most)
        present[g, :seats] = players_present[g]
        for k in range(taken):
            present[g, seats + k] = nearest_m[k] <= within_m
        for column in range(len(players)):
            columns[column, g, :seats] = players[column][g]
            for k in range(taken):
                columns[column, g, seats + k] = others[column][g, nearest[k]]
    return columns, present
