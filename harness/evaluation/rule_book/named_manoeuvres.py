"""The manoeuvres of the players in one recorded game, as rows of `manoeuvres.csv`."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

from harness.evaluation.rule_book import driving_rules as rules
from harness.evaluation.rule_book.course import Course, Span
from harness.evaluation.rule_book.driving_rules import RULES_OF_THE_ROAD
from harness.evaluation.rule_book.lane_entries import ENTRIES, entries

_RULES: Mapping[str, Callable[[Course, int], Iterator[Span]]] = {
    "hard_brake": rules.hard_brakes,
    "swerve": rules.swerves,
    "drift": rules.drifts,
    "tailgate": rules.tailgates,
    "forced_stop": rules.forced_stops,
    **{name: rule for name, (_, rule) in RULES_OF_THE_ROAD.items()},
}
"""About a player among all road users; entries into a lane and overtaking are about a player and another one."""

NAMES = (*ENTRIES, "overtake", *_RULES)


@dataclass(frozen=True, kw_only=True)
class Manoeuvre:
    """A manoeuvre of a player, from `time_s` until `until_s`; gap and time to collision are NaN where there is none."""

    player: str
    manoeuvre: str
    time_s: float
    until_s: float
    gap_m: float
    ttc_s: float
    text: str


def find_manoeuvres(course: Course) -> list[Manoeuvre]:
    """The manoeuvres of the players in one game, by the time they begin. In a game with an ego they end with the ego's
    game."""
    digits = 6  # of a second: no rounding error in a multiple of the step
    found = [
        Manoeuvre(
            player=role,
            manoeuvre=name,
            time_s=round(span.first * course.step_s, digits),
            until_s=round(span.last * course.step_s, digits),
            gap_m=span.gap_m if math.isfinite(span.gap_m) else math.nan,
            ttc_s=span.ttc_s if math.isfinite(span.ttc_s) else math.nan,
            text=span.text,
        )
        for player, role in enumerate(course.game.world.roles)
        if course.drove[:, player].any()
        for name, span in _spans(course, player)
    ]
    return sorted(found, key=lambda each: (each.time_s, each.player, each.manoeuvre))


def _spans(course: Course, player: int) -> Iterator[tuple[str, Span]]:
    """The manoeuvres of a player, each with its name."""
    roles = course.game.world.roles
    for other in range(len(roles)):
        if other != player and course.drove[:, other].any():
            yield from entries(course, player, other)
            for span in rules.overtakes(course, player, other):
                text = span.text if len(roles) == 2 else f"{span.text}, before {roles[other]}"
                yield "overtake", replace(span, text=text)
    for name, rule in _RULES.items():
        yield from ((name, span) for span in rule(course, player))
