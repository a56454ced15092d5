"""A table of the run as cells of the page: the text that is shown, and beside it the exact text of the CSV file."""

from __future__ import annotations

import base64
import json
import math
import zlib
from typing import Any, NamedTuple

import pandas as pd
from markupsafe import Markup

from harness.evaluation.column import COUNT, FLAG, MAYBE, OF_METRIC, P_VALUE, POINTS, SHARE, TEXT, Column
from harness.evaluation.tables import columns_of, exact, typed
from harness.reports.differences import METRIC_WORDS
from harness.reports.numbers import MISSING, number, p_number, trimmed

PACKED = ("episodes", "training", "reconfiguration")
"""The tables with thousands of rows are packed: columns of exact texts as JSON, deflated, in base64. `tables.js` reads
them."""
_SYMBOLS = {SHARE: "%", POINTS: "points", P_VALUE: "", OF_METRIC: ""}
_KINDS = {TEXT: "text", FLAG: "flag", COUNT: "count", MAYBE: "count"}


class Cell(NamedTuple):
    text: str
    exact: str | None
    """The text of the CSV file's cell, None where it is the same (text columns)."""


def table(name: str, caption: str, frame: pd.DataFrame) -> dict[str, Any]:
    """What the template shows of the frame, one of `harness.evaluation.columns.TABLES`; `name` is the CSV file's
    without its suffix. `length` is the number of rows; there are no `rows` where they are `packed`."""
    frame, about = typed(frame), columns_of(frame.columns)
    shown = {"name": name, "caption": caption, "headings": list(map(_heading, about.values())), "length": len(frame)}
    if name in PACKED:
        texts = json.dumps([list(map(exact, frame[column].tolist())) for column in about], separators=(",", ":"))
        packed = base64.b64encode(zlib.compress(texts.encode(), 9)).decode("ascii")
        return {**shown, "rows": (), "packed": Markup(packed)}
    metrics = frame["metric"].tolist() if "metric" in frame.columns else [""] * len(frame)
    columns = [
        [_cell(column, value, metric) for value, metric in zip(frame[name].tolist(), metrics, strict=True)]
        for name, column in about.items()
    ]
    return {**shown, "rows": list(zip(*columns, strict=True)), "packed": None}


def _heading(column: Column) -> dict[str, Any]:
    """A column: its name in the CSV file, its label on the page, its unit, and whether its cells are words. `kind` says
    how a cell is shown: text, flag, count, plain, percent or number."""
    kind = "percent" if column.unit in (SHARE, POINTS) else _KINDS.get(column.dtype, "number")
    return {
        "column": column.name,
        "label": column.words,
        "unit": _SYMBOLS.get(column.unit, column.unit),
        "text": column.dtype == TEXT,
        "kind": "plain" if column.name == "seed" else kind,
    }


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
        unit = METRIC_WORDS[metric].unit
        return f"{number(value, 3)} {unit}" if unit else f"{number(value * 100, 1)} points"
    return number(value, 2)
