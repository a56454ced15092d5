"""A table of the run as cells of the page: the text that is shown, and beside it the exact text of the CSV file."""

from __future__ import annotations

import base64
import json
import math
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd
from markupsafe import Markup

from harness.evaluation.tables import typed
from harness.reports.numbers import MISSING, number, p_number, trimmed

PACKED = ("episodes", "training", "reconfiguration")
"""The tables with thousands of rows are packed: columns of exact texts as JSON, deflated, in base64. `tables.js` reads
them."""
UNITS = (("_mps2", "m/s²"), ("_mps", "m/s"), ("_m", "m"), ("_s", "s"))
RATES = (
    *("failure_rate", "non_ego_goal_rate", "ego_failure_rate", "naive_failure_rate", "solution_failure_rate"),
    *("gap_share", "share", "near_miss_rate"),
)
POINTS = ("failure_difference", "fewer_failures")
"""Differences of rates."""
P_VALUES = ("p_value", "p_holm", "mcnemar_p")
IN_THE_METRICS_UNIT = ("mean_difference", "ci_low", "ci_high")

NAMES = {
    "mean_difference": "mean difference towards H1",
    "ci_low": "its 95 % low",
    "ci_high": "its 95 % high",
    "p_value": "p",
    "p_holm": "p after Holm",
    "mcnemar_p": "McNemar p",
    "effect_size": "effect size d_z",
    "rejects_h0": "rejects H0 (p alone)",
    "pairs_left_out": "pairs left out",
    "episodes": "games",
}
"""Headings of the columns whose names are not clear."""


@dataclass(frozen=True, kw_only=True)
class Heading:
    """A column: its name in the CSV file, its label on the page, and its unit."""

    column: str
    label: str
    unit: str
    text: bool
    """Whether its cells are words."""
    kind: str = "text"
    """How a cell of the column is shown: text, flag, count, plain, percent or number."""


@dataclass(frozen=True, kw_only=True)
class Cell:
    """`exact` is the text of the CSV file's cell, None where `text` is the same (text columns)."""

    text: str
    exact: str | None


@dataclass(frozen=True, kw_only=True)
class Table:
    """One CSV file as the page shows it."""

    name: str
    caption: str
    headings: Sequence[Heading]
    rows: Sequence[Sequence[Cell]]
    """None of them where they are packed."""
    length: int
    """Its number of rows."""
    packed: Markup | None = None


def table(name: str, caption: str, frame: pd.DataFrame) -> Table:
    """The frame, one of `harness.evaluation.tables.TABLES`, as cells; `name` is the CSV file's without its suffix."""
    frame = typed(frame)
    headings = [heading(str(column), frame[column].dtype == object, _kind(frame[column])) for column in frame.columns]
    if name in PACKED:
        packed = pack([[exact(value) for value in frame[column].tolist()] for column in frame.columns])
        return Table(name=name, caption=caption, headings=headings, rows=(), length=len(frame), packed=packed)
    metrics = frame["metric"].tolist() if "metric" in frame.columns else [""] * len(frame)
    columns = [
        [_cell(column, value, metric) for value, metric in zip(frame[column].tolist(), metrics, strict=True)]
        for column in frame.columns
    ]
    rows = list(zip(*columns, strict=True))
    return Table(name=name, caption=caption, headings=headings, rows=rows, length=len(rows))


def pack(columns: Sequence[Sequence[str]]) -> Markup:
    """Columns of texts as one text of a script element."""
    text = json.dumps(columns, separators=(",", ":"))
    return Markup(base64.b64encode(zlib.compress(text.encode(), 9)).decode("ascii"))


def _kind(column: pd.Series) -> str:
    """How the cells of a column of a packed table are shown, as `_text` shows them."""
    name = str(column.name)
    if column.dtype == object:
        return "text"
    if column.dtype == "boolean" or column.dtype == bool:
        return "flag"
    if pd.api.types.is_integer_dtype(column.dtype):
        return "plain" if name == "seed" else "count"
    return "percent" if name.startswith(RATES + POINTS) else "number"


def heading(column: str, text: bool, kind: str = "text") -> Heading:
    """The heading of a column, from its name and the unit in it."""
    if column in NAMES:
        return Heading(column=column, label=NAMES[column], unit="", text=False, kind=kind)
    stem, unit = column, "%" if column.startswith(RATES) else "points" if column.startswith(POINTS) else ""
    for ending, symbol in UNITS:
        if column.endswith(ending):
            stem, unit = column.removesuffix(ending), symbol
            break
    label = stem.replace("_ttc", "_time_to_collision").replace("non_ego", "non-ego").replace("_", " ")
    for end in ("low", "high"):
        label = label.replace(f" {end}", f", 95 % {end}")
    return Heading(column=column, label=label, unit=unit, text=text, kind=kind)


def exact(value: object) -> str:
    """The text of a value in the CSV file, as `harness.evaluation.tables.write_csv` writes it, unquoted."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return "true" if value else "false"
    return "" if pd.isna(value) else repr(value)


def _cell(column: str, value: Any, metric: str) -> Cell:
    if isinstance(value, str):
        return Cell(text=value, exact=None)
    return Cell(text=_text(column, value, metric), exact=exact(value))


def _text(column: str, value: Any, metric: str) -> str:
    if pd.isna(value):
        return MISSING
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return str(value) if column == "seed" else f"{value:,}"
    if not math.isfinite(value):
        return str(value)
    if column in P_VALUES:
        return p_number(value)
    if column.startswith(RATES + POINTS):
        return trimmed(value * 100, 1)
    if column in IN_THE_METRICS_UNIT and metric:
        return f"{number(value * 100, 1)} points" if metric == "failure" else f"{number(value, 3)} m/s"
    return number(value, 2)
