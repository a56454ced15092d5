"""The manoeuvres of the players in one recorded game, as rows of `manoeuvres.csv`, and the rules that name them: each
finds the stretches of a game in which a player performs one.

The numbers of the rules are in `thresholds`. Players are indices of the players' axis.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from operator import itemgetter
from typing import Any

import numpy as np

from harness.evaluation.encounters import Encounter
from harness.evaluation.rule_book import thresholds as least
from harness.evaluation.rule_book.course import SLACK, Course, Span, end_of_run, runs
from harness.evaluation.rule_book.lane_entries import ENTRIES, entries
from harness.game.arrays import BoolArray
from harness.game.junctions import Control, Signal


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
        yield from _drift(course, player, first, last, how="in a lapse of attention")
    steering = state.steering_rad[:, player]
    if not course.game.steers[player]:
        return
    still = np.abs(np.diff(steering, prepend=steering[:1])) <= least.HANDS_OFF_RADPS * course.step_s
    for first, last in runs(drove & still & ~lapsed):
        out = course.quantities.lane_offset_m[first : last + 1, player] >= least.OUT_OF_LANE_M - SLACK
        if last - first + 1 >= course.steps(least.HANDS_OFF_LEAST_S) and out.any():
            yield from _drift(course, player, first, last, how="out of its lane with the wheel held still")


def _drift(course: Course, player: int, first: int, last: int, *, how: str) -> Iterator[Span]:
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
        last = end_of_run(both & (ahead >= 0.0), step)
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


# --- junctions and oncoming lanes ------------------------------------------------------------------------------------


def fails_to_yield(course: Course, player: int) -> Iterator[Span]:
    """The player enters the way of a road user that has priority and is near."""
    yield from _entries(course, player, least.FAILS_TO_YIELD_S, what="does not yield to traffic", among=None)


def turns_across(course: Course, player: int) -> Iterator[Span]:
    """The player turns across the way of oncoming traffic with priority in a short gap."""
    across = course.quantities.world.right_of_way.conflicts.across
    yield from _entries(course, player, least.TURNS_ACROSS_S, what="turns across oncoming traffic", among=across)


def _entries(course: Course, player: int, within_s: float, *, what: str, among: BoolArray | None) -> Iterator[Span]:
    """The passages of zones that the player enters with at most this gap to a road user with priority, once per road
    user; only those of the conflicts marked in `among` [C]."""
    seen: dict[int, Encounter] = {}
    for each in course.encounters(player):
        marked = among is None or among[each.conflict]
        if marked and each.must_yield and each.gap_s <= within_s + SLACK and each.body not in seen:
            seen[each.body] = each
    for each in seen.values():
        first = min(math.ceil(each.own.enters_s / course.step_s - SLACK), len(course.drove) - 1)
        leaves_s = min(each.own.leaves_s, (len(course.drove) - 1) * course.step_s)
        last = max(int(leaves_s / course.step_s), first)
        where = "already there" if each.gap_s == 0.0 else f"{each.gap_s:.1f} s away"
        yield course.span(player, first, last, f"{what}, {where}")


def runs_red(course: Course, player: int) -> Iterator[Span]:
    """The player passes a stop line on red."""
    signals = course.quantities.state.signals
    for step, line in _passed_lines(course, player):
        link = int(course.quantities.world.right_of_way.stop_lines.link[line])
        if 0 <= link < signals.shape[1] and signals[step, link] == Signal.RED:
            not_red = np.flatnonzero(signals[:step, link] != Signal.RED)
            if len(not_red):
                since_s = (step - int(not_red[-1])) * course.step_s
                text = f"passes a red light, {since_s:.1f} s after its onset"
            else:
                text = "passes a red light"
            yield course.span(player, step, step, text)


def rolls_through(course: Course, player: int) -> Iterator[Span]:
    """The player passes a stop sign without stopping before it."""
    stop_lines, quantities = course.quantities.world.right_of_way.stop_lines, course.quantities
    for step, line in _passed_lines(course, player):
        if stop_lines.control[line] in (Control.STOP, Control.ALL_WAY_STOP):
            before_m = stop_lines.station_m[line] - quantities.front_m[: step + 1, player]
            near = course.drove[: step + 1, player] & (before_m <= least.STOPS_WITHIN_M)
            slowest_mps = quantities.speed_mps[: step + 1, player][near].min()
            if slowest_mps > least.STOPPED_MPS + SLACK:
                text = f"rolls through a stop sign at {slowest_mps:.1f} m/s or more"
                yield course.span(player, step, step, text)


def wrong_ways(course: Course, player: int) -> Iterator[Span]:
    """The player drives among oncoming lanes."""
    wrong = course.drove[:, player] & (course.quantities.wrong_way[:, player] > 0.0)
    for first, last in course.stretches(wrong, least.WRONG_WAY_LEAST_S):
        driven_m = course.quantities.speed_mps[first : last + 1, player].sum() * course.step_s
        yield course.span(player, first, last, f"drives {driven_m:.0f} m among oncoming lanes")


def _passed_lines(course: Course, player: int) -> Iterator[tuple[int, int]]:
    """The step in which the player's front passes each stop line of its route, and the row of the line."""
    lines, front_m = course.quantities.world.right_of_way.stop_lines, course.quantities.front_m[:, player]
    for first, last in runs(course.drove[:, player]):
        for line in np.flatnonzero(lines.player == player).tolist():
            station_m = lines.station_m[line]
            passed = (front_m[first:last] <= station_m) & (station_m < front_m[first + 1 : last + 1])
            for step in np.flatnonzero(passed).tolist():
                yield first + step + 1, line


