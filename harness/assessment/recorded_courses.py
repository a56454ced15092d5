"""Recorded games as a simulation: every road user repeats its recorded course, and reacts to nothing.

It takes SUMO's place in an arena (`sumo.simulation`), so that a driver in the ego's seat meets the same others as in
the recording, by the same motion, contact and observation. No SUMO runs.

A course is known up to the ego's failure. Afterwards each player keeps its speed along its own route, and each other
vehicle keeps its speed and direction. How a player goes on across the road is not known: see `assessment.continuation`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from harness.assessment.continuation import Continuation
from harness.environments.recorded import recorded_game
from harness.evaluation.recorded_game import RecordedGame
from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.geometry import box_distance
from harness.game.initial_state import InitialState
from harness.game.quantities import Quantities
from harness.game.road import MARGIN_M, SPACING_M, Routes
from harness.game.roles import EGO
from harness.road.demand.route_file import Departure
from harness.road.scene.open_scene import OpenScene
from harness.sumo.simulation import AtReset, Reading

_POSE = ("x_m", "y_m", "heading_rad", "speed_mps")
_LATERAL_SPEED_OVER_S = 0.5
_TOUCHING_M = 0.01  # coordinates in a trace are exact; the margin covers the rounding of rotated boxes


@dataclass(frozen=True, kw_only=True)
class RecordedCourse:
    """What all road users of one game did up to the ego's failure, and how they go on. T steps, players P, others B."""

    failed_step: int
    players: FloatArray
    """[T, P, 4] x_m, y_m, heading_rad, speed_mps of the centres."""
    players_present: BoolArray
    """[T, P]"""
    ego_acceleration_mps2: FloatArray
    """[T]"""
    ego_steering_rad: FloatArray
    """[T]"""
    station_m: FloatArray
    """[T, P] along the players' routes."""
    others: FloatArray
    """[T, B, 4] as `players`."""
    others_present: BoolArray
    """[T, B]"""
    others_size_m: FloatArray
    """[B, 2] lengths and widths."""
    signals: IntArray
    """[T, L] states of signal links."""
    opponent: int
    """The road user that the ego touched: a player P > 0, or P + b for other vehicle b; -1 if it touched none."""


def course_of(trace: pd.DataFrame, scene: OpenScene, afterwards_s: float, continuation: Continuation) -> RecordedCourse:
    """The course of a recorded game in which the ego failed, continued for a time after the failure.

    `trace` has the columns of a trace file. Raises ValueError if the ego did not fail in it.
    """
    world = scene.world
    ends = trace.loc[(trace["player"] == world.roles[EGO]) & (trace["outcome"] != ""), "step"]
    if ends.empty:
        raise ValueError("the ego's game did not end in this trace")
    failed = int(ends.min())
    game = recorded_game(trace[trace["step"] <= failed], scene)
    quantities, bodies, count = game.quantities, game.bodies, len(world.roles)
    state = quantities.state
    more = round(afterwards_s / world.step_s)
    players = np.stack([getattr(state, name) for name in _POSE], axis=-1)
    others = np.stack([getattr(bodies, name)[:, count:] for name in _POSE], axis=-1)
    return RecordedCourse(
        failed_step=failed,
        players=np.concatenate((players, _along_routes(quantities, more, continuation))),
        players_present=_held(state.present, more),
        ego_acceleration_mps2=_held(state.acceleration_mps2[:, EGO], more),
        ego_steering_rad=_held(state.steering_rad[:, EGO], more),
        station_m=_held(state.station_m, more),
        others=np.concatenate((others, _straight_on(others[-1], more, world.step_s))),
        others_present=_held(bodies.present[:, count:], more),
        others_size_m=np.stack((bodies.length_m[-1, count:], bodies.width_m[-1, count:]), axis=-1),
        signals=_held(state.signals, more),
        opponent=_touched(game),
    )


def _held(values: np.ndarray, steps: int) -> np.ndarray:
    """[T + steps, ...] the values, and the last ones again."""
    return np.concatenate((values, np.repeat(values[-1:], steps, axis=0)))


