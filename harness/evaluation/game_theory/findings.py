"""Everything the games of a campaign say of its equilibria, in one go."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import pandas as pd

from harness.evaluation.game_theory.best_response_gap import gaps
from harness.evaluation.game_theory.crossplay import crossplay
from harness.evaluation.game_theory.empirical_game import equilibria
from harness.evaluation.game_theory.generalisation import generalisation
from harness.evaluation.game_theory.records import GameFindings, Pairing, Response


def find(
    pairings: Sequence[Pairing],
    responses: Sequence[Response],
    met: Mapping[str, Collection[str]],
    episodes: pd.DataFrame,
    significance: float,
) -> GameFindings | None:
    """The findings of a run; None when it has neither best responses nor a cross-play.

    `met` names for each retrained ego the personas it was trained against. Raises ValueError as the tables do.
    """
    if not pairings and not responses:
        return None
    found = crossplay(pairings, episodes)
    return GameFindings(
        gaps(responses, episodes, significance),
        found,
        equilibria(found),
        generalisation(met, pairings, episodes, significance),
    )
