"""The order of games from the worst on, for every list, card and choice of replays."""

from __future__ import annotations

import numpy as np
import pandas as pd

from harness.evaluation.people import judged_outcomes
from harness.game.outcome import Outcome

FAILURES = (Outcome.COLLISION.word, Outcome.RAIL.word, Outcome.TIMEOUT.word)
"""The outcomes that are failures, from the worst on."""


def worst_first(episodes: pd.DataFrame) -> pd.DataFrame:
    """All rows of `episodes`, from the greatest severity on; then by the ego's least time to collision, arm, seed and
    episode.

    Collisions come first, then rail contacts, timeouts, games without a failure, games that could not be played.
    """
    severity = episodes["severity"].fillna(0.0).mask(judged_outcomes(episodes) == Outcome.ERROR.word, -np.inf)
    order = episodes.assign(_severity=-severity, _ttc=pd.to_numeric(episodes["ego_min_ttc_s"]))
    order = order.sort_values(["_severity", "_ttc", "arm", "seed", "episode"], na_position="last", kind="stable")
    return episodes.loc[order.index]
