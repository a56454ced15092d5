"""The order of games from the worst on, for every list, card and choice of replays."""

from __future__ import annotations

import numpy as np
import pandas as pd

from harness.evaluation.people import judged_outcomes
from harness.evaluation.severity.limits import CONFLICT_TTC_S
from harness.evaluation.severity.measures import CONTACT, RAIL, TIMEOUT, closeness
from harness.game.outcome import Outcome

FAILURES = (Outcome.COLLISION.word, Outcome.RAIL.word, Outcome.TIMEOUT.word)
"""The outcomes that are failures, from the worst on."""
_BASE = dict(zip(FAILURES, (CONTACT, RAIL, TIMEOUT), strict=True))


def worst_first(episodes: pd.DataFrame) -> pd.DataFrame:
    """All rows of `episodes`, from the greatest severity on; then by the ego's least time to collision, arm, seed and
    episode.

    Collisions come first, then rail contacts, timeouts, games without a failure, games that could not be played.
    """
    order = episodes.assign(_severity=-severities(episodes), _ttc=pd.to_numeric(episodes["ego_min_ttc_s"]))
    order = order.sort_values(["_severity", "_ttc", "arm", "seed", "episode"], na_position="last", kind="stable")
    return episodes.loc[order.index]


def severities(episodes: pd.DataFrame) -> pd.Series:
    """The severity of each game; -inf if it could not be played.

    Where a table of an earlier version has none, it is estimated from the outcome and the ego's least time to
    collision.
    """
    outcomes = judged_outcomes(episodes)
    ttc = pd.to_numeric(episodes["ego_min_ttc_s"]).fillna(np.inf)
    estimated = outcomes.map(lambda name: _BASE.get(name, 0.0)) + np.where(
        outcomes.isin(FAILURES[:2]), 0.0, closeness(ttc / CONFLICT_TTC_S)
    )
    known = episodes["severity"] if "severity" in episodes else pd.Series(np.nan, index=episodes.index)
    return known.fillna(estimated).mask(outcomes == Outcome.ERROR.word, -np.inf)
