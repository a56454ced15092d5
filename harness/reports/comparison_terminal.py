"""The comparison of runs on the terminal: tables whose columns are aligned, within 80 columns for up to five runs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any

from harness.reports.comparison_page import BETTER, CHANGES, WORSE, ComparedRow, Comparison, Transition
from harness.reports.numbers import MISSING, NO_SPACE
from harness.reports.text_table import add_text_row, text_table

if TYPE_CHECKING:
    from rich.table import Table

    from harness.reports.history_figures import PersonHistory

_LOOK: dict[str, Any] = {"padding": (0, 2, 0, 0), "header_style": "dim"}
_STYLES = {"harm": "red", "mended": "green", "open": "default"}


def run_lines(comparison: Comparison) -> Iterator[str]:
    """The number of each run in the tables, with its name."""
    for place, run in enumerate(comparison.runs, 1):
        yield f"{place}  {run.label}"


def history_table(comparison: Comparison, width: int) -> Table:
    """The failures of each ego against each person in each run, by the run's number; with intervals where the terminal
    of `width` columns has room for them."""
    rows = [[_cells(each, place) for place in range(len(comparison.runs))] for each in comparison.histories]
    names = max((2 + len(each.person) for each in comparison.histories), default=0)
    needed = sum(2 + max(map(len, column)) for row in zip(*rows, strict=True) for column in zip(*row, strict=True))
    with_intervals = names + needed <= width
    numbers = [str(place + 1) for place in range(len(comparison.runs))]
    columns = [heading for number in numbers for heading in ([number, "95 %"] if with_intervals else [number])]
    headings = ["ego, person", *columns]
    table = text_table(headings, right=numbers, whole=headings, **_LOOK)
    for ego, group in groupby(zip(comparison.histories, rows, strict=True), key=lambda each: each[0].ego):
        add_text_row(table, ego, style="bold")
        for history, cells in group:
            add_text_row(table, f"  {history.person}", *(text for cell in cells for text in cell[: 1 + with_intervals]))
    return table


def _cells(history: PersonHistory, place: int) -> tuple[str, str]:
    """The failures of a run over all training seeds, and the interval of one."""
    counts = history.counts(place)
    return (counts, history.interval(place).replace(NO_SPACE, " ")) if counts else (MISSING, "")


def difference_table(rows: Sequence[ComparedRow]) -> Table:
    """The figures that became worse, then those that became better, arm by arm."""
    numbers = ("seed", "before", "after")
    table = text_table(("arm, figure", *numbers, ""), right=numbers, whole=(*numbers, ""), **_LOOK)
    changed = [row for row in rows if row.verdict in (WORSE, BETTER)]
    for (_, arm), group in groupby(changed, key=lambda row: (row.verdict, row.found.arm)):
        add_text_row(table, arm, style="bold")
        for row in group:
            words = (f"  {row.found.measure}", str(row.found.seed), row.value_before, row.value_after, row.verdict)
            add_text_row(table, *words, style=_STYLES[row.tone])
    return table


def change_table(transition: Transition) -> Table:
    """How many failures are fixed, new or came back, a line for each arm."""
    shown = [change for change in CHANGES if any(counts[change] for counts in transition.counts.values())]
    table = text_table(("arm", *shown), right=shown, whole=shown, **_LOOK)
    for arm, counts in transition.counts.items():
        add_text_row(table, arm, *(str(counts[change] or MISSING) for change in shown))
    return table
