"""The learning curves of every published training: a figure, and how the trainings ended.

python docs/learning/published.py draw           # docs/learning/published.png
python docs/learning/published.py table          # the table of docs/learning-curves.md
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import pandas as pd
import typer
from matplotlib.axes import Axes

from harness.campaign.plan.stages import TrainingStage
from harness.campaign.storage.manifest import planned
from harness.evaluation.competence import DID_NOT_LEARN
from harness.evaluation.strategies import NaiveEgo, Strategy, player_of, stage_id
from harness.evaluation.tables import read_csv
from harness.game.roles import EGO

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


def runs() -> Iterator[tuple[str, pd.DataFrame, dict[str, dict[str, Any]]]]:
    """Each published run with trainings of its own: its name, its learning curves with the kind of player and the share
    of the budget, and the entries of its trainings in the manifest."""
    for file in sorted(ROOT.glob("reports/*/training.csv*")):
        manifest = json.loads((file.parent / "manifest.json").read_text(encoding="utf-8"))
        players = {each.id: _player(each.strategy) for each in planned(manifest) if isinstance(each, TrainingStage)}
        own = {name: manifest["stages"][name] for name in players if manifest["stages"][name].get("steps") is not None}
        if own:
            curves = read_csv(file.with_name("training.csv"))
            training = pd.Series(map(stage_id, curves["stage"], curves["seed"]), index=curves.index)
            budget = training.map({name: entry["budget_steps"] for name, entry in own.items()})
            share = curves["steps"] / budget
            yield file.parent.name, curves.assign(training=training, player=training.map(players), share=share), own


def _player(strategy: Strategy) -> str:
    if isinstance(strategy, NaiveEgo):
        return NAIVE
    return LATER if player_of(strategy) == EGO else PEOPLE


def _curves(axis: Axes, curves: pd.DataFrame, colour: str) -> None:
    """Draw the curves of some trainings."""
    for _, one in curves.groupby("training", sort=False):
        axis.plot(one["share"], one["failure_rate"].rolling(WINDOWS, min_periods=1).mean(), color=colour, linewidth=0.8)
    axis.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
    axis.tick_params(labelsize=7)


if __name__ == "__main__":
    app()
