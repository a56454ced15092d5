"""All game-theoretic findings of a campaign's games."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from harness.evaluation.comparisons.comparison import games_by_arm
from harness.evaluation.competence import gate
from harness.evaluation.game_theory.best_response_gap import Response, gaps
from harness.evaluation.game_theory.crossplay import Pairing, crossplay, generalisation
from harness.evaluation.game_theory.empirical_game import equilibria
from harness.evaluation.game_theory.held_out import with_held_out_rates


@dataclass(frozen=True, kw_only=True)
class GameFindings:
    """The four tables of findings, each a table of `columns.TABLES`; empty where the campaign does not ask for it."""

    gaps: pd.DataFrame
    crossplay: pd.DataFrame
    equilibria: pd.DataFrame
    generalisation: pd.DataFrame
    cautions: Sequence[tuple[int, str]] = ()
    """Seed and reason: the strategies of the cross-play that were not shown to drive the scene alone."""

    @property
    def tables(self) -> dict[str, pd.DataFrame]:
        return {name: table for name, table in vars(self).items() if name != "cautions"}


def find(
    pairings: Sequence[Pairing],
    responses: Sequence[Response],
    trained_against: Mapping[str, Collection[str]],
    episodes: pd.DataFrame,
    significance: float,
) -> GameFindings | None:
    """The findings of a run; None when it has neither best responses nor a cross-play.

    `trained_against` names for each retrained ego the personas it was trained against. Raises ValueError as the
    functions of the tables do.
    """
    if not pairings and not responses:
        return None
    cells = crossplay(pairings, episodes)
    return GameFindings(
        gaps=gaps(responses, episodes, significance),
        crossplay=cells,
        equilibria=with_held_out_rates(equilibria(cells), pairings, episodes),
        generalisation=generalisation(trained_against, pairings, episodes, significance),
        cautions=cautions(pairings, episodes),
    )


def cautions(pairings: Sequence[Pairing], episodes: pd.DataFrame) -> list[tuple[int, str]]:
    games = games_by_arm(episodes)
    bounds = dict.fromkeys((each.seed, bound) for each in pairings for bound in each.alone)
    reasons = [(seed, gate([bound], seed, games)["reason"]) for seed, bound in bounds]
    return [(seed, reason) for seed, reason in reasons if reason]
