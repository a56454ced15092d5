"""The state of G games at one time: players, how their games end, and all bodies with an extent."""

from __future__ import annotations

from dataclasses import dataclass, fields
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.geometry import Box
from harness.game.jit import compiled
from harness.game.outcome import Outcome

_ALL_AROUND = -2.0  # below every cosine, whatever its rounding
NEAREST = 16
"""Background vehicles in the bodies of a game."""
NOTICED_M = 120.0
"""A background vehicle farther than this from every player does not affect the game."""

_RUNNING = int(Outcome.RUNNING)  # comparing arrays with an enumeration member is slow in NumPy


class PlayersMotion(NamedTuple):
    """The columns of `State` that motion changes, [G, P]."""

    x_m: FloatArray
    y_m: FloatArray
    heading_rad: FloatArray
    speed_mps: FloatArray
    acceleration_mps2: FloatArray
    steering_rad: FloatArray
    station_m: FloatArray


motion_of = attrgetter(*PlayersMotion._fields)
"""The columns of `PlayersMotion`, of a state."""


@dataclass
class State:
    """The players of G games. Arrays are [G, P] unless noted.

    Poses are those of the body's centre in network coordinates. Headings are in radians (0 east, counter-clockwise).
    """

    x_m: FloatArray
    y_m: FloatArray
    heading_rad: FloatArray
    speed_mps: FloatArray
    acceleration_mps2: FloatArray
    steering_rad: FloatArray
    station_m: FloatArray  # distance along the player's route
    outcome: IntArray
    present: BoolArray  # takes part in the game and has not left the scene
    lapsed: BoolArray  # has a lapse of attention in this step
    shoulder_glance: BoolArray  # sees what is in the blind spot, and beside the field of view
    sight_m: FloatArray  # greatest distance at which road users are seen
    sight_cosine: FloatArray  # of half the field of view, within which road users are seen directly; -2: all around
    distance_error: FloatArray  # error of estimated distances, as a share: + is farther than true
    closing_error_per_s: FloatArray  # error of closing speeds, per distance: + is moving away
    step: IntArray  # [G]
    friction: FloatArray  # [G] coefficient of friction of the road
    visibility_m: FloatArray  # [G] distance up to which bodies are seen
    limit_share: FloatArray  # [G] factor on the speed limits
    signals: IntArray  # [G, L] int8, states of signal links (`junctions.Signal`)
    signal_s: FloatArray  # [G, L] seconds since they changed

    @classmethod
    def empty(cls, games: int, players: int, signals: int = 0) -> State:
        """A state of zeros without human factors, in which no player is present."""
        shape = (games, players)
        columns: dict[str, Any] = {each.name: np.zeros(shape) for each in fields(cls)}
        columns |= {name: np.zeros(shape, dtype=bool) for name in ("present", "lapsed")}
        columns |= {
            "outcome": np.zeros(shape, dtype=np.int8),
            "shoulder_glance": np.ones(shape, dtype=bool),
            "sight_m": np.full(shape, np.inf),
            "sight_cosine": np.full(shape, _ALL_AROUND),
            "step": np.zeros(games, dtype=np.int64),
            "friction": np.ones(games),
            "visibility_m": np.full(games, np.inf),
            "limit_share": np.ones(games),
            "signals": np.zeros((games, signals), dtype=np.int8),
            "signal_s": np.zeros((games, signals)),
        }
        return cls(**columns)

    @property
    def running(self) -> BoolArray:
        """[G, P] players that are present and whose game has not ended."""
        return self.present & (self.outcome == _RUNNING)

    def copy(self) -> State:
        """A copy with its own arrays."""
        return State(**{name: array.copy() for name, array in vars(self).items()})

    def of(self, games: IntArray) -> State:
        """A copy of the games with indices [N]."""
        return State(**{name: array.take(games, axis=0) for name, array in vars(self).items()})


def sight_cosine(field_of_view_rad: float) -> float:
    """The cosine of half a field of view, -2 for one all around: `State.sight_cosine`."""
    return _ALL_AROUND if field_of_view_rad >= 2.0 * np.pi else float(np.cos(0.5 * field_of_view_rad))


class Bodies(NamedTuple):
    """All bodies of G games: the players first, then the nearest background vehicles. Arrays are [G, B]."""

    x_m: FloatArray
    y_m: FloatArray
    heading_rad: FloatArray
    speed_mps: FloatArray
    length_m: FloatArray
    width_m: FloatArray
    present: BoolArray

    @property
    def boxes(self) -> Box:
        """Their boxes, [G, B]."""
        return Box(self.x_m, self.y_m, self.heading_rad, self.length_m, self.width_m)

    def with_nearest(self, background: Bodies) -> Bodies:
        """These bodies (the players), followed by the `NEAREST` background vehicles, sorted by distance to the nearest
        player. A vehicle farther than `NOTICED_M` from every player is not present."""
        nearest, present = nearest_to_players(background, self)
        games = np.arange(len(nearest))[:, None]
        added = (*(each[games, nearest] for each in background[:-1]), present)
        return Bodies._make(np.concatenate(pair, axis=1) for pair in zip(self, added, strict=True))


def nearest_to_players(others: Bodies, players: Bodies) -> tuple[IntArray, BoolArray]:
    """[G, N] the `NEAREST` of other bodies, sorted by the distance to the nearest player, and which of them a game
    considers."""
    of_others, of_players = ((each.x_m, each.y_m, each.present) for each in (others, players))
    away_m = _distance_to_nearest_m(of_others, of_players)
    nearest = away_m.argsort(axis=1, kind="stable")[:, :NEAREST]
    return nearest, np.take_along_axis(away_m, nearest, 1) <= NOTICED_M


@compiled
def _distance_to_nearest_m(others: tuple[Any, ...], players: tuple[Any, ...]) -> FloatArray:
    """[G, B] the distances of bodies to the nearest player; inf for one that is not present."""
    (x_m, y_m, present), (players_x_m, players_y_m, plays) = others, players
    away_m = np.full(present.shape, np.inf)
    for g, b in np.ndindex(present.shape):
        if present[g, b]:
            for p in range(plays.shape[1]):
                if plays[g, p]:
                    dx, dy = x_m[g, b] - players_x_m[g, p], y_m[g, b] - players_y_m[g, p]
                    away_m[g, b] = min(away_m[g, b], np.hypot(dx, dy))
    return away_m


@compiled
def terminations(
    outcome: IntArray,
    drove: BoolArray,
    ends: tuple[BoolArray, BoolArray],
    distances_m: tuple[FloatArray, FloatArray, FloatArray],
) -> None:
    """Set the outcomes [G, P] of the players that drove [G, P], in place: contact before goal, goal before timeout.

    `ends` are the players that the harness drives [P], for which alone contact with a rail counts, and the games whose
    time is up [G]; `distances_m` are those to the goal, to vehicles and to rails [G, P].
    """
    (taken_over, time_is_up), (goal_m, vehicle_clearance_m, rail_clearance_m) = ends, distances_m
    for g, p in np.ndindex(outcome.shape):
        if drove[g, p]:
            if vehicle_clearance_m[g, p] <= 0.0:
                outcome[g, p] = Outcome.COLLISION
            elif rail_clearance_m[g, p] <= 0.0 and taken_over[p]:
                outcome[g, p] = Outcome.RAIL
            elif goal_m[g, p] <= 0.0:
                outcome[g, p] = Outcome.GOAL
            elif time_is_up[g]:
                outcome[g, p] = Outcome.TIMEOUT
