"""What the searches of a campaign found: the best payoff over their trials, and parameters as given and as found."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd
from markupsafe import Markup

from harness.reports.figures import INK, SERIES, figure_of, svg
from harness.reports.wording import MINUS, number, trimmed


@dataclass(frozen=True)
class Parameter:
    """One parameter of the ego: as it was given, as it was found, and between what it was searched."""

    name: str
    given: str
    found: str
    low: str
    high: str


@dataclass(frozen=True)
class Found:
    """One search, in words and numbers."""

    stage: str
    """With its seed when there are several."""
    figure: Markup
    summary: str
    parameters: Sequence[Parameter]
    document: str
    """Where the driver is that it found, from the run folder."""


def searches(reconfiguration: pd.DataFrame) -> list[Found]:
    """Each search of `reconfiguration`, the table, in order of first appearance."""
    several = reconfiguration["seed"].nunique() > 1
    return [
        _found(f"{stage}-seed{seed}", f"{stage}, seed {seed}" if several else str(stage), rows, place)
        for place, ((stage, seed), rows) in enumerate(reconfiguration.groupby(["stage", "seed"], sort=False), 1)
    ]


def _found(folder: str, title: str, rows: pd.DataFrame, place: int) -> Found:
    trials = rows.drop_duplicates("trial").sort_values("trial")
    given, chosen = rows[rows["trial"] == 0], rows[rows["chosen"]]
    first, best = given.iloc[0], chosen.iloc[0]
    summary = f"{len(trials)} trials; best in trial {best['trial']}: {_came(best)}. As given: {_came(first)}."
    if best["trial"] == first["trial"]:
        summary = f"{len(trials)} trials, none better than the ego as given: {_came(first)}."
    if unplayed := int(trials["mean_payoff"].isna().sum()):
        summary += f" {unplayed} could not be played: {'; '.join(trials.loc[trials['error'] != '', 'error'].unique()[:3])}"
    both = given.merge(chosen[["parameter", "value"]], on="parameter", suffixes=("", "_found"))
    parameters = [
        Parameter(row.parameter, *map(_number, (row.value, row.value_found, row.low, row.high)))
        for row in both.itertuples()
    ]
    drawn = _figure(trials, f"search{place}", f"Mean payoff of each trial of {title}, and the best so far. {summary}")
    return Found(title, drawn, summary, parameters, f"policies/{folder}/driver.toml")


def _came(trial: Any) -> str:
    return f"mean payoff {number(trial['mean_payoff'], 2)}, failures in {trimmed(trial['failure_rate'] * 100, 1)} %"


def _number(value: float) -> str:
    return f"{value:.4g}".replace("-", MINUS) if math.isfinite(value) else "–"


def _figure(trials: pd.DataFrame, name: str, alternative: str) -> Markup:
    """The mean payoff of every trial as a dot, and the best so far as a line."""
    with figure_of(3.7, 3.0) as figure:
        axes = figure.subplots()
        colour = SERIES["retrained"]
        axes.plot(trials["trial"], trials["mean_payoff"], "o", color=colour, markersize=3.5, alpha=0.5)
        axes.step(trials["trial"], trials["best_payoff"], where="post", color=colour, linewidth=1.8)
        axes.axhline(trials["mean_payoff"].iloc[0], color=INK, linewidth=0.8, linestyle=":")
        axes.annotate(
            "as given", (1, trials["mean_payoff"].iloc[0]), (0, -4), xycoords=("axes fraction", "data"),
            textcoords="offset points", ha="right", va="top", fontsize=9,
        )  # fmt: skip
        axes.set_xlabel("trial")
        axes.set_ylabel("mean payoff of the ego")
        axes.yaxis.set_major_formatter(lambda value, _: f"{value:.4g}".replace("-", MINUS))
        axes.locator_params(axis="x", integer=True)
        return svg(figure, name, alternative)
