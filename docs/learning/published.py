"""The learning curves of every published training: a figure, and how the trainings ended.

python docs/learning/published.py draw           # docs/learning/published.png
python docs/learning/published.py table          # the table of docs/learning-curves.md
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import matplotlib.pyplot as plt
import pandas as pd
import typer
from matplotlib.axes import Axes

from harness.evaluation.competence import DID_NOT_LEARN
from harness.evaluation.tables import read_csv

ROOT = Path(__file__).parents[2]
FIGURE = ROOT / "docs" / "learning" / "published.png"
NAIVE, PEOPLE, LATER = "naive ego", "people", "egos of later rounds"
COLOURS = {NAIVE: "tab:blue", PEOPLE: "tab:orange", LATER: "tab:green"}
WINDOWS = 8
"""Windows of a curve of which the figure shows the mean."""

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, help=__doc__)


@app.command()
def draw() -> None:
    """Draw the failure rate of every training over its steps: a row for each run, a column for each kind of player."""
    published = list(runs())
    size = (9, 1.15 * len(published))
    shape = (len(published), len(COLOURS))
    figure, axes = plt.subplots(*shape, figsize=size, sharex=True, sharey=True, constrained_layout=True)
    for (name, curves, _), row in zip(published, axes, strict=True):
        for axis, (player, colour) in zip(row, COLOURS.items(), strict=True):
            _curves(axis, curves[curves["player"] == player], colour)
        row[0].set_ylabel(name, rotation=0, ha="right", va="center", fontsize=8)
    for axis, player in zip(axes[0], COLOURS, strict=True):
        axis.set_title(f"{player}: games failed", fontsize=9)
    for axis in axes[-1]:
        axis.set_xlabel("share of the budget", fontsize=8)
    figure.savefig(FIGURE, dpi=80, metadata={"Software": None})


@app.command()
def table() -> None:
    """Print how the trainings of each run ended, as a Markdown table."""
    header = ("run", "trainings", "converged", "budget used", "did not learn")
    print("| " + " | ".join(header) + " |\n| --- | ---: | ---: | ---: | --- |")
    for name, _, trainings in runs():
        ends = pd.Series([each["stopped"] for each in trainings.values()]).value_counts()
        failed = [f"`{training}`" for training, each in trainings.items() if each["stopped"] == DID_NOT_LEARN]
        counts = (len(trainings), ends.get("converged", 0), ends.get("budget", 0))
        print(f"| `{name}` | " + " | ".join(map(str, counts)) + f" | {', '.join(failed) or 'none'} |")


def runs() -> Iterator[tuple[str, pd.DataFrame, dict[str, dict[str, object]]]]:
    """Each published run with trainings of its own: its name, its learning curves with the kind of player, and the
    entries of its trainings in the manifest."""
    for file in sorted(ROOT.glob("reports/*/training.csv*")):
        stages = json.loads((file.parent / "manifest.json").read_text(encoding="utf-8"))["stages"]
        trainings = {name: entry for name, entry in stages.items() if entry["kind"] == "training"}
        own = {name: entry for name, entry in trainings.items() if entry.get("steps") is not None}
        if own:
            curves = read_csv(file.with_name("training.csv"))
            yield file.parent.name, curves.assign(player=curves["stage"].map(_player)), own


def _player(stage: str) -> str:
    """The kind of player of a training. A best response is one of the player that its name says."""
    if stage == "naive":
        return NAIVE
    of_ego = stage.startswith(("retrained", "robust")) and "non_ego_response" not in stage
    return LATER if of_ego else PEOPLE


def _curves(axis: Axes, curves: pd.DataFrame, colour: str) -> None:
    """Draw the curves of some trainings, each over the share of the longest one of its stage."""
    longest = curves.groupby("stage")["steps"].transform("max")
    for _, one in curves.assign(share=curves["steps"] / longest).groupby(["stage", "seed"], sort=False):
        axis.plot(one["share"], one["failure_rate"].rolling(WINDOWS, min_periods=1).mean(), color=colour, linewidth=0.8)
    axis.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
    axis.tick_params(labelsize=7)


if __name__ == "__main__":
    app()
