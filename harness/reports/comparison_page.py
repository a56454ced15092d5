"""The comparison of runs in words, and as a page that opens offline."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, get_args

from harness.evaluation.comparisons.run_comparison import ChangedGame, Difference, GameChange, Side
from harness.reports.differences import NO_RELEVANT_DIFFERENCE, RELEVANT_SPEED_MPS
from harness.reports.embedding import key
from harness.reports.figures import GAME
from harness.reports.history_figures import PersonHistory, history_figures
from harness.reports.numbers import MISSING, NO_SPACE, interval, number, percent, signed
from harness.reports.page_template import page_of
from harness.reports.provenance import command_of, facts, made_by

BETTER, WORSE, UNKNOWN = "better", "worse", "not the same games"
EQUAL, NOT_SHOWN = "no difference", "no difference shown"
TONES = {BETTER: "mended", WORSE: "harm"}
CHANGES: tuple[GameChange, ...] = get_args(GameChange)
MOST_GAMES = 60
"""Of an arm, seed and change that are listed by their numbers."""
NOTHING_IN_COMMON = "The runs have no arm and seed in common."
NO_PAIRS = "The games have different starts: no pairs, no tests."
DIFFERENT_STARTS = "The scenes or the first training seeds differ: there are no pairs of games, and no tests."


@dataclass(frozen=True, kw_only=True)
class ComparedRow:
    """One difference in words."""

    found: Difference
    verdict: str
    tone: str
    value_before: str
    value_after: str
    before: str
    """The value with its interval."""
    after: str
    difference: str
    interval: str


def compared_rows(differences: Sequence[Difference], significance: float) -> list[ComparedRow]:
    """Every difference in words, worse ones first, then better ones."""
    rows = [_row(each, significance) for each in differences]
    order = {WORSE: 0, BETTER: 1}
    return sorted(rows, key=lambda row: order.get(row.verdict, 2))


@dataclass(frozen=True, kw_only=True)
class ComparedRun:
    """One of the runs of a comparison."""

    name: str
    """Its folder."""
    label: str
    """Its name on axes and in headings."""
    address: str
    """Of its report; empty: it has none."""
    manifest: Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class Transition:
    """What changes from a run to the next."""

    before: ComparedRun
    after: ComparedRun
    same_starts: bool
    significance: float
    rows: Sequence[ComparedRow]
    changes: Sequence[ChangedGame]

    @property
    def headline(self) -> str:
        return headline(self.rows) if self.same_starts else NO_PAIRS

    @property
    def counts(self) -> dict[str, dict[GameChange, int]]:
        """How many games of each arm change, over all training seeds."""
        found: dict[str, dict[GameChange, int]] = {}
        for each in self.changes:
            counts = found.setdefault(each.arm, dict.fromkeys(CHANGES, 0))
            counts[each.change] += 1
        return found


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """Two runs or more in their order."""

    runs: Sequence[ComparedRun]
    transitions: Sequence[Transition]
    histories: Sequence[PersonHistory]

    def page(self) -> str:
        """The page as HTML. Equal input gives equal text."""
        labels = [run.label for run in self.runs]
        return page_of(
            "compare",
            runs=[(each.name, command_of(each.manifest), made_by(each.manifest), _facts(each)) for each in self.runs],
            labels=labels,
            figures=list(history_figures(self.histories, labels)),
            histories=[
                (each.ego, each.person, [each.text(place) or MISSING for place in range(len(labels))])
                for each in self.histories
            ],
            transitions=[(each, list(_changed(each))) for each in self.transitions],
            different_starts=DIFFERENT_STARTS,
            relevant_mps=RELEVANT_SPEED_MPS,
            several_seeds=len({row.found.seed for each in self.transitions for row in each.rows}) > 1,
        )


def headline(rows: Sequence[ComparedRow]) -> str:
    if not rows:
        return NOTHING_IN_COMMON
    worse, better = (sum(row.verdict == verdict for row in rows) for verdict in (WORSE, BETTER))
    return f"Worse: {worse} of {len(rows)} figures; better: {better}."


def _facts(run: ComparedRun) -> Sequence[tuple[str, Any]]:
    return facts(run.manifest, (), len(run.manifest.get("personas", ())))


def _changed(transition: Transition) -> Iterator[dict[str, Any]]:
    """The games that change, a line for each arm, seed and kind of change: each number with the addresses of the game
    in the run before and in the one after."""
    runs = transition.before, transition.after
    groups: dict[tuple[str, int, GameChange], list[int]] = {}
    for each in sorted(transition.changes, key=lambda each: (each.arm, each.seed, CHANGES.index(each.change))):
        groups.setdefault((each.arm, each.seed, each.change), []).append(each.episode)
    for (arm, seed, change), episodes in groups.items():
        games = [(episode, *(_address(run, arm, seed, episode) for run in runs)) for episode in episodes]
        yield {
            "arm": arm,
            "seed": seed,
            "change": change,
            "tone": "mended" if change == "fixed" else "harm",
            "count": len(games),
            "games": games[:MOST_GAMES],
        }


def _address(run: ComparedRun, arm: str, seed: int, episode: int) -> str:
    return f"{run.address}{GAME}{key(arm, seed, episode)}" if run.address else ""


def _row(found: Difference, significance: float) -> ComparedRow:
    verdict = _verdict(found, significance)
    return ComparedRow(
        found=found,
        verdict=verdict,
        tone=TONES.get(verdict, "open"),
        value_before=_value(found, found.before),
        value_after=_value(found, found.after),
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
        return f"{side.failures} of {side.games}" if side.games else percent(math.nan)
    return f"{number(side.value, 2)}{NO_SPACE}m/s"


def _with_interval(found: Difference, side: Side) -> str:
    if found.is_rate:
        return f"{_value(found, side)} ({interval(side.low, side.high)})"
    ends = f" ({number(side.low, 2)}–{number(side.high, 2)})" if math.isfinite(side.low) else ""
    return f"{_value(found, side)}{ends}"


def _with_unit(found: Difference, value: float) -> str:
    return f"{signed(value * 100.0, 1)} points" if found.is_rate else f"{number(value, 3)}{NO_SPACE}m/s"
