"""The rules on how a player drives: each finds the stretches of a game in which it performs one manoeuvre.

The numbers of the rules are in `thresholds`. Players are indices of the players' axis.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from harness.evaluation.rule_book import thresholds as least
from harness.evaluation.rule_book.course import SLACK, Course, Span, runs
from harness.game.arrays import BoolArray


def hard_brakes(course: Course, player: int) -> Iterator[Span]:
    """The player brakes harder than an ordinary stop needs."""
    braking = -course.quantities.state.acceleration_mps2[:, player]
    mask = course.drove[:, player] & (braking >= least.HARD_BRAKE_MPS2 - SLACK)
    for first, last in course.stretches(mask, least.HARD_BRAKE_LEAST_S):
        yield course.span(player, first, last, f"brakes at up to {braking[first : last + 1].max():.1f} m/s²")


def swerves(course: Course, player: int) -> Iterator[Span]:
    """The player steers sharply out of the direction of the road."""
    for sign, side in ((1.0, "left"), (-1.0, "right")):
        sideways, turned = course.swerving_mps2(player, sign), sign * course.turned_rad[:, player]
        back = course.swerving_mps2(player, -sign) >= least.SWERVE_MPS2
        mask = course.drove[:, player] & (sideways >= least.SWERVE_MPS2 - SLACK)
        for first, last in course.stretches(mask, least.SWERVE_LEAST_S, back):
            steps = first + np.flatnonzero(mask[first : last + 1])
            if turned[steps].max() >= least.SWERVE_TURN_RAD - SLACK:
                text = f"swerves to the {side}, at up to {sideways[steps].max():.1f} m/s² sideways"
                yield course.span(player, first, last, text)


def drifts(course: Course, player: int) -> Iterator[Span]:
    """The player moves sideways without steering: in a lapse of attention, or out of its lane with a still wheel."""
    state, drove = course.quantities.state, course.drove[:, player]
    lapsed = drove & state.lapsed[:, player]
    for first, last in runs(lapsed):
        yield from _drift(course, player, first, last, "in a lapse of attention")
    steering = state.steering_rad[:, player]
    if not course.game.steers[player]:
        return
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
        yield course.span(player, first, last, f"drifts {abs(most):.1f} m to the {side} {how}")


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
            yield course.span(
                player, first, until, f"overtakes on the lane that ends, {lane_end[step]:.0f} m before its end"
            )
            search_from = step + 1


def tailgates(course: Course, player: int) -> Iterator[Span]:
    """The player follows its leader too closely for some time."""
    quantities = course.quantities
    time_gap = quantities.time_gap_s[:, player]
    mask = course.drove[:, player] & (time_gap < least.TAILGATE_TIME_GAP_S - SLACK)
    mask &= quantities.speed_mps[:, player] >= least.TAILGATE_SPEED_MPS
    for first, last in course.stretches(mask, least.TAILGATE_LEAST_S):
        closest = time_gap[first : last + 1].min()
        yield course.span(player, first, last, f"follows as close as {closest:.1f} s")


def forced_stops(course: Course, player: int) -> Iterator[Span]:
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
        yield course.span(player, first, last, f"is brought to {speed[first : last + 1].min():.1f} m/s, {where}")


def _while(mask: BoolArray, step: int) -> int:
    """The last step of the stretch of `mask` [T] that `step` is in."""
    ends = np.flatnonzero(~mask[step:])
    return step + int(ends[0]) - 1 if len(ends) else len(mask) - 1
