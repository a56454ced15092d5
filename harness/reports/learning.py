"""How players came to be: the learning curves of trainings, and the searches of egos that can't be trained."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd
from markupsafe import Markup

from harness.evaluation.competence import DID_NOT_LEARN
from harness.evaluation.strategies import NaiveEgo, Strategy, player_of
from harness.game.roles import EGO
from harness.reports.differences import Row
from harness.reports.figures import INK, SERIES, Curve, figure_of, learning_figure, svg
from harness.reports.numbers import MISSING, number, percent, short, trimmed
from harness.reports.run_tables import RunTables


@dataclass(frozen=True, kw_only=True)
class Learning:
    """One training stage's curves."""

    stage: str
    figure: Markup
    stops: Sequence[str]


def learning(tables: RunTables) -> list[Learning]:
    """A figure per training stage, in order of first appearance, with a curve per seed."""
    training = tables.training
    return [
        _stage(str(stage), place, tables, training[training["stage"] == stage])
        for place, stage in enumerate(training["stage"].unique(), 1)
    ]


def _stage(stage: str, place: int, tables: RunTables, rows: pd.DataFrame) -> Learning:
    curves, stops = [], []
    several = rows["seed"].nunique() > 1
    for seed, windows in rows.groupby("seed", sort=True):
        entry = tables.stages.get(f"{stage}-seed{seed}", {})
        windows = windows.sort_values("steps")
        curves.append(
            Curve(
                seed=int(seed),
                steps=windows["steps"].tolist(),
                payoffs=windows["mean_payoff"].tolist(),
                failure_rates=windows["failure_rate"].tolist(),
                stopped_at=entry.get("steps"),
                stopped=str(entry.get("stopped") or ""),
            )
        )
        if entry.get("steps") is not None:
            text = f"{entry['steps']:,} steps ({stopped(entry)})"
            stops.append(f"seed {seed}: {text}" if several else text)
    ends = "; ".join(f"seed {curve.seed} ends at mean payoff {curve.payoffs[-1]:.3g}" for curve in curves)
    alternative = f"Learning curve of {stage}: mean payoff and failure rate over training steps; {ends}"
    figure = learning_figure(curves, _series(tables.strategies.get(stage)), f"curve{place}", alternative)
    return Learning(stage=stage, figure=figure, stops=stops)


def stopped(stage: Mapping[str, Any]) -> str:
    """Why a training stopped."""
    reason = stage.get("stopped")
    text = {"converged": "early: converged", "budget": "budget used", None: MISSING}.get(reason, str(reason))
    if reason == DID_NOT_LEARN and stage.get("played"):
        asked = f"at least {percent(stage['goal_share_asked'])}"
        text += f": goal in {stage['goals']} of {stage['played']} games alone, {asked} asked"
    return text


def _series(strategy: Strategy | None) -> str:
    """The colour of a curve: of the naive ego, of an ego of a later round, or of a non-ego."""
    match strategy:
        case NaiveEgo():
            return "alone"
        case None:
            return "persona"
        case _:
            return "retrained" if player_of(strategy) == EGO else "persona"


@dataclass(frozen=True, kw_only=True)
class SearchSection:
    """One search, in words and numbers."""

    stage: str
    """With its seed when there are several."""
    figure: Markup
    summary: str
    parameters: Sequence[Mapping[Hashable, Any]]
    """Name (`parameter`), given `value`, `value_found`, and the bounds `low` and `high` of the search."""
    document: str
    """The path of the driver that it found, from the run folder."""


def searches(reconfiguration: pd.DataFrame) -> list[SearchSection]:
    """Each search of `reconfiguration`, the table, in order of first appearance."""
    several = reconfiguration["seed"].nunique() > 1
    return [
        _search(f"{stage}-seed{seed}", f"{stage}, seed {seed}" if several else str(stage), rows, place)
        for place, ((stage, seed), rows) in enumerate(reconfiguration.groupby(["stage", "seed"], sort=False), 1)
    ]


def _search(stage_id: str, title: str, rows: pd.DataFrame, place: int) -> SearchSection:
    trials = rows.drop_duplicates("trial").sort_values("trial")
    given, chosen = rows[rows["trial"] == 0], rows[rows["chosen"]]
    summary = _summary(trials, given.iloc[0], chosen.iloc[0])
    both = given.merge(chosen[["parameter", "value"]], on="parameter", suffixes=("", "_found"))
    return SearchSection(
        stage=title,
        figure=_figure(
            trials, f"search{place}", f"Mean payoff of each trial of {title}, and the best so far. {summary}"
        ),
        summary=summary,
        parameters=both.to_dict("records"),
        document=f"policies/{stage_id}/driver.toml",
    )


def _summary(trials: pd.DataFrame, first: Row, best: Row) -> str:
    """What a search found, of its first and its best trial."""
    text = f"{len(trials)} trials; the best is trial {best['trial']}: {_trial(best)}. As given: {_trial(first)}."
    if best["trial"] == first["trial"]:
        text = f"{len(trials)} trials, none better than the ego as given: {_trial(first)}."
    unplayed = int(trials["mean_payoff"].isna().sum())
    errors = "; ".join(trials.loc[trials["error"] != "", "error"].unique()[:3])
    return text + (f" {unplayed} could not be played: {errors}" if unplayed else "")


def _trial(trial: Row) -> str:
    return f"mean payoff {number(trial['mean_payoff'], 2)}, failures in {trimmed(trial['failure_rate'] * 100, 1)} %"


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
