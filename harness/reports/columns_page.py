"""The page on the columns of every table of a run and of its traces, as Markdown."""

from __future__ import annotations

from harness.evaluation.columns import TABLES
from harness.evaluation.trace_columns import PERCEIVED, SHIELDED, TRACE_COLUMNS
from harness.reports.page_template import environment_of

_ORDER = ("episodes", "causes", "manoeuvres", "summary", "comparisons")


def columns_page() -> str:
    names = [*_ORDER, *(name for name in TABLES if name not in (*_ORDER, "played"))]
    template = environment_of("reports", autoescape=False).get_template("columns.md.jinja")
    return (
        template.render(tables={name: TABLES[name] for name in names}, traces=(*TRACE_COLUMNS, SHIELDED, *PERCEIVED))
        + "\n"
    )
