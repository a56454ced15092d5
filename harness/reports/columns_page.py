"""The page on the columns of every table of a run and of its traces, as Markdown."""

from __future__ import annotations

from collections.abc import Iterable

from harness.evaluation.column import Column
from harness.evaluation.columns import TABLES
from harness.evaluation.trace_columns import TRACE_COLUMNS

_INTRODUCTION = """# Columns

<!-- made by `harness columns --out docs/columns.md` from harness/evaluation/columns.py -->

An empty cell means that the quantity can't be measured, never 0. `episodes.csv`, `causes.csv` and `manoeuvres.csv` are
made from the traces: `harness report RUN` makes them anew where a metric is new. Shares and rates are from 0 to 1. With
several people, the columns of the non-ego in `episodes.csv` occur for each of them, as `non_ego_2_outcome`, and
`ego_collided_with` names the road user that the ego touched.
"""
_TRACES = """
## `traces/<arm>-seed<n>.parquet`

A row for each road user in each step of every game: players, background traffic and obstacles. From Python:
`harness.load(RUN).trace(arm, seed, episode)` is the DataFrame of one game.
"""
_NOTES = """
## The measures of severity

They are computed from oriented boxes at any angle, not along lanes. `pytest tests/evaluation/test_severity.py`
compares them with cases computed by hand. Thresholds, and the masses of SUMO's vehicle classes, are in
`harness/evaluation/severity/limits.py`. In a bend, a course of constant heading leaves the lane: TTC is that of a car
that does not steer.

`python -m benchmarks.criticality` compares them with commonroad-crime 0.4.5, whose measures follow lanes; the script
says how. Of 511 moments in 50 games of `naive_vs_speedy`, training seed 1, commonroad-crime has a TTC at 4, all above a
minute, and the boxes at 22, at no moment both: a measure along lanes does not see a car that comes from the side. Both
have a time headway at 118 moments; the values differ by at most 0.10 s, to which commonroad-crime rounds.
"""


_ORDER = ("episodes", "causes", "manoeuvres", "summary", "comparisons")


def columns_page() -> str:
    """The page `docs/columns.md`."""
    names = [*_ORDER, *(name for name in TABLES if name not in (*_ORDER, "played"))]
    tables = [f"\n## `{name}.csv`\n" + _table(TABLES[name].values()) for name in names]
    return "".join([_INTRODUCTION, *tables, _TRACES, _table(TRACE_COLUMNS), _NOTES])


def _table(columns: Iterable[Column]) -> str:
    head = "\n| column | unit | meaning | source |\n| --- | --- | --- | --- |\n"
    return head + "".join(map(_row, columns))


def _row(column: Column) -> str:
    meaning = column.meaning.replace("|", "\\|")
    return f"| `{column.name}` | {column.unit} | {meaning} | {column.source} |\n"
