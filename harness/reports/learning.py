"""The learning curves of a campaign's trainings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd
from markupsafe import Markup

from harness.evaluation.competence import DID_NOT_LEARN
from harness.evaluation.strategies import NaiveEgo, Strategy, player_of
from harness.game.roles import EGO
from harness.reports.figures import Curve, learning_figure
from harness.reports.numbers import MISSING, percent
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
