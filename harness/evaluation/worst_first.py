"""The order of games from the worst on, for every list and card; the games that become replays, and their names."""

from __future__ import annotations

import numpy as np
import pandas as pd

from harness.evaluation.people import judged_outcomes
from harness.evaluation.strategies import stage_id
from harness.game.outcome import Outcome

FAILURES = (Outcome.COLLISION.word, Outcome.RAIL.word, Outcome.TIMEOUT.word)
"""The outcomes that are failures, from the worst on."""
MOST_FAILURES_PER_ARM = 100  # and training seed: a replay folder contains a copy of the scene
SAMPLE_PER_ARM = 2  # games without a failure, per arm and training seed, for comparison


def worst_first(episodes: pd.DataFrame) -> pd.DataFrame:
    """All rows of `episodes`, from the greatest severity on; then by the ego's least time to collision, arm, seed and
    episode.

    Collisions come first, then rail contacts, timeouts, games without a failure, games that could not be played.
    """
    severity = episodes["severity"].fillna(0.0).mask(judged_outcomes(episodes) == Outcome.ERROR.word, -np.inf)
    order = episodes.assign(_severity=-severity, _ttc=pd.to_numeric(episodes["ego_min_ttc_s"]))
    order = order.sort_values(["_severity", "_ttc", "arm", "seed", "episode"], na_position="last", kind="stable")
    return episodes.loc[order.index]


def replay_name(arm: str, seed: int, episode: int) -> str:
    """The folder's name under `replays/`."""
    return f"{stage_id(arm, seed)}-{episode:03d}"


def choose_games(episodes: pd.DataFrame) -> pd.DataFrame:
    """The rows of `episodes` that become replays: of each arm and seed the failed games, at most the worst
    `MOST_FAILURES_PER_ARM`, and `SAMPLE_PER_ARM` games without a failure.

    The judged player is the ego, or the non-ego where it drives alone. The games without a failure are those with the
    lowest episode numbers. A game that could not be played has no trace and is left out. Rows keep their order and
    index.
    """
    outcomes = judged_outcomes(episodes)
    failures = outcomes.isin(FAILURES)
    worst = worst_first(episodes[failures]).groupby(["arm", "seed"], sort=False).head(MOST_FAILURES_PER_ARM)
    failed = episodes.index.isin(worst.index)
    others = episodes[~failures & (outcomes != Outcome.ERROR.word)].sort_values(["arm", "seed", "episode"])
    sample = others.groupby(["arm", "seed"], sort=False).head(SAMPLE_PER_ARM).index
    return episodes[failed | episodes.index.isin(sample)]
