"""The searches of a campaign: the best payoff over their trials, and parameters as given and as found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd
from markupsafe import Markup

from harness.reports.figures import INK, SERIES, figure_of, svg
from harness.reports.numbers import short
from harness.reports.page_wording import search_alternative, search_summary


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One parameter of the ego: its given value, its found value, and the bounds of the search."""

    name: str
    given: str
    found: str
    low: str
    high: str


@dataclass(frozen=True, kw_only=True)
class Search:
    """One search, in words and numbers."""

    stage: str
    """With its seed when there are several."""
    figure: Markup
    summary: str
    parameters: Sequence[Parameter]
    document: str
    """The path of the driver that it found, from the run folder."""


def searches(reconfiguration: pd.DataFrame) -> list[Search]:
    """Each search of `reconfiguration`, the table, in order of first appearance."""
    several = reconfiguration["seed"].nunique() > 1
    return [
        _search(f"{stage}-seed{seed}", f"{stage}, seed {seed}" if several else str(stage), rows, place)
        for place, ((stage, seed), rows) in enumerate(reconfiguration.groupby(["stage", "seed"], sort=False), 1)
    ]


def _search(stage_id: str, title: str, rows: pd.DataFrame, place: int) -> Search:
    trials = rows.drop_duplicates("trial").sort_values("trial")
    given, chosen = rows[rows["trial"] == 0], rows[rows["chosen"]]
    summary = search_summary(
        trials=len(trials),
        first=given.iloc[0],
        best=chosen.iloc[0],
        unplayed=int(trials["mean_payoff"].isna().sum()),
        errors=trials.loc[trials["error"] != "", "error"].unique()[:3],
    )
    both = given.merge(chosen[["parameter", "value"]], on="parameter", suffixes=("", "_found"))
    return Search(
        stage=title,
        figure=_figure(trials, f"search{place}", search_alternative(title, summary)),
        summary=summary,
        parameters=[
            Parameter(
                name=row.parameter,
                given=short(row.value),
                found=short(row.value_found),
                low=short(row.low),
                high=short(row.high),
            )
            for row in both.itertuples()
        ],
        document=f"policies/{stage_id}/driver.toml",
    )


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
        axes.yaxis.set_major_formatter(lambda value, _: short(value))
        axes.locator_params(axis="x", integer=True)
        return svg(figure, name, alternative)
