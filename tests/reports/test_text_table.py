"""Tables on the terminal: cells are text as it is, whatever a run or an ego is called."""

from __future__ import annotations

import io
from pathlib import Path

import pandas as pd
import pytest
from rich.console import Console
from rich.table import Table

from harness.reports.index_page import IndexedRun, terminal_table
from harness.reports.league_page import ranks_terminal
from harness.reports.text_table import add_text_row, text_table

NAMES = ("run[a]", "run[bold]", "run[/x]", "[link=file:///etc]run")


def lines_of(table: Table, width: int = 100) -> list[str]:
    written = io.StringIO()
    Console(file=written, width=width).print(table)
    return [line.rstrip() for line in written.getvalue().splitlines()]


def test_text_table__folds_what_is_not_whole_and_aligns_numbers() -> None:
    table = text_table(("name", "size", "parts"), right=("size",), whole=("size",))
    add_text_row(table, "a_long_name_without_a_space", "12", ("one", "two"), style="red")
    heading, first, second, *_ = lines_of(table, 29)
    assert [first.split()[0] + second.split()[0], first.split()[1:]] == ["a_long_name_without_a_space", ["12", "one"]]
    assert heading.index("size") + len("size") == first.index("12") + len("12")
    assert second.endswith(" two")


def test_text_table__escapes_what_controls_a_terminal() -> None:
    table = text_table(("name",))
    add_text_row(table, "\x1b[31m18\N{NO-BREAK SPACE}%\n")
    assert lines_of(table) == ["name", "\\x1b[31m18\N{NO-BREAK SPACE}%\\n"]


@pytest.mark.parametrize("name", NAMES)
def test_runs__their_names_are_no_markup(name: str, tmp_path: Path) -> None:
    run = IndexedRun(folder=tmp_path / name, name=name, state="unreadable", problem=f"{name} is damaged")
    _, line = lines_of(terminal_table([run]), width=200)
    assert line.startswith(f"{name} ")
    assert line.endswith(f"can't be read: {name} is damaged")


@pytest.mark.parametrize("name", NAMES)
def test_ranks__names_of_egos_are_no_markup(name: str) -> None:
    row = {"rank": 1, "ego": name, "shield": "", "games": 3, "told_apart": name}
    rates = {"failure_rate": 0.5, "failure_rate_low": 0.1, "failure_rate_high": 0.9}
    _, line = lines_of(ranks_terminal(pd.DataFrame([row | rates])))
    assert line.split()[1] == name
    assert line.endswith(f"  {name}")
