"""Learning curves of the compiled learner and of Stable-Baselines3's own update, side by side.

    python docs/learning/curves.py run --out docs/learning/curves.csv       # train both, over five seeds
    python docs/learning/curves.py table docs/learning/curves.csv           # the table of docs/performance.md
    python docs/learning/curves.py plot docs/learning/curves.csv            # its figure, beside the file

Each learner runs the same campaign of three trainings per seed: the naive ego, a persona against it, the retrained ego.
"""

from __future__ import annotations

import tempfile
from functools import partial
from pathlib import Path
from typing import Annotated

import matplotlib.pyplot as plt
import pandas as pd
import tomli_w
import typer
from rich.console import Console
from scipy.stats import ttest_ind

from harness.campaign.execution.run_campaign import run_campaign
from harness.campaign.execution.worker_pool import WorkerPool, cores
from harness.campaign.preflight import open_campaign
from harness.campaign.storage.run_folder import RunFolder
from harness.errors import StageFailed
from harness.evaluation.tables import read_csv

ROOT = Path(__file__).parents[2]
LEARNERS = ("compiled", "stable_baselines3")
LATEST = 4
"""Windows of a learning curve for the payoff at its end."""

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, help=__doc__)
Curves = Annotated[Path, typer.Argument(metavar="FILE", help="The table that `run` wrote.")]


@app.command()
def run(
    out: Annotated[Path, typer.Option(metavar="FILE", help="The table.")] = Path("docs/learning/curves.csv"),
    steps: Annotated[int, typer.Option(help="Budget of each training.")] = 300_000,
    seeds: Annotated[int, typer.Option(help="Number of training seeds.")] = 5,
    runs: Annotated[Path, typer.Option(metavar="DIR", help="The folder of run folders.")] = Path("reports/learning"),
) -> None:
    """Train with both learners, and write their learning curves. An interrupted run continues where it stopped."""
    curves = []
    for learner in LEARNERS:
        document = {
            "name": f"learning-{learner}",
            "scene": str(ROOT / "networks" / "paper_merge"),
            "personas": [str(ROOT / "personas" / "paper_speedy.toml")],
            "seeds": list(range(1, seeds + 1)),
            "ego": {"persona": str(ROOT / "personas" / "careful.toml")},
            "training": {"steps": steps, "early_convergence": False, "learner": learner},
            "assessment": {"episodes": 2},
        }
        with tempfile.TemporaryDirectory() as scratch:
            file = Path(scratch) / "learning.toml"
            file.write_text(tomli_w.dumps(document), encoding="utf-8")
            folder = RunFolder(runs / learner)
            result = run_campaign(open_campaign(file), folder, partial(WorkerPool, jobs=cores()), Console())
        if result.failed_stages:
            raise StageFailed(f"failed: {', '.join(result.failed_stages)}; see {folder.path}")
        curves.append(read_csv(runs / learner / "training.csv").assign(learner=learner))
    columns = ["learner", "stage", "seed", "steps", "mean_payoff", "failure_rate", "games"]
    pd.concat(curves)[columns].to_csv(out, index=False)


@app.command()
def table(file: Curves) -> None:
    """Print the payoff at the end of each training, by learner: mean, standard deviation over seeds, and their test."""
    latest = at_end(pd.read_csv(file))
    print("| training | compiled | Stable-Baselines3 | difference | p |")
    print("| --- | ---: | ---: | ---: | ---: |")
    for stage, of_stage in latest.groupby("stage", sort=False):
        one, other = (of_stage[of_stage["learner"] == learner]["mean_payoff"] for learner in LEARNERS)
        p_value = ttest_ind(one, other, equal_var=False).pvalue
        cells = [f"{each.mean():.2f} ± {each.std():.2f}" for each in (one, other)]
        print(f"| `{stage}` | {cells[0]} | {cells[1]} | {one.mean() - other.mean():+.2f} | {p_value:.2f} |")


@app.command()
def plot(file: Curves) -> None:
    """Draw the curves: the mean over seeds, and the range of all seeds."""
    curves = pd.read_csv(file)
    stages = curves["stage"].unique()
    figure, axes = plt.subplots(1, len(stages), figsize=(10, 3), constrained_layout=True)
    for axis, stage in zip(axes, stages, strict=True):
        for learner, colour in zip(LEARNERS, ("tab:blue", "tab:orange"), strict=True):
            chosen = curves[(curves["stage"] == stage) & (curves["learner"] == learner)]
            by_steps = chosen.groupby("steps")["mean_payoff"].agg(["mean", "min", "max"])
            axis.plot(by_steps.index, by_steps["mean"], color=colour, label=learner)
            axis.fill_between(by_steps.index, by_steps["min"], by_steps["max"], color=colour, alpha=0.2, linewidth=0)
        axis.set(title=stage, xlabel="training steps", ylabel="mean payoff of a game")
        axis.ticklabel_format(axis="x", scilimits=(0, 0))
    axes[-1].legend()
    figure.savefig(file.with_suffix(".png"), dpi=120, metadata={"Software": None})


def at_end(curves: pd.DataFrame) -> pd.DataFrame:
    """The mean payoff over the last windows of each learning curve."""
    last = curves.groupby(["learner", "stage", "seed"], sort=False).tail(LATEST)
    return last.groupby(["learner", "stage", "seed"], sort=False, as_index=False)["mean_payoff"].mean()


if __name__ == "__main__":
    app()