RULES_OF_THE_ROAD: Mapping[str, tuple[str, Callable[[Course, int], Iterator[Span]]]] = {
    "runs_red": ("runs a red light", runs_red),
    "rolls_through": ("rolls through a stop sign", rolls_through),
    "turns_across": ("turns across oncoming traffic", turns_across),
    "fails_to_yield": ("does not yield", fails_to_yield),
    "wrong_way": ("drives among oncoming lanes", wrong_ways),
}
"""Words and rule of each manoeuvre that breaks a rule of the road, the gravest first."""

_RULES: Mapping[str, Callable[[Course, int], Iterator[Span]]] = {
    "hard_brake": hard_brakes,
    "swerve": swerves,
    "drift": drifts,
    "tailgate": tailgates,
    "forced_stop": forced_stops,
    **{name: rule for name, (_, rule) in RULES_OF_THE_ROAD.items()},
}
"""About a player among all road users; entries into a lane and overtaking are about a player and another one."""

NAMES = (*ENTRIES, "overtake", *_RULES)


def find_manoeuvres(course: Course) -> list[dict[str, Any]]:
    """The manoeuvres of the players in one game, as cells of `manoeuvres.csv`, by the time they begin; gap and time to
    collision are NaN where there is none. In a game with an ego they end with the ego's game."""
    found = [
        {
            "player": role,
            "manoeuvre": name,
            "time_s": round(span.first * course.step_s, 6),  # no rounding error in a multiple of the step
            "until_s": round(span.last * course.step_s, 6),
            "gap_m": span.gap_m if math.isfinite(span.gap_m) else math.nan,
            "ttc_s": span.ttc_s if math.isfinite(span.ttc_s) else math.nan,
            "text": span.text,
        }
        for player, role in enumerate(course.game.world.roles)
        if course.drove[:, player].any()
        for name, span in _spans(course, player)
    ]
    return sorted(found, key=itemgetter("time_s", "player", "manoeuvre"))


def _spans(course: Course, player: int) -> Iterator[tuple[str, Span]]:
    roles = course.game.world.roles
    for other in range(len(roles)):
        if other != player and course.drove[:, other].any():
            yield from entries(course, player, other)
            for span in overtakes(course, player, other):
                text = span.text if len(roles) == 2 else f"{span.text}, before {roles[other]}"
                yield "overtake", replace(span, text=text)
    for name, rule in _RULES.items():
        yield from ((name, span) for span in rule(course, player))
