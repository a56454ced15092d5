"""The learning curves of a campaign's trainings."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd
from markupsafe import Markup

from harness.reports.figures import Curve, learning_figure
from harness.reports.page_wording import curve_alternative, stop

_OF_NON_EGO, _OF_EGO = re.compile(r"_non_ego_response\d+$"), re.compile(r"_ego_response\d+$")


@dataclass(frozen=True, kw_only=True)
class Learning:
    """One training stage's curves."""

    stage: str
    figure: Markup
    stops: Sequence[str]


def learning(stages: Mapping[str, Any], training: pd.DataFrame) -> list[Learning]:
    """A figure per training stage, in order of first appearance, with a curve per seed."""
    return [
        _stage(str(stage), place, stages, training[training["stage"] == stage])
        for place, stage in enumerate(training["stage"].unique(), 1)
    ]


def _stage(stage: str, place: int, stages: Mapping[str, Any], rows: pd.DataFrame) -> Learning:
    curves, stops = [], []
    several = rows["seed"].nunique() > 1
    for seed, windows in rows.groupby("seed", sort=True):
        entry = stages.get(f"{stage}-seed{seed}", {})
        windows = windows.sort_values("steps")
        curves.append(
            Curve(
                seed=int(seed),
                steps=windows["steps"].tolist(),
                payoffs=windows["mean_payoff"].tolist(),
                failure_rates=windows["failure_rate"].tolist(),
                stopped_at=entry.get("steps"),
                stopped_early=entry.get("stopped") == "converged",
            )
        )
        if entry.get("steps") is not None:
            stops.append(stop(entry, int(seed), several))
    alternative = curve_alternative(stage, {curve.seed: curve.payoffs[-1] for curve in curves})
    figure = learning_figure(curves, _series(stage), f"curve{place}", alternative)
    return Learning(stage=stage, figure=figure, stops=stops)


def _series(stage: str) -> str:
    """The colour of a curve: of the naive ego, of an ego of a later round, or of a persona."""
    if _OF_NON_EGO.search(stage):
        return "persona"
    if stage == "naive":
        return "alone"
    return "retrained" if stage.startswith(("retrained_", "robust")) or _OF_EGO.search(stage) else "persona"
