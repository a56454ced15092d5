"""The rules: each finds the stretches of a game in which a player performs one manoeuvre.

The numbers of the rules are in `thresholds`. Players are indices of the players' axis.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import numpy as np

from harness.evaluation.manoeuvres import thresholds as least
from harness.evaluation.manoeuvres.course import Course, runs
from harness.evaluation.manoeuvres.junction_rules import (
    fails_to_yield,
    rolls_through,
    runs_red,
    turns_across,
    wrong_ways,
)
from harness.evaluation.manoeuvres.spans import SLACK, Span, span_of
from harness.game.arrays import BoolArray


def cut_ins(course: Course, player: int, other: int) -> Iterator[Span]:
    """The player enters the other's path from the side, ahead of it and near, and not in a lapse (that is a drift).

    It begins when the player's body crosses the mark of the other's lane. Gap and time to collision are the other's, at
    that moment; the time is along the road, as UN R157 has it for cut-ins: the bodies do not overlap yet.
    """
    in_way = course.in_way(player, other)
    both = course.drove[:, player] & course.drove[:, other]
    ahead = course.ahead_m(player, other) > 0.0
    gap = np.maximum(course.gap_m(player, other), 0.0)
    time_gap = gap / np.maximum(course.quantities.speed_mps[:, other], 0.1)
    ttc = course.between.time_to_collision_s[:, other]
    turned_rad = course.quantities.state.heading_rad[:, player] - course.quantities.state.heading_rad[:, other]
    alike = np.cos(turned_rad) >= np.cos(least.CUT_IN_TURNED_RAD)
    near = (time_gap <= least.CUT_IN_TIME_GAP_S + SLACK) | (ttc <= least.CUT_IN_TTC_S + SLACK)
    enters = both & ahead & in_way & ~course.quantities.state.lapsed[:, player]
    enters[1:] &= ~in_way[:-1] & both[:-1]
    enters[0] = False
    speed = course.quantities.speed_mps
    closing = speed[:, other] - speed[:, player] * np.cos(turned_rad)
    same_until = -1
    for step in np.flatnonzero(enters & near & alike).tolist():
        if step > same_until and _moved_more(course, player, other, step):
            last = _while(in_way & both & ahead, step)
            begin = _since(course.over_mark(player, other) & both, step)
            time_s = float(gap[begin] / closing[begin]) if closing[begin] > 0.0 else np.inf
            yield Span(
                first=begin,
                last=_first(np.abs(course.between.on_path.left_m[:, other, player]) < 0.5, step, last),
                gap_m=float(gap[begin]),
                ttc_s=time_s,
                text=f"cuts in {gap[begin]:.1f} m ahead{_seconds(', TTC', time_s)}",
            )
            same_until = step + course.steps(least.SAME_WITHIN_S)


def _moved_more(course: Course, player: int, other: int, step: int) -> bool:
    """Whether the player has moved more towards the other's path than the other towards the player's."""
    before = max(step - course.steps(least.CUT_IN_LOOK_BACK_S), 0)
    own = course.left_m(player, other)
    others = course.quantities.lateral_offset_m[:, other]
    side = np.sign(own[before] - others[before])
    towards = -side * (own[step] - own[before])
    return bool(towards > max(side * (others[step] - others[before]), 0.0))


def hard_brakes(course: Course, player: int, other: int) -> Iterator[Span]:
    """The player brakes harder than an ordinary stop needs."""
    braking = -course.quantities.state.acceleration_mps2[:, player]
    mask = course.drove[:, player] & (braking >= least.HARD_BRAKE_MPS2 - SLACK)
    for first, last in course.stretches(mask, least.HARD_BRAKE_LEAST_S):
        yield span_of(course, player, first, last, f"brakes at up to {braking[first : last + 1].max():.1f} m/s²")


def swerves(course: Course, player: int, other: int) -> Iterator[Span]:
    """The player steers sharply out of the direction of the road."""
    for sign, side in ((1.0, "left"), (-1.0, "right")):
        sideways, turned = course.swerving_mps2(player, sign), sign * course.turned_rad[:, player]
        back = course.swerving_mps2(player, -sign) >= least.SWERVE_MPS2
        mask = course.drove[:, player] & (sideways >= least.SWERVE_MPS2 - SLACK)
        for first, last in course.stretches(mask, least.SWERVE_LEAST_S, back):
            steps = first + np.flatnonzero(mask[first : last + 1])
            if turned[steps].max() >= least.SWERVE_TURN_RAD - SLACK:
                text = f"swerves to the {side}, at up to {sideways[steps].max():.1f} m/s² sideways"
                yield span_of(course, player, first, last, text)


def drifts(course: Course, player: int, other: int) -> Iterator[Span]:
    """The player moves sideways without steering: in a lapse of attention, or out of its lane with a still wheel."""
    state, drove = course.quantities.state, course.drove[:, player]
    lapsed = drove & state.lapsed[:, player]
    for first, last in runs(lapsed):
        yield from _drift(course, player, first, last, "in a lapse of attention")
    steering = state.steering_rad[:, player]
    if not steering[drove].any():
        return  # SUMO drives it and records no steering
    still = np.abs(np.diff(steering, prepend=steering[:1])) <= least.HANDS_OFF_RADPS * course.step_s
    for first, last in runs(drove & still & ~lapsed):
        out = course.quantities.lane_offset_m[first : last + 1, player] >= least.OUT_OF_LANE_M - SLACK
        if last - first + 1 >= course.steps(least.HANDS_OFF_LEAST_S) and out.any():
            yield from _drift(course, player, first, last, "out of its lane with the wheel held still")


def _drift(course: Course, player: int, first: int, last: int, how: str) -> Iterator[Span]:
    begin = max(first - 1, 0)  # a row has the position at the end of its step
    moved = course.sideways_m[begin : last + 1, player] - course.sideways_m[begin, player]
    most = moved[np.abs(moved).argmax()]
    if abs(most) >= least.DRIFT_M - SLACK:
        side = "left" if most > 0.0 else "right"
        yield span_of(course, player, first, last, f"drifts {abs(most):.1f} m to the {side} {how}")


def overtakes(course: Course, player: int, other: int) -> Iterator[Span]:
    """On the lane that ends, the player passes the other from behind until it is completely ahead."""
    both = course.drove[:, player] & course.drove[:, other]
    ahead, gap = course.ahead_m(player, other), course.gap_m(player, other)
    lane_end = course.quantities.lane_end_m[:, player]
    apart = ~course.in_way(player, other)
    draws_level = both & np.isfinite(lane_end) & apart & (ahead >= 0.0)
    draws_level[1:] &= (ahead[:-1] < 0.0) & both[:-1]
    draws_level[0] = False
    search_from = 0
    for step in np.flatnonzero(draws_level).tolist():
        behind = np.flatnonzero(ahead[search_from:step] <= -least.OVERTAKE_FROM_M + SLACK)
        last = _while(both & (ahead >= 0.0), step)
        past = np.flatnonzero(gap[step : last + 1] >= 0.0)
        if len(behind) and len(past):
            length = ahead[step] - gap[step]
            reached = np.flatnonzero(ahead[:step] <= -length)
            first = int(reached[-1]) + 1 if len(reached) else 0
            until = step + int(past[0])
            yield span_of(
                course, player, first, until, f"overtakes on the lane that ends, {lane_end[step]:.0f} m before its end"
            )
            search_from = step + 1


def tailgates(course: Course, player: int, other: int) -> Iterator[Span]:
    """The player follows its leader too closely for some time."""
    quantities = course.quantities
    time_gap = quantities.time_gap_s[:, player]
    mask = course.drove[:, player] & (time_gap < least.TAILGATE_TIME_GAP_S - SLACK)
    mask &= quantities.speed_mps[:, player] >= least.TAILGATE_SPEED_MPS
    for first, last in course.stretches(mask, least.TAILGATE_LEAST_S):
        closest = time_gap[first : last + 1].min()
        yield span_of(course, player, first, last, f"follows as close as {closest:.1f} s")


def forced_stops(course: Course, player: int, other: int) -> Iterator[Span]:
    """The player is nearly stopped by its leader or by the end of its lane."""
    quantities, drove = course.quantities, course.drove[:, player]
    speed, gap = quantities.speed_mps[:, player], quantities.leader_gap_m[:, player]
    lane_end = quantities.lane_end_m[:, player]
    has_driven = np.maximum.accumulate(np.where(drove, speed, 0.0)) >= least.FORCED_FROM_MPS
    behind = gap <= least.FORCED_GAP_M + SLACK
    at_end = lane_end <= least.FORCED_LANE_END_M + SLACK
    mask = drove & has_driven & (speed <= least.STANDSTILL_MPS + SLACK) & (behind | at_end)
    for first, last in course.stretches(mask, least.FORCED_LEAST_S):
        where = (
            f"{gap[first]:.1f} m behind another" if behind[first] else f"{lane_end[first]:.1f} m before its lane ends"
        )
        yield span_of(course, player, first, last, f"is brought to {speed[first : last + 1].min():.1f} m/s, {where}")


RULES: Mapping[str, Callable[[Course, int, int], Iterator[Span]]] = {
    "cut_in": cut_ins,
    "hard_brake": hard_brakes,
    "swerve": swerves,
    "drift": drifts,
    "overtake": overtakes,
    "tailgate": tailgates,
    "forced_stop": forced_stops,
    "fails_to_yield": fails_to_yield,
    "turns_across": turns_across,
    "runs_red": runs_red,
    "rolls_through": rolls_through,
    "wrong_way": wrong_ways,
}

PAIRWISE = frozenset({"cut_in", "overtake"})
"""The rules about the player and one other; the others are about the player among all road users."""


def _while(mask: BoolArray, step: int) -> int:
    """The last step of the stretch of `mask` [T] that `step` is in."""
    ends = np.flatnonzero(~mask[step:])
    return step + int(ends[0]) - 1 if len(ends) else len(mask) - 1


def _since(mask: BoolArray, step: int) -> int:
    """The first step of the stretch of `mask` [T] that `step` is in; `step` where it is in none."""
    outside = np.flatnonzero(~mask[: step + 1])
    return min(int(outside[-1]) + 1, step) if len(outside) else 0


def _first(mask: BoolArray, first: int, last: int) -> int:
    """The first step from `first` to `last` at which `mask` [T] holds; else the last."""
    found = np.flatnonzero(mask[first : last + 1])
    return first + int(found[0]) if len(found) else last


def _seconds(name: str, value: float) -> str:
    return f"{name} {value:.1f} s" if np.isfinite(value) else ""
