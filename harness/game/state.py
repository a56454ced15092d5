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
        columns, present = _with_nearest(tuple(self), tuple(background))
        return Bodies._make((*columns, present))


@compiled
def _with_nearest(players: tuple[Any, ...], vehicles: tuple[Any, ...]) -> tuple[FloatArray, BoolArray]:
    """[C, G, B] the columns of players and added vehicles but the last, and [G, B] which are present."""
    among, background = Bodies(*players), Bodies(*vehicles)
    of_players, of_vehicles = players[:-1], vehicles[:-1]
    games, player_count = among.present.shape
    added = min(NEAREST, background.present.shape[1])
    columns = np.empty((len(players) - 1, games, player_count + added))
    present = np.empty((games, player_count + added), dtype=np.bool_)
    nearest, nearest_m = np.empty(NEAREST + 1, dtype=np.int64), np.empty(NEAREST + 1)
    for g in range(games):
        count = 0
        for vehicle in range(background.present.shape[1]):
            distance_m = np.inf
            if background.present[g, vehicle]:
                for p in range(player_count):
                    if among.present[g, p]:
                        dx = background.x_m[g, vehicle] - among.x_m[g, p]
                        dy = background.y_m[g, vehicle] - among.y_m[g, p]
                        distance_m = min(distance_m, np.hypot(dx, dy))
            place = count  # after vehicles at the same distance
            while place > 0 and distance_m < nearest_m[place - 1]:
                nearest[place], nearest_m[place] = nearest[place - 1], nearest_m[place - 1]
                place -= 1
            nearest[place], nearest_m[place] = vehicle, distance_m
            count = min(count + 1, NEAREST)
        present[g, :player_count] = among.present[g]
        for k in range(added):
            present[g, player_count + k] = nearest_m[k] <= NOTICED_M
        for column in range(len(of_players)):
            columns[column, g, :player_count] = of_players[column][g]
            for k in range(added):
                columns[column, g, player_count + k] = of_vehicles[column][g, nearest[k]]
    return columns, present


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
