"""The learning curves of a campaign's trainings."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd
from markupsafe import Markup

from harness.reports.figures import Curve, learning_figure


_OF_NON_EGO, _OF_EGO = re.compile(r"_non_ego_response\d+$"), re.compile(r"_ego_response\d+$")


@dataclass(frozen=True)
class Learning:
    """One training stage's curves."""

    stage: str
    figure: Markup
    stops: Sequence[str]


def learning(stages: Mapping[str, Any], training: pd.DataFrame) -> list[Learning]:
    """A figure per training stage, in order of first appearance, with a curve per seed."""
    figures = []
    for place, stage in enumerate(training["stage"].unique(), 1):
        curves, stops = [], []
        rows = training[training["stage"] == stage]
        for seed, windows in rows.groupby("seed", sort=True):
            of_manifest = stages.get(f"{stage}-seed{seed}", {})
            windows = windows.sort_values("steps")
            curves.append(
                Curve(
                    int(seed),
                    windows["steps"].tolist(),
                    windows["mean_payoff"].tolist(),
                    windows["failure_rate"].tolist(),
                    of_manifest.get("steps"),
                    of_manifest.get("stopped") == "converged",
                )
            )
            if of_manifest.get("steps") is not None:
                stop = f"{of_manifest['steps']:,} steps ({stopped(of_manifest)})"
                stops.append(f"seed {seed}: {stop}" if rows["seed"].nunique() > 1 else stop)
        series = _series(str(stage))
        last = [f"seed {curve.seed} ends at mean payoff {curve.payoffs[-1]:.3g}" for curve in curves]
        alternative = f"Learning curve of {stage}: mean payoff and failure rate over training steps; "
        figures.append(
            Learning(stage, learning_figure(curves, series, f"curve{place}", alternative + "; ".join(last)), stops)
        )
    return figures


def _series(stage: str) -> str:
    """Whose curve it is: the naive ego's, an ego's that learns again, or a person's."""
    if _OF_NON_EGO.search(stage):
        return "persona"
    if stage == "naive":
        return "alone"
    return "retrained" if stage.startswith(("retrained_", "robust")) or _OF_EGO.search(stage) else "persona"


def stopped(stage: Mapping[str, Any]) -> str:
    """Why a training stopped."""
    why = stage.get("stopped")
    return {"converged": "early: converged", "budget": "budget used", None: "–"}.get(why, str(why))
