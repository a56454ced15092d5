"""A body that enters the lane of a player: when it crosses the mark of the lane, and what that is called.

This is the one rule for it: manoeuvres are its entries near the player, and the cause of a failure may be one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from harness.evaluation.recorded_game import nearest_lane_m
from harness.evaluation.rule_book import thresholds as at
from harness.evaluation.rule_book.course import SLACK, Course, Span, end_of_run
from harness.game.arrays import BoolArray, FloatArray
from harness.game.roles import role_in_words

WALKS, RIDES, DRIVES = "walks", "rides", "drives"
_MOVES = {"pedestrian": WALKS, "wheelchair": WALKS, "bicycle": RIDES, "scooter": RIDES}  # by class
_ENTERS = {
    "cut_in": "cuts in from the {side}",
    "drift_in": "drifts into {whose} lane from the {side}, inattentive",
    "cross": "crosses {whose} way from the {side}",
    "oncoming": "comes towards {who} into its lane",
    "walk_in": "walks into {whose} lane from the {side}",
    "ride_in": "rides into {whose} lane from the {side}",
}
ENTRIES = tuple(_ENTERS)
"""The names of entries."""


@dataclass(frozen=True, kw_only=True, eq=False)
class InLane:
    """A body relative to the lane of a player, in every step [T]."""

    inside: BoolArray
    """Whether a part of the body is between the marks of the player's lane."""
    left_m: FloatArray
    """Its centre, to the left of the lane's centre."""
    ahead_m: FloatArray
    """Its centre, ahead of the player's centre along the player's route."""
    lane_m: FloatArray
    """The lane's centre, to the left of the player's route where the body is."""

    def changes_lane(self, step: int) -> bool:
        """Whether the player's lane is another one than in the step before."""
        return bool(abs(self.lane_m[step] - self.lane_m[step - 1]) > at.LANE_CHANGE_M)

    def side(self, step: int) -> str:
        """The side of the lane from which the body comes."""
        return "left" if self.left_m[step - 1] > 0.0 else "right"


@lru_cache(maxsize=16)
def in_lane(course: Course, body: int, of: int) -> InLane:
    """A body relative to the lane in which the centre of player `of` is."""
    q = course.quantities
    path, routes = q.on_path, q.world.road.routes
    ahead = path.ahead_m[:, of, body]
    stations = q.state.station_m.copy()
    stations[:, of] += ahead
    row = routes.rows(stations)[:, of]
    centre, left_mark, right_mark = _lane(routes.lane_offset_m[row], q.lateral_offset_m[:, of])
    left_mark = np.minimum(np.minimum(left_mark, routes.own_left_m[row]), centre + at.HALF_LANE_M)
    right_mark = np.maximum(np.maximum(right_mark, routes.own_right_m[row]), centre - at.HALF_LANE_M)
    beside = path.left_m[:, of, body] + q.lateral_offset_m[:, of]
    half = path.half_width_m[:, of, body]
    inside = q.bodies.present[:, body] & (beside - half < left_mark) & (beside + half > right_mark)
    return InLane(inside=inside, left_m=beside - centre, ahead_m=ahead, lane_m=centre)


def name_of(course: Course, body: int, of: int, step: int) -> str:
    """The name of an entry in a step, by how the body moves and by its angle to the player."""
    moves = moves_of(course, body)
    if moves != DRIVES:
        return "walk_in" if moves == WALKS else "ride_in"
    angle = course.angle_rad(step, body, of)
    if angle > at.CROSSES_RAD:
        return "oncoming" if angle > at.ONCOMING_RAD else "cross"
    state = course.quantities.state
    return "drift_in" if body < state.lapsed.shape[1] and state.lapsed[step, body] else "cut_in"


def moves_of(course: Course, body: int) -> str:
    """The verb for how a body of its class goes on."""
    return _MOVES.get(course.game.body_kinds[body].vehicle_class, DRIVES)


def words_of(name: str, side: str, who: str = "the ego") -> str:
    """An entry into the lane of somebody, in words."""
    return _ENTERS[name].format(side=side, who=who, whose=f"{who}'s")


def entries(course: Course, body: int, of: int) -> Iterator[tuple[str, Span]]:
    """The entries of a body into the lane of a player, near it and not wholly behind it, each with its name. Gap and
    time to collision are the player's when the body crosses the mark."""
    lane, q = in_lane(course, body, of), course.quantities
    there = course.drove[:, of] & (course.drove[:, body] if body < course.drove.shape[1] else q.bodies.present[:, body])
    crosses = np.flatnonzero(lane.inside[1:] & ~lane.inside[:-1] & there[1:] & there[:-1]) + 1
    gap_m, behind_m = course.gap_m(body, of), sum(course.game.body_kinds[each].length_m for each in (body, of))
    same_until = -1
    for step in crosses.tolist():
        if step <= same_until or lane.changes_lane(step) or gap_m[step] <= -behind_m:
            continue
        gap, ttc_s = max(float(gap_m[step]), 0.0), min(course.ttc_s(step, body, of), course.ttc_along_s(step, body, of))
        near = gap / max(float(q.speed_mps[step, of]), 0.1) <= at.CUT_IN_TIME_GAP_S + SLACK
        if near or ttc_s <= at.CUT_IN_TTC_S + SLACK or course.leads_to_failure(step, body, of):
            same_until = step + course.steps(at.SAME_WITHIN_S)
            name = name_of(course, body, of, step)
            role = role_in_words(q.world.roles[of])
            text = f"{words_of(name, lane.side(step), f'the {role}')}, {gap:.1f} m ahead of the {role}"
            text += f", TTC {ttc_s:.1f} s" if math.isfinite(ttc_s) else ""
            last = _settled(lane, q.on_path.left_m[:, of, body], step)
            yield name, Span(first=step, last=last, gap_m=gap, ttc_s=ttc_s, text=text)


def _settled(lane: InLane, left_m: FloatArray, step: int) -> int:
    """The first step in which a body that entered is within half a metre of the player's path; the last one in the lane
    if it never is."""
    last = end_of_run(lane.inside, step)
    found = np.flatnonzero(np.abs(left_m[step : last + 1]) < 0.5)
    return step + int(found[0]) if len(found) else last


def _lane(lanes_m: FloatArray, offset_m: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Centre of the lane nearest to an offset, and the marks half way to the next lanes; +-inf without a next lane.

    lanes_m [T, L] are the centres of lanes (NaN: none), offset_m [T].
    """
    centre = nearest_lane_m(lanes_m, offset_m)
    side = lanes_m - centre[:, None]
    left = np.where(side > 0.1, side, np.inf).min(1)
    right = np.where(side < -0.1, side, -np.inf).max(1)
    return centre, centre + 0.5 * left, centre + 0.5 * right
