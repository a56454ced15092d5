"""The tables of docs/realism.md: the players of runs beside published figures of people.

    python docs/realism/beside_people.py players reports/demo [RUN ...]
    python docs/realism/beside_people.py outside reports/demo [RUN ...]

reads `realism.csv` of each run folder.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from harness.evaluation.realism import (
    CRASH_ODDS,
    CRASH_SOURCE,
    CRASHES,
    INSIDE,
    ODDS_SOURCE,
    OF_DRIVERS,
    OF_RIDERS,
    OF_WALKERS,
    Games,
    HumanFigure,
)
from harness.evaluation.tables import read_csv
from harness.reports.human_ranges import headline, human_rows, title_of

app = typer.Typer(add_completion=False)


@app.command()
def players(runs: Annotated[list[Path], typer.Argument(metavar="RUN ...")]) -> None:
    """The comparable figures of the players of each run."""
    for run in runs:
        table = read_csv(run / "realism.csv")
        print(f"`{run.name}`. {headline(table)}\n")
        _print_row("player", "figure", "games", "value (90 % of the games)", "people", "verdict")
        _print_row(*["---"] * 6)
        for row in human_rows(table):
            _print_row(row.player, row.figure, str(row.games), row.measured, row.people, row.realistic)
        print()


@app.command()
def outside(runs: Annotated[list[Path], typer.Argument(metavar="RUN ...")]) -> None:
    """How many figures of each run can be compared, and those that are not inside the range of people."""
    _print_row("run", "figures compared", "inside", "not inside")
    _print_row(*["---"] * 4)
    for run in runs:
        rows = human_rows(read_csv(run / "realism.csv"))
        others = [row for row in rows if row.realistic != INSIDE]
        told = [f"{row.player}: {row.figure} {row.value}, people {row.people} ({row.realistic})" for row in others]
        _print_row(f"`{run.name}`", str(len(rows)), str(len(rows) - len(others)), "; ".join(told))


@app.command()
def ranges() -> None:
    """The figures of people, with their sources."""
    _print_row("figure", "of", "in games", "people", "source")
    _print_row(*["---"] * 5)
    for of, figures in (("drivers", OF_DRIVERS), ("people on foot", OF_WALKERS), ("cyclists and riders", OF_RIDERS)):
        for each in figures:
            _print_row(title_of(each.name), of, each.games.value, _range(each), each.source or "none found")
    _print_row(title_of(CRASHES), "all", Games.ALONE.value, "outside if the interval is above 2.91", CRASH_SOURCE)
    odds = "at least 1.8 and at most 7.2; outside if the interval is beside it"
    _print_row(title_of(CRASH_ODDS), "persons with lapses", Games.ALONE.value, odds, ODDS_SOURCE)


def _print_row(*cells: str) -> None:
    print(f"| {' | '.join(cells)} |")


def _range(figure: HumanFigure) -> str:
    if not figure.source:
        return "not compared"
    ends = {"at least": figure.low, "at most": figure.high}
    return " and ".join(f"{word} {end:g}" for word, end in ends.items() if math.isfinite(end))


if __name__ == "__main__":
    app()
