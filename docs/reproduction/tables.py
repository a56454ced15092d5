"""Tables of docs/reproduction.md, as Markdown.

python docs/reproduction/tables.py levers docs/reproduction/levers.csv
python docs/reproduction/tables.py more-episodes reports/more-episodes
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import pandas as pd
import typer

from harness.evaluation.tables import read_csv

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, help=__doc__)


@app.command()
def levers(file: Annotated[Path, typer.Argument(metavar="FILE", help="The table that sweep.py wrote.")]) -> None:
    """Print a row for each setting of a lever."""
    found = pd.read_csv(file, dtype={"value": str})
    header = [
        "persona",
        "key",
        "value",
        "naive ego fails",
        "persona reaches its goal",
        "persona alone reaches its goal",
    ]
    rows = []
    for (persona, key, value), of_setting in found.groupby(["persona", "key", "value"], sort=False):
        arms = of_setting.set_index("arm")
        tested, alone, retrained = (
            arms.loc[arm] for arm in (f"naive_vs_{persona}", f"{persona}_alone", f"retrained_vs_{persona}")
        )
        shares = [tested["failure_rate"], tested["non_ego_goal_rate"], alone["non_ego_goal_rate"]]
        shares.append(retrained["failure_rate"])
        rates = [f"{share:.0%}".replace("%", " %") for share in shares]
        rows.append([persona, f"`{key}`", value, *rates, f"{retrained['mean_speed_mps']:.2f}"])
    print(_table([*header, "retrained ego fails", "retrained ego's speed, m/s"], rows))


@app.command(name="more-episodes")
def more_episodes(run: Annotated[Path, typer.Argument(metavar="RUN", help="The run folder.")]) -> None:
    """Print failure and goal rates of the distracted driver's arms, a column per training seed."""
    summary, episodes = read_csv(run / "summary.csv"), read_csv(run / "episodes.csv")
    seeds = sorted(summary["seed"].unique())
    failures = summary.set_index(["arm", "seed"])["failure_rate"]
    goals = (episodes["non_ego_outcome"] == "goal").groupby([episodes["arm"], episodes["seed"]]).mean()
    games = int(summary["episodes"].max())
    lines = {
        "naive ego against the distracted driver: failures": failures.loc["naive_vs_paper_distracted"],
        "retrained ego against the distracted driver: failures": failures.loc["retrained_vs_paper_distracted"],
        "distracted driver alone: goal reached": goals.loc["paper_distracted_alone"],
        "naive ego alone: failures": failures.loc["naive_alone"],
        "naive ego against SUMO's driver: failures": failures.loc["naive_vs_sumo"],
        "retrained ego alone: failures": failures.loc["retrained_alone_paper_distracted"],
    }
    rows = [[name, *(f"{of_seed[seed]:.1%}".replace("%", " %") for seed in seeds)] for name, of_seed in lines.items()]
    print(_table([f"{games} episodes of each seed", *(f"seed {seed}" for seed in seeds)], rows))


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


if __name__ == "__main__":
    app()
