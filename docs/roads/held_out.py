"""How egos drive on roads on which they did not learn, as a Markdown table.

    python docs/roads/held_out.py reports/roads/one-road reports/roads/nine-roads

prints for each league on varied roads, and each person there, the share of games in which the ego fails, the roads with
a failure, and the failures on the worst road.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer
from scipy.stats import binomtest

from harness.evaluation.tables import read_csv

HEADER = ("league", "beside", "roads", "games", "ego fails", "roads with a failure", "worst road")


def main(leagues: Annotated[list[Path], typer.Argument(metavar="LEAGUE...", help="Folders of leagues.")]) -> None:
    """Print the table."""
    rows = [row for league in leagues for row in rows_of(league)]
    print("\n".join("| " + " | ".join(cells) + " |" for cells in (HEADER, ["---"] * len(HEADER), *rows)))


def rows_of(league: Path) -> Iterator[list[str]]:
    """A row for each person of a league: all roads together."""
    table = read_csv(league / "league.csv")
    for person, rows in table.groupby("person", sort=True):
        failed = (rows["failure_rate"] * rows["episodes"]).round().astype(int)
        games, failures = int(rows["episodes"].sum()), int(failed.sum())
        low, high = binomtest(failures, games).proportion_ci()
        share = f"{failures / games:.1%} ({low:.1%} to {high:.1%})"
        worst = f"{failed.max()} of {rows.loc[failed.idxmax(), 'episodes']}"
        yield [league.name, str(person), str(len(rows)), str(games), share, str(int((failed > 0).sum())), worst]


if __name__ == "__main__":
    typer.run(main)
