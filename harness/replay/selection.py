"""The choice of games that become replays, the names of replays, and the order from the worst game on."""

from __future__ import annotations

import pandas as pd

from harness.evaluation.people import judged_outcomes

MOST_FAILURES_PER_ARM = 100  # and training seed: a replay folder contains a copy of the scene
SAMPLE_PER_ARM = 2  # games without a failure, per arm and training seed, for comparison
_FAILURES = ("collision", "rail", "timeout")  # worst first
_NO_FAILURE, _UNPLAYED = len(_FAILURES), len(_FAILURES) + 1


def replay_name(arm: str, seed: int, episode: int) -> str:
    """The folder's name under `replays/`."""
    return f"{arm}-seed{seed}-{episode:03d}"


def choose_games(episodes: pd.DataFrame) -> pd.DataFrame:
    """The rows of `episodes` that become replays: of each arm and seed the failed games, at most the worst
    `MOST_FAILURES_PER_ARM`, and `SAMPLE_PER_ARM` games without a failure.

    The judged player is the ego, or the non-ego where it drives alone. The games without a failure are those with the
    lowest episode numbers. A game that could not be played has no trace and is left out. Rows keep their order and
    index.
    """
    severity = _severity(episodes)
    worst = (
        worst_first(episodes[severity < _NO_FAILURE]).groupby(["arm", "seed"], sort=False).head(MOST_FAILURES_PER_ARM)
    )
    failed = episodes.index.isin(worst.index)
    without_failure = episodes[severity == _NO_FAILURE].sort_values(["arm", "seed", "episode"], kind="stable")
    sample = without_failure.groupby(["arm", "seed"], sort=False).head(SAMPLE_PER_ARM).index
    return episodes[failed | episodes.index.isin(sample)]


def worst_first(episodes: pd.DataFrame) -> pd.DataFrame:
    """All rows of `episodes`, from the worst on.

    Collisions, then rail contacts, timeouts, games without a failure, games that could not be played; within
    each by the ego's smallest time to collision (not measured: last), then by arm, seed and episode.
    """
    order = episodes.assign(_severity=_severity(episodes), _ttc=pd.to_numeric(episodes["ego_min_ttc_s"]))
    order = order.sort_values(["_severity", "_ttc", "arm", "seed", "episode"], na_position="last", kind="stable")
    return episodes.loc[order.index]


def _severity(episodes: pd.DataFrame) -> pd.Series:
    """Rank of each game's outcome for the judged player: 0 is a collision."""
    ranks = {name: rank for rank, name in enumerate(_FAILURES)} | {"error": _UNPLAYED}
    return judged_outcomes(episodes).map(lambda name: ranks.get(name, _NO_FAILURE))
