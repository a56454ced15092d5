"""What reconfiguring an ego has changed, from the tables of a run.

    python docs/egos/tuning.py reports/paper_merge-adas

prints a table in Markdown: a row for each person against which the ego was reconfigured, and then one for each of its
parameters.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import pandas as pd
import typer

from harness.evaluation.tables import read_csv


def main(run: Annotated[Path, typer.Argument(metavar="RUN", help="A run folder with reconfiguration.csv.")]) -> None:
    """Print both tables."""
    summary = read_csv(run / "summary.csv").set_index("arm")
    trials = read_csv(run / "reconfiguration.csv")
    people = list(dict.fromkeys(trials["persona"]))
    print(
        _table(
            ("against", "fails", "reconfigured", "mean payoff", "reconfigured", "fails alone, reconfigured"),
            [_effect(person, summary) for person in people],
        )
    )
    print()
    print(_table(("parameter", "before", *(f"against {person}" for person in people)), _parameters(trials, people)))


def _effect(person: str, summary: pd.DataFrame) -> list[str]:
    before, after = summary.loc[f"naive_vs_{person}"], summary.loc[f"reconfigured_vs_{person}"]
    alone = summary.loc[f"reconfigured_alone_{person}"]
    rates = [f"{arm['failure_rate']:.0%}".replace("%", " %") for arm in (before, after, alone)]
    return [person, rates[0], rates[1], f"{before['ego_payoff']:.1f}", f"{after['ego_payoff']:.1f}", rates[2]]


def _parameters(trials: pd.DataFrame, people: list[str]) -> list[list[str]]:
    """A row for each parameter: its value in the first trial, which is that of the document, and in the chosen ones."""
    chosen = trials[trials["chosen"]].set_index(["persona", "parameter"])["value"]
    first = trials[trials["trial"] == 0].drop_duplicates("parameter").set_index("parameter")["value"]
    return [
        [f"`{name}`", f"{value:.3g}", *(f"{chosen[person, name]:.3g}" for person in people)]
        for name, value in first.items()
    ]


def _table(header: tuple[str, ...], rows: list[list[str]]) -> str:
    return "\n".join("| " + " | ".join(cells) + " |" for cells in (header, ["---"] * len(header), *rows))


if __name__ == "__main__":
    typer.run(main)
