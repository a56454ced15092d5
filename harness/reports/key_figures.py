"""What a persona's card says beside the failure rates: why the ego fails, near misses, the worst known
opponent, the price in speed.

An ego without failures may still come too close in most games, or fail against the next opponent: the card says so.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from harness.evaluation.strategies import EgoStrategy, NaiveEgo, against_persona
from harness.reports.differences import NO_RELEVANT_DIFFERENCE, faster_by, is_equivalent
from harness.reports.numbers import NO_SPACE, SURE, interval, number, percent
from harness.reports.results import Results
from harness.reports.worst_opponent import worst_opponent

PREVENTABLE = "Preventable"
CAUSES = "Why the {ego} ego fails"
NEAR_MISS = "near_miss"
NEAR_MISSES = "Near misses"
WORST_KNOWN_OPPONENT = "Against its worst known opponent"
PRICE = "Price of {doing} in speed"
OFTEN = 0.1
"""A share of games from which a figure is shown as a warning."""


@dataclass(frozen=True, kw_only=True)
class KeyFigure:
    """One line of a card."""

    title: str
    lines: tuple[str, ...]
    warns: bool = False


def key_figures(persona: str, found: Results) -> list[KeyFigure]:
    """The lines of a persona's card, those that can be measured."""
    parts = (_causes, _preventable, _near_misses, _worst_opponent, _price)
    return [figure for part in parts for figure in part(persona, found)]


def _causes(persona: str, found: Results) -> Iterator[KeyFigure]:
    for question, ego in (("RQ1", "naive"), ("RQ2", found.change.made)):
        lines = found.causes(question, persona)
        if lines:
            yield KeyFigure(title=CAUSES.format(ego=ego), lines=lines)


def _preventable(persona: str, found: Results) -> Iterator[KeyFigure]:
    lines = []
    for each in found.preventability.get(against_persona(NaiveEgo(), persona).name, ()):
        if each.failures:
            seed = f"Seed {each.seed}: " if len(found.seeds) > 1 else ""
            count = f"{each.from_start.by_any} of {each.from_start.judged} failures of the {found.naive}"
            rate = f"{percent(each.rate)} of its games, {SURE}: {interval(each.rate_low, each.rate_high)}"
            lines.append(f"{seed}{count} by a reference driver in its seat ({rate})")
    if lines:
        yield KeyFigure(title=PREVENTABLE, lines=tuple(lines))


def _near_misses(persona: str, found: Results) -> Iterator[KeyFigure]:
    if NEAR_MISS not in found.games.columns:
        return
    egos: list[tuple[str, EgoStrategy]] = [("naive", NaiveEgo())]
    if found.asked("RQ2", persona):
        egos.append((found.change.made, found.change.ego(against=persona)))
    lines, last = [], 0.0
    for made, ego in egos:
        games = found.games[found.games["arm"] == against_persona(ego, persona).name]
        marks = games[NEAR_MISS].dropna()
        if len(marks):
            last = float(marks.mean())
            lines.append(f"{int(marks.sum())} of {len(marks)} games of the {made} ego ({percent(last)})")
    if lines:
        yield KeyFigure(title=NEAR_MISSES, lines=tuple(lines), warns=last >= OFTEN)


def _worst_opponent(persona: str, found: Results) -> Iterator[KeyFigure]:
    if not found.asked("RQ2", persona):
        return
    worst = worst_opponent(found.change.ego(against=persona), found.planned_arms, found.arms)
    if worst is None:
        return
    row, rate = worst.row, worst.row["failure_rate"]
    seed = f", seed {worst.seed}" if len(found.seeds) > 1 else ""
    line = (
        f"the {found.change.made} ego fails in {percent(rate)} of games "
        f"({SURE}: {interval(row['failure_rate_low'], row['failure_rate_high'])}) in {worst.arm}{seed}, "
        f"the worst of {worst.assessed} opponents"
    )
    yield KeyFigure(title=WORST_KNOWN_OPPONENT, lines=(line,), warns=rate >= OFTEN)


def _price(persona: str, found: Results) -> Iterator[KeyFigure]:
    lines = []
    for row in found.comparisons:
        if (row["question"], row["persona"], row["metric"]) != ("RQ2", persona, "mean_speed"):
            continue
        faster = faster_by(row)
        if faster != faster:
            continue
        size = f"{number(abs(faster), 2)}{NO_SPACE}m/s {'faster' if faster > 0 else 'slower'}"
        none = NO_RELEVANT_DIFFERENCE if is_equivalent(row) else "none" if faster > 0 else ""
        line = f"{none}: {size}" if none else size
        lines.append(f"Seed {row['seed']}: {line}" if len(found.seeds) > 1 else line)
    if lines:
        yield KeyFigure(title=PRICE.format(doing=found.change.doing), lines=tuple(lines))
