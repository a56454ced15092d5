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

from harness.evaluation.column import COUNT, FLAG, MAYBE, OF_METRIC, P_VALUE, POINTS, SHARE, TEXT, Column
from harness.evaluation.tables import columns_of, exact, typed
from harness.reports.numbers import MISSING, number, p_number, trimmed

PACKED = ("episodes", "training", "reconfiguration")
"""The tables with thousands of rows are packed: columns of exact texts as JSON, deflated, in base64. `tables.js` reads
them."""
_SYMBOLS = {SHARE: "%", POINTS: "points", P_VALUE: "", OF_METRIC: ""}
_KINDS = {TEXT: "text", FLAG: "flag", COUNT: "count", MAYBE: "count"}


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
    """The frame, one of `harness.evaluation.columns.TABLES`, as cells; `name` is the CSV file's without its suffix."""
    frame, about = typed(frame), columns_of(frame.columns)
    headings = [heading(column) for column in about.values()]
    if name in PACKED:
        packed = pack([[exact(value) for value in frame[column].tolist()] for column in about])
        return Table(name=name, caption=caption, headings=headings, rows=(), length=len(frame), packed=packed)
    metrics = frame["metric"].tolist() if "metric" in frame.columns else [""] * len(frame)
    columns = [
        [_cell(column, value, metric) for value, metric in zip(frame[name].tolist(), metrics, strict=True)]
        for name, column in about.items()
    ]
    rows = list(zip(*columns, strict=True))
    return Table(name=name, caption=caption, headings=headings, rows=rows, length=len(rows))


def pack(columns: Sequence[Sequence[str]]) -> Markup:
    """Columns of texts as one text of a script element."""
    text = json.dumps(columns, separators=(",", ":"))
    return Markup(base64.b64encode(zlib.compress(text.encode(), 9)).decode("ascii"))


def heading(column: Column) -> Heading:
    """The heading of a column."""
    kind = "percent" if column.unit in (SHARE, POINTS) else _KINDS.get(column.dtype, "number")
    return Heading(
        column=column.name,
        label=column.words,
        unit=_SYMBOLS.get(column.unit, column.unit),
        text=column.dtype == TEXT,
        kind="plain" if column.name == "seed" else kind,
    )


def _cell(column: Column, value: Any, metric: str) -> Cell:
    if isinstance(value, str):
        return Cell(text=value, exact=None)
    return Cell(text=_text(column, value, metric), exact=exact(value))


def _text(column: Column, value: Any, metric: str) -> str:
    if pd.isna(value):
        return MISSING
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return str(value) if column.name == "seed" else f"{value:,}"
    if not math.isfinite(value):
        return str(value)
    if column.unit == P_VALUE:
        return p_number(value)
    if column.unit in (SHARE, POINTS):
        return trimmed(value * 100, 1)
    if column.unit == OF_METRIC:
        return f"{number(value * 100, 1)} points" if metric == "failure" else f"{number(value, 3)} m/s"
    return number(value, 2)
