"""Which games become a replay, what a replay is called, and in which order they are worth watching."""

from __future__ import annotations

import pandas as pd

MOST_FAILURES_PER_ARM = 100  # and training seed: a replay is a folder with a copy of the scene in it
SAMPLE_PER_ARM = 2  # games that went well, per arm and training seed: what normal looks like
_FAILURES = ("collision", "rail", "timeout")  # worst first
_WELL, _UNPLAYED = len(_FAILURES), len(_FAILURES) + 1


def replay_name(arm: str, seed: int, episode: int) -> str:
    """The folder's name under `replays/`."""
    return f"{arm}-seed{seed}-{episode:03d}"


def choose_games(episodes: pd.DataFrame) -> pd.DataFrame:
    """The rows of `episodes` that become replays: of each arm and seed the failed games, the worst
    `MOST_FAILURES_PER_ARM` of them if there are more, and a few others.

    Who is judged is the ego, or the non-ego where it drives alone. The others are those of the lowest episode
    numbers. A game that could not be played has no trace and is left out. Rows keep their order and index.
    """
    severity = _severity(episodes)
    worst = worst_first(episodes[severity < _WELL]).groupby(["arm", "seed"], sort=False).head(MOST_FAILURES_PER_ARM)
    failed = episodes.index.isin(worst.index)
    well = episodes[severity == _WELL].sort_values(["arm", "seed", "episode"], kind="stable")
    sample = well.groupby(["arm", "seed"], sort=False).head(SAMPLE_PER_ARM).index
    return episodes[failed | episodes.index.isin(sample)]


def worst_first(episodes: pd.DataFrame) -> pd.DataFrame:
    """All rows of `episodes`, the ones to watch first on top.

    Collisions, then rail contacts, timeouts, games that went well, games that could not be played; within
    each by the ego's smallest time to collision (not measured: last), then by arm, seed and episode.
    """
    order = episodes.assign(_severity=_severity(episodes), _ttc=pd.to_numeric(episodes["ego_min_ttc_s"]))
    order = order.sort_values(["_severity", "_ttc", "arm", "seed", "episode"], na_position="last", kind="stable")
    return episodes.loc[order.index]


def _severity(episodes: pd.DataFrame) -> pd.Series:
    """Rank of each game's outcome for the player that is judged: 0 is a collision."""
    ego = episodes["ego_outcome"].fillna("")
    outcome = ego.where(ego != "", episodes["non_ego_outcome"].fillna(""))
    ranks = {name: rank for rank, name in enumerate(_FAILURES)} | {"error": _UNPLAYED}
    return outcome.map(lambda name: ranks.get(name, _WELL))
