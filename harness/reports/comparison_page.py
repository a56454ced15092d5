"""The comparison of two runs in words, and as a page that opens offline."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from harness.evaluation.comparisons.run_comparison import Difference, Side
from harness.reports.differences import CHANCE, NO_RELEVANT_DIFFERENCE, RELEVANT_SPEED_MPS
from harness.reports.numbers import MISSING, NO_SPACE, interval, number, percent, signed
from harness.reports.page_template import environment_of
from harness.reports.provenance import command_of, facts, made_by

BETTER, WORSE, UNKNOWN = "better", "worse", "not the same games"
EQUAL, NOT_SHOWN = "no difference", "no difference shown"
TONES = {BETTER: "mended", WORSE: "harm"}
NOTHING_IN_COMMON = "The runs have no arm and seed in common."
DIFFERENT_STARTS = (
    "The scenes or the first training seeds differ, so games have different starts: there are no pairs and no tests."
)


@dataclass(frozen=True, kw_only=True)
class ComparedRow:
    """One difference in words."""

    found: Difference
    verdict: str
    tone: str
    sentence: str
    before: str
    after: str
    difference: str
    interval: str


def compared_rows(differences: Sequence[Difference], significance: float) -> list[ComparedRow]:
    """Every difference in words, worse ones first, then better ones."""
    rows = [_row(each, significance) for each in differences]
    order = {WORSE: 0, BETTER: 1}
    return sorted(rows, key=lambda row: order.get(row.verdict, 2))


def headline(rows: Sequence[ComparedRow]) -> str:
    """The result of the comparison in one line."""
    if not rows:
        return NOTHING_IN_COMMON
    worse, better = (sum(row.verdict == verdict for row in rows) for verdict in (WORSE, BETTER))
    return f"Worse: {worse} of {len(rows)} figures; better: {better}."


def render_comparison(
    runs: Sequence[tuple[str, Mapping[str, Any]]],
    rows: Sequence[ComparedRow],
    *,
    same_starts: bool,
    significance: float,
) -> str:
    """The page as HTML. `runs` are name and manifest of both runs. Equal input gives equal text."""
    return (
        environment_of("reports")
        .get_template("compare.html.jinja")
        .render(
            runs=[
                (name, command_of(each), made_by(each), facts(each, (), len(each.get("personas", ()))))
                for name, each in runs
            ],
            rows=rows,
            headline=headline(rows),
            remark="" if same_starts else DIFFERENT_STARTS,
            significance=significance,
            several_seeds=len({row.found.seed for row in rows}) > 1,
        )
    )


def _row(found: Difference, significance: float) -> ComparedRow:
    verdict = _verdict(found, significance)
    sentence = f"{found.arm}: {found.measure} {_value(found, found.before)} before, {_value(found, found.after)} after"
    return ComparedRow(
        found=found,
        verdict=verdict,
        tone=TONES.get(verdict, "open"),
        sentence=f"{sentence}: {CHANCE if verdict == NOT_SHOWN else verdict}, seed {found.seed}",
        before=_with_interval(found, found.before),
        after=_with_interval(found, found.after),
        difference=_with_unit(found, found.mean) if found.pairs else "",
        interval=" to ".join(_with_unit(found, end) for end in _ends(found)) if len(_ends(found)) > 1 else MISSING,
    )


def _verdict(found: Difference, significance: float) -> str:
    if not found.pairs:
        return UNKNOWN
    if found.mean == 0.0:
        return EQUAL
    if not found.is_rate and all(abs(end) < RELEVANT_SPEED_MPS for end in _ends(found)):
        return NO_RELEVANT_DIFFERENCE
    if not found.p_holm < significance:
        return NOT_SHOWN
    return BETTER if (found.mean > 0) != found.is_rate else WORSE


def _ends(found: Difference) -> tuple[float, ...]:
    return (found.low, found.high) if math.isfinite(found.low) else (found.mean,)


def _value(found: Difference, side: Side) -> str:
    if found.is_rate:
        return f"{round(side.value * side.games)} of {side.games}" if side.games else percent(math.nan)
    return f"{number(side.value, 2)}{NO_SPACE}m/s"


def _with_interval(found: Difference, side: Side) -> str:
    if found.is_rate:
        return f"{_value(found, side)} ({interval(side.low, side.high)})"
    ends = f" ({number(side.low, 2)}–{number(side.high, 2)})" if math.isfinite(side.low) else ""
    return f"{_value(found, side)}{ends}"


def _with_unit(found: Difference, value: float) -> str:
    return f"{signed(value * 100.0, 1)} points" if found.is_rate else f"{number(value, 3)}{NO_SPACE}m/s"