def _straight_on(poses: FloatArray, steps: int, step_s: float) -> FloatArray:
    """[steps, B, 4] the poses after each step at constant speed and heading."""
    x, y, heading, speed = np.moveaxis(poses, -1, 0)
    way = speed * step_s * np.arange(1, steps + 1)[:, None]
    columns = (x + way * np.cos(heading), y + way * np.sin(heading), heading, speed)
    return np.stack([np.broadcast_to(each, way.shape) for each in columns], axis=-1)


def _along_routes(quantities: Quantities, steps: int, continuation: Continuation) -> FloatArray:
    """[steps, P, 4] the players' poses after each step at constant speed along their routes."""
    state, world = quantities.state, quantities.world
    routes: Routes = world.road.routes
    speed, offset = state.speed_mps[-1], quantities.lateral_offset_m[-1]
    if continuation is Continuation.MOVING_OVER:
        offset = offset + _moved_over(quantities, steps)
    station = state.station_m[-1] + speed * world.step_s * np.arange(1, steps + 1)[:, None]
    row = routes.rows(station)
    heading = routes.heading_rad[row]
    beyond = station - ((row - routes.first_row) * SPACING_M - MARGIN_M)  # of the row's own station
    x = routes.x_m[row] - offset * np.sin(heading) + beyond * np.cos(heading)
    y = routes.y_m[row] + offset * np.cos(heading) + beyond * np.sin(heading)
    return np.stack((x, y, heading, np.broadcast_to(speed, station.shape)), axis=-1)


def _moved_over(quantities: Quantities, steps: int) -> FloatArray:
    """[steps, P] how far each player has moved towards the ego's line after each step."""
    state, world, offset = quantities.state, quantities.world, quantities.lateral_offset_m
    over = min(round(_LATERAL_SPEED_OVER_S / world.step_s), len(offset) - 1)
    speed = (offset[-1] - offset[-1 - over]) / (max(over, 1) * world.step_s)
    heading = world.road.routes.heading_rad[world.road.routes.rows(state.station_m[-1])]
    away_x, away_y = (each[-1, EGO] - each[-1] for each in (state.x_m, state.y_m))
    way = away_y * np.cos(heading) - away_x * np.sin(heading)
    moved = speed * world.step_s * np.arange(1, steps + 1)[:, None]
    return np.clip(moved, np.minimum(way, 0.0), np.maximum(way, 0.0))


def _touched(game: RecordedGame) -> int:
    """The body nearest to the ego in the last step, if it touches it; -1 if none does."""
    last = len(game.drove) - 1
    nearest = game.nearest(last, EGO)
    touches = nearest is not None and box_distance(game.box(last, EGO), game.box(last, nearest)) <= _TOUCHING_M
    return nearest if nearest is not None and touches else -1


@dataclass(frozen=True, kw_only=True)
class CourseReplay:
    """One replayed game: a course, the step in which it begins, and what is left out of it."""

    course: RecordedCourse
    first_step: int = 0
    only_opponent: bool = False
    """Whether the road users that the ego did not touch are left out."""
    without_followers: bool = False
    """Whether other vehicles behind the ego in the first step are left out: a driver follows a car that brakes."""


