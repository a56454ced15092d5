"""All game-theoretic findings of a campaign's games."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import pandas as pd

from harness.evaluation.comparisons.comparison import games_by_arm
from harness.evaluation.competence import gate
from harness.evaluation.game_theory.best_response_gap import gaps
from harness.evaluation.game_theory.crossplay import crossplay
from harness.evaluation.game_theory.empirical_game import equilibria
from harness.evaluation.game_theory.generalisation import generalisation
from harness.evaluation.game_theory.records import GameFindings, Pairing, Response


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
        equilibria=equilibria(cells),
        generalisation=generalisation(trained_against, pairings, episodes, significance),
        cautions=_cautions(pairings, episodes),
    )


def _cautions(pairings: Sequence[Pairing], episodes: pd.DataFrame) -> list[tuple[int, str]]:
    """Seed and reason of each strategy of the cross-play that misses its bound alone."""
    games = games_by_arm(episodes)
    bounds = dict.fromkeys((each.seed, bound) for each in pairings for bound in each.alone)
    closed = [(seed, gate([bound], seed, games)) for seed, bound in bounds]
    return [(seed, each.reason) for seed, each in closed if each is not None]
