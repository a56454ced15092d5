"""The section on the game: verdicts on best responses, small tables, heat maps and the solutions of the game."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from harness.evaluation.game_theory.records import GameFindings
from harness.evaluation.research_questions import Verdict
from harness.evaluation.tables import typed
from harness.reports.data_table import Table, table
from harness.reports.game_links import NO_LINKS, GameLinks
from harness.reports.game_wording import (
    CAPTIONS,
    equilibrium_sentences,
    fewer_failures,
    gap_verdicts,
)
from harness.reports.heatmaps import MatrixView, views
from harness.reports.numbers import MISSING, interval, percent
from harness.reports.verdict_wording import NOT_ANSWERED, Conclusion, as_sentence


@dataclass(frozen=True, kw_only=True)
class NewPersona:
    """An ego against a non-ego of a persona it was not trained against, over the seeds."""

    ego: str
    trained_against: str
    non_ego: str
    seeds: int
    rate: str
    naive_rate: str
    share: str
    difference: str
    significant: str


@dataclass(frozen=True, kw_only=True)
class GameSection:
    """The contents of the section on the game."""

    cautions: Sequence[tuple[int, str]]
    """Seed and sentence: which strategies were not shown to drive the scene."""
    verdicts: Sequence[tuple[str, Conclusion]]
    views: Sequence[MatrixView]
    solutions: Sequence[tuple[int, str, Sequence[str]]]
    """Of each seed and game, its solutions in sentences."""
    new_personas: Sequence[NewPersona]
    tables: dict[str, Table]


def game_section(findings: GameFindings | None, links: GameLinks = NO_LINKS) -> GameSection | None:
    """The section of a run's findings; None where it has none. `links` are the games that cells lead to."""
    if findings is None:
        return None
    frames = {name: typed(getattr(findings, name)) for name in CAPTIONS}
    gaps = frames["gaps"]
    return GameSection(
        cautions=[(seed, as_sentence(reason)) for seed, reason in findings.cautions],
        verdicts=gap_verdicts(gaps),
        views=views(frames["crossplay"], links),
        solutions=equilibrium_sentences(frames["equilibria"]),
        new_personas=_new_personas(frames["generalisation"]),
        tables={name: table(name, CAPTIONS[name], frame) for name, frame in frames.items()},
    )


def _new_personas(generalisation: pd.DataFrame) -> list[NewPersona]:
    return [
        _new_persona(str(ego), str(trained_against), str(non_ego), rows[rows["pairs"] > 0])
        for (ego, trained_against, non_ego), rows in generalisation.groupby(["ego", "met", "non_ego"], sort=False)
    ]


def _new_persona(ego: str, trained_against: str, non_ego: str, rows: pd.DataFrame) -> NewPersona:
    """One row of the table; `rows` are the seeds that were played."""
    significant = int((rows["verdict"] == Verdict.SIGNIFICANT.value).sum())
    answered = int((rows["reason"] == "").sum())
    rate, naive_rate = rows["failure_rate"].mean(), rows["naive_failure_rate"].mean()
    one_seed = rows.iloc[0] if len(rows) == 1 else None
    span = ""
    if one_seed is not None:
        span = f" ({interval(one_seed['failure_rate_low'], one_seed['failure_rate_high'])})"
    elif len(rows):
        span = f" ({interval(rows['failure_rate'].min(), rows['failure_rate'].max())})"
    ends = (math.nan, math.nan)
    if one_seed is not None:
        ends = one_seed["fewer_failures_low"], one_seed["fewer_failures_high"]
    return NewPersona(
        ego=ego,
        trained_against=trained_against,
        non_ego=non_ego,
        seeds=len(rows),
        rate=f"{percent(rate)}{span}",
        naive_rate=percent(naive_rate),
        share=percent(rate / naive_rate) if naive_rate else MISSING,
        difference=fewer_failures(rows["fewer_failures"].mean(), *ends),
        significant=f"{significant} of {answered}" if answered else NOT_ANSWERED,
    )
