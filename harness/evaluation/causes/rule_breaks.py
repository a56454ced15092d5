"""Rules of the road that a player broke before the end of a game, from the rules that name manoeuvres."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import pandas as pd

from harness.evaluation.causes.thresholds import SINCE_S
from harness.evaluation.manoeuvres import junction_rules as rules
from harness.evaluation.manoeuvres.course import Course
from harness.game.roles import EGO
from harness.game.world import World

TURNS_ACROSS, WRONG_WAY = "turns across oncoming traffic", "drives among oncoming lanes"
_RULES = {
    "runs a red light": rules.runs_red,
    "rolls through a stop sign": rules.rolls_through,
    TURNS_ACROSS: rules.turns_across,
    "does not yield": rules.fails_to_yield,
    WRONG_WAY: rules.wrong_ways,
}
"""The gravest first."""


def rule_broken(
    trace: pd.DataFrame,
    world: World,
    sizes_m: Mapping[str, tuple[float, float]],
    players: Iterable[int],
    last: int,
) -> dict[int, str]:
    """What each of these players broke in the last `SINCE_S` before step `last`; players that broke nothing are left
    out. `sizes_m` are length and width of vehicle types."""
    course = Course.of(trace, world, sizes_m)
    first = last - course.steps(SINCE_S)
    found: dict[int, str] = {}
    for player in players:
        if not course.drove[:, player].any():
            continue
        for words, rule in _RULES.items():
            spans = rule(course, player, EGO if player != EGO else 1)
            if any(span.first <= last and span.last >= first for span in spans):
                found[player] = words
                break
    return found
