"""The manoeuvres in one game's trace, and their conversion to and from rows of `manoeuvres.csv`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import pandas as pd

from harness.evaluation.manoeuvres.course import Course
from harness.evaluation.manoeuvres.rules import PAIRWISE, RULES
from harness.evaluation.manoeuvres.spans import Span
from harness.game.world import World

NAMES = tuple(RULES)


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


def find_manoeuvres(
    trace: pd.DataFrame, world: World, sizes_m: Mapping[str, tuple[float, float]] | None = None
) -> list[Manoeuvre]:
    """The manoeuvres of the players in one game, by the time they begin.

    `trace` are the game's rows (columns as in `traces/`) on the scene of `world`; `sizes_m` are length and width of
    the vehicle types in it, with SUMO's default for the others. In a game with an ego, manoeuvres end with the ego's
    game.
    """
    course = Course.of(trace, world, sizes_m or {})
    found = []
    for player, role in enumerate(world.roles):
        if course.drove[:, player].any():
            found += [_named(course, role, name, span) for name, span in _spans(course, player)]
    return sorted(found, key=lambda each: (each.time_s, each.player, each.manoeuvre))


def _spans(course: Course, player: int) -> Iterator[tuple[str, Span]]:
    """The manoeuvres of a player, each with its name. A rule about a pair is applied to every other player."""
    roles = course.quantities.world.roles
    others = [other for other in range(len(roles)) if other != player]
    for name, rule in RULES.items():
        if len(others) == 1 or name not in PAIRWISE:
            yield from ((name, span) for span in rule(course, player, others[0]))
            continue
        for other in others:
            for span in rule(course.of_pair(player, other), player, other):
                yield name, replace(span, text=f"{span.text}, before {roles[other]}")


def _named(course: Course, role: str, name: str, span: Span) -> Manoeuvre:
    digits = 6  # of a second: no rounding error in a multiple of the step
    return Manoeuvre(
        player=role,
        manoeuvre=name,
        time_s=round(span.first * course.step_s, digits),
        until_s=round(span.last * course.step_s, digits),
        gap_m=span.gap_m if math.isfinite(span.gap_m) else math.nan,
        ttc_s=span.ttc_s if math.isfinite(span.ttc_s) else math.nan,
        text=span.text,
    )


def rows_of(found: Sequence[Manoeuvre], **game: Any) -> list[dict[str, Any]]:
    """One game's rows of `manoeuvres.csv`; `game` are its cells in every row: arm, persona, seed, episode."""
    return [{**game, **asdict(each)} for each in found]


def manoeuvres_in(rows: pd.DataFrame) -> list[Manoeuvre]:
    """The manoeuvres of one game from its rows of `manoeuvres.csv`."""
    columns = list(Manoeuvre.__dataclass_fields__)
    return [Manoeuvre(**row) for row in rows[columns].to_dict("records")]