class RecordedCourses:
    """The replayed games as a simulation. A game is one of `replays`, in their order."""

    def __init__(self, replays: Sequence[CourseReplay], taken_over: Sequence[bool]) -> None:
        self._replays, self._taken_over = replays, np.array(taken_over)
        courses = list({id(each.course): each.course for each in replays}.values())
        most = max(each.others.shape[1] for each in courses)
        # the steps of all courses, one below the other
        self._players = np.concatenate([each.players for each in courses])
        self._signals = np.concatenate([each.signals for each in courses])
        self._others = np.concatenate([_widened(each.others, most) for each in courses])
        self._others_present = np.concatenate([_widened(each.others_present, most) for each in courses])
        ends = np.cumsum([len(each.players) for each in courses])
        row_of = {
            id(each): (end - len(each.players), end - 1) for each, end in zip(courses, ends.tolist(), strict=True)
        }
        self._first_row, self._last_row = np.array([row_of[id(each.course)] for each in replays]).T
        self._row = self._first_row + [each.first_step for each in replays]
        self._shown = np.array([_widened(_shown(each)[None], most)[0] for each in replays])
        self._sizes_m = np.array([_widened(each.course.others_size_m[None], most)[0] for each in replays])

    def reload(self, seed: int) -> None:
        """Do nothing: a recording has no random numbers."""

    def reset(self, game: int, start: InitialState, departures: list[Departure]) -> AtReset:
        """Begin a game at its first step."""
        self._row[game] = self._first_row[game] + self._replays[game].first_step
        states = self._signals[self._row[game]]
        return AtReset(states, np.zeros(len(states)), "", self._background(slice(game, game + 1)))

    def halt(self, game: int, player: int) -> None:
        """Do nothing: the arena keeps a player that has ended in its place."""

    def remove(self, game: int, player: int) -> None:
        """Do nothing: the arena leaves a player that has ended out."""

    def place(self, x_m: FloatArray, y_m: FloatArray, heading_rad: FloatArray) -> None:
        """Do nothing: nobody reacts to the players."""

    def step(self) -> Reading:
        """Advance all games by one step; at the end of a course its last step is repeated."""
        self._row = np.minimum(self._row + 1, self._last_row)
        reading = self._background(slice(None))
        reading.players = self._players[self._row]
        reading.players[:, self._taken_over] = np.nan
        reading.signals = self._signals[self._row]
        return reading

    def turn_signals(self, vehicles: Sequence[tuple[int, str]]) -> list[str]:
        """Off: a recording has none."""
        return ["off"] * len(vehicles)

    def close(self) -> None:
        """Do nothing."""

    def _background(self, games: slice) -> Reading:
        """The other vehicles of some games now, [N, M]."""
        rows = self._row[games]
        x_m, y_m, heading_rad, speed_mps = np.moveaxis(self._others[rows], -1, 0)
        length_m, width_m = np.moveaxis(self._sizes_m[games], -1, 0)
        shown = self._others_present[rows] & self._shown[games]
        names = np.full(shown.shape, "", dtype=object)
        return Reading(names, names, x_m, y_m, heading_rad, speed_mps, length_m, width_m, shown)


def _widened(values: np.ndarray, most: int) -> np.ndarray:
    """[T, most, ...] values [T, B, ...] of others, with zeros for those that a course has not."""
    return np.pad(values, ((0, 0), (0, most - values.shape[1]), *[(0, 0)] * (values.ndim - 2)))


def _shown(replay: CourseReplay) -> BoolArray:
    """[B] which other vehicles take part in a replay."""
    course, first = replay.course, replay.first_step
    players, others = course.players.shape[1], course.others.shape[1]
    shown = np.ones(others, dtype=bool)
    if replay.only_opponent:
        shown &= np.arange(others) + players == course.opponent
    if replay.without_followers:
        x, y, heading, _ = course.players[first, EGO]
        away = course.others[first]
        ahead_m = (away[:, 0] - x) * np.cos(heading) + (away[:, 1] - y) * np.sin(heading)
        shown &= (ahead_m > 0.0) | (np.arange(others) + players == course.opponent)
    return shown


def start_of(replay: CourseReplay, drawn: InitialState) -> InitialState:
    """The state in which a replay begins. What a recording does not hold, such as the friction, is that of `drawn`.
    Only the ego and the opponent take part where the others are left out. A player that reaches its goal in this step
    is left out, too."""
    course, step = replay.course, replay.first_step
    x_m, y_m, heading_rad, speed_mps = course.players[step].T.copy()
    present = course.players_present[step] & course.players_present[step + 1]
    if replay.only_opponent:
        present &= np.isin(np.arange(len(present)), (EGO, course.opponent))
    return replace(
        drawn,
        x_m=x_m,
        y_m=y_m,
        heading_rad=heading_rad,
        speed_mps=speed_mps,
        station_m=course.station_m[step].copy(),
        present=present,
    )
