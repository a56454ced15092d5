"""The rules for manoeuvres at junctions and among oncoming lanes. The numbers of the rules are in `thresholds`."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping

import numpy as np

from harness.evaluation.encounters import Encounter
from harness.evaluation.rule_book import thresholds as least
from harness.evaluation.rule_book.course import SLACK, Course, Span, runs
from harness.game.arrays import BoolArray
from harness.game.junctions import Control, Signal


def fails_to_yield(course: Course, player: int) -> Iterator[Span]:
    """The player enters the way of a road user that has priority and is near."""
    yield from _entries(course, player, least.FAILS_TO_YIELD_S, "does not yield to traffic", None)


def turns_across(course: Course, player: int) -> Iterator[Span]:
    """The player turns across the way of oncoming traffic with priority in a short gap."""
    across = course.quantities.world.right_of_way.conflicts.across
    yield from _entries(course, player, least.TURNS_ACROSS_S, "turns across oncoming traffic", across)


def _entries(course: Course, player: int, within_s: float, what: str, conflicts: BoolArray | None) -> Iterator[Span]:
    """The passages of zones that the player enters with at most this gap to a road user with priority, once per road
    user; only those of the marked conflicts [C]."""
    seen: dict[int, Encounter] = {}
    for each in course.encounters(player):
        marked = conflicts is None or conflicts[each.conflict]
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
