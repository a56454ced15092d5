"""Which trait of a person makes the naive ego fail, over all training seeds, as a Markdown table.

    python docs/scenes/traits.py reports/left_across reports/red_light

prints, from attribution.csv, in how many games the naive ego fails against the person as it is, against the person with
this trait of the careful person, against the careful person, and against the careful person with this trait alone.
Trainings of which the question is not answered, because a player can't drive the scene, are left out.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import pandas as pd
import typer

from harness.evaluation.tables import read_csv

HEADER = (
    *("scene", "person", "trait", "games", "fails against the person", "without the trait"),
    *("against the careful person", "with the trait alone"),
)
COUNTS = ["failures", "failures_without", "failures_baseline", "failures_alone"]


def main(runs: Annotated[list[Path], typer.Argument(metavar="RUN...", help="Run folders.")]) -> None:
    """Print the table."""
    rows = [row for run in runs for row in rows_of(run)]
    print("\n".join("| " + " | ".join(cells) + " |" for cells in (HEADER, ["---"] * len(HEADER), *rows)))


def rows_of(run: Path) -> Iterator[list[str]]:
    """A row for each person and trait of a run folder. The first trait, all, is the careful person itself."""
    table = read_csv(run / "attribution.csv")
    table = table[table["reason"] == ""].copy()
    table.loc[table["trait"] == "all", "failures_baseline"] = table["failures_without"]
    for (person, trait), of_seeds in table.groupby(["persona", "trait"], sort=False):
        counts = of_seeds[COUNTS].sum(min_count=1)
        cells = ["" if pd.isna(counts[name]) else str(int(counts[name])) for name in COUNTS]
        yield [run.name, str(person), str(trait), str(int(of_seeds["without_pairs"].sum())), *cells]


if __name__ == "__main__":
    typer.run(main)
