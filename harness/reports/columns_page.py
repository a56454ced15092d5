"""The page on the columns of `episodes.csv`, as Markdown."""

from __future__ import annotations

from harness.evaluation.columns import EPISODES
from harness.evaluation.severity.columns import Column

_INTRODUCTION = """# Columns of `episodes.csv`

<!-- made by `harness columns --out docs/columns.md` from harness/evaluation/columns.py -->

A row is a game. An empty cell means that the quantity can't be measured in this game, never 0. With several people, the
columns of the non-ego occur for each of them, as `non_ego_2_outcome`, and `ego_collided_with` names the road user that
the ego touched. The columns from `closing_speed_mps` to `severity` are worked out from the traces.

| column | unit | meaning | source |
| --- | --- | --- | --- |
"""
_NOTES = """
The measures are computed from oriented boxes at any angle, not along lanes. `pytest tests/evaluation/test_severity.py`
compares them with cases computed by hand. Masses are those of SUMO's vehicle classes
(`harness/evaluation/severity/masses.py`); thresholds are in `harness/evaluation/severity/thresholds.py`. In a bend, a
course of constant heading leaves the lane: TTC is that of a car that does not steer.

`python -m benchmarks.criticality` compares them with commonroad-crime 0.4.5, whose measures follow lanes; the script
says how. Of 511 moments in 50 games of `naive_vs_speedy`, training seed 1, commonroad-crime has a TTC at 4, all above a
minute, and the boxes at 22, at no moment both: a measure along lanes does not see a car that comes from the side. Both
have a time headway at 118 moments; the values differ by at most 0.10 s, to which commonroad-crime rounds.
"""


def columns_page() -> str:
    """The page `docs/columns.md`."""
    return _INTRODUCTION + "".join(_row(name, column) for name, column in EPISODES.items()) + _NOTES


def _row(name: str, column: Column) -> str:
    meaning = column.meaning.replace("|", "\\|")
    return f"| `{name}` | {column.unit} | {meaning} | {column.source or 'our own'} |\n"
