"""The table on starts by regret in docs/robust.md, from the runs of uniform.toml and regret.toml.

    python docs/robust/regret_starts.py reports/starts-uniform reports/starts-regret

Prints a table in Markdown: for each training seed the failures of the ego that was retrained from uniform starts, and
of the one that replayed starts of high regret. `prevented` counts those that the careful and competent driver of UN
R157 prevents from the danger on. The p-value is McNemar's, over games of the same start.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import pandas as pd
import typer
from robust_egos import games_of

from harness.evaluation.comparisons.comparison import mcnemar

ARM = "retrained_vs_impatient"
GAME = ["seed", "episode"]


def prevented(run: Path) -> pd.Series:
    """How many failures of the arm are prevented, by training seed."""
    table = pd.read_csv(run / "preventability.csv")
    judged = table[(table["arm"] == ARM) & (table["driver"] == "careful_and_competent")]
    return judged.set_index("seed")["from_conflict_prevented"]


def rows(uniform: Path, regret: Path) -> list[list[str]]:
    """A row for each training seed, and one for all."""
    runs = [games_of(run) for run in (uniform, regret)]
    naive = runs[0][runs[0]["arm"] == "naive_vs_impatient"]
    own = [games.loc[games["arm"] == ARM, [*GAME, "ego_failed"]] for games in runs]
    pairs = own[0].merge(own[1], on=GAME, suffixes=("_uniform", "_regret"))
    of_runs = [prevented(run) for run in (uniform, regret)]
    table = []
    for seed in [*pairs["seed"].unique(), "all"]:
        chosen, first = (games if seed == "all" else games[games["seed"] == seed] for games in (pairs, naive))
        cells = [str(seed), str(len(chosen)), str(first["ego_failed"].sum())]
        for name, of_run in zip(("uniform", "regret"), of_runs, strict=True):
            spared = of_run.sum() if seed == "all" else of_run.get(seed, 0)  # an arm without a failure has no row
            cells += [str(chosen[f"ego_failed_{name}"].sum()), str(spared)]
        differences = chosen["ego_failed_regret"].astype(int) - chosen["ego_failed_uniform"].astype(int)
        table.append([*cells, f"{mcnemar(differences.to_numpy(dtype=float), 'two-sided'):.2g}"])
    return table


def main(
    uniform: Annotated[Path, typer.Argument(metavar="UNIFORM", help="The run with uniform starts.")],
    regret: Annotated[Path, typer.Argument(metavar="REGRET", help="The run with starts by regret.")],
) -> None:
    """Print the table."""
    print("| seed | games | naive ego fails | uniform starts: fails | prevented | regret: fails | prevented | p |")
    print("| --- |" + " ---: |" * 7)
    for cells in rows(uniform, regret):
        print(f"| {' | '.join(cells)} |")


if __name__ == "__main__":
    typer.run(main)
