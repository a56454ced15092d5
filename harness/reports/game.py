"""The section on the game: verdicts on best responses, small tables, heat maps and the solutions of the game."""

from __future__ import annotations

import math
from typing import Any

import pandas as pd

from harness.evaluation.competence import Verdict
from harness.evaluation.game_theory.findings import GameFindings
from harness.reports.data_table import table
from harness.reports.game_links import GameLinks
from harness.reports.game_wording import equilibrium_sentences, fewer_failures, gap_verdicts
from harness.reports.heatmaps import views
from harness.reports.numbers import MISSING, interval, percent
from harness.reports.verdict_wording import NOT_ANSWERED, as_sentence

CAPTIONS = {
    "gaps": "A row per best response.",
    "crossplay": "A row per pairing of an ego and a non-ego.",
    "equilibria": "A row per strategy of each solution of each game.",
    "generalisation": "A row per retrained ego and non-ego of a persona it was not trained against.",
}


def game_section(findings: GameFindings | None, links: GameLinks) -> dict[str, Any] | None:
    """What the template shows of a run's findings; None where it has none. `links` are the games that cells lead to.

    `cautions` are seed and sentence: which strategies were not shown to drive the scene.
    """
    if findings is None:
        return None
    return {
        "cautions": [(seed, as_sentence(reason)) for seed, reason in findings.cautions],
        "verdicts": gap_verdicts(findings.gaps),
        "views": views(findings.crossplay, links),
        "solutions": equilibrium_sentences(findings.equilibria),
        "new_personas": [
            {"ego": ego, "trained_against": met, "non_ego": non_ego, **_new_persona(rows[rows["pairs"] > 0])}
            for (ego, met, non_ego), rows in findings.generalisation.groupby(["ego", "met", "non_ego"], sort=False)
        ],
        "tables": {name: table(name, CAPTIONS[name], frame) for name, frame in findings.tables.items()},
    }


def _new_persona(rows: pd.DataFrame) -> dict[str, str]:
    """How an ego fares against a non-ego of a persona it was not trained against; `rows` are the seeds that were
    played."""
    significant = int((rows["verdict"] == Verdict.SIGNIFICANT.value).sum())
    answered = int((rows["reason"] == "").sum())
    rate, naive_rate = rows["failure_rate"].mean(), rows["naive_failure_rate"].mean()
    span, ends = "", (math.nan, math.nan)
    if len(rows) == 1:
        seed = rows.iloc[0]
        span = f" ({interval(seed['failure_rate_low'], seed['failure_rate_high'])})"
        ends = seed["fewer_failures_low"], seed["fewer_failures_high"]
    elif len(rows):
        span = f" ({interval(rows['failure_rate'].min(), rows['failure_rate'].max())})"
    return {
        "rate": f"{percent(rate)}{span}",
        "naive_rate": percent(naive_rate),
        "share": percent(rate / naive_rate) if naive_rate else MISSING,
        "difference": fewer_failures(rows["fewer_failures"].mean(), *ends),
        "significant": f"{significant} of {answered}" if answered else NOT_ANSWERED,
    }
