"""Ranks of egos that played the same games: egos that can't be told apart share a rank."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pandas as pd

from harness.evaluation.comparisons.comparison import holm, mcnemar, rate_cells
from harness.evaluation.tables import table_of

GAME = ["games_sha256", "episode"]
"""What names a game that several egos play."""
PLAYER = ["ego", "shield"]
"""What names an ego: with a shield around it, it is another one than without."""


def league_ranks(games: pd.DataFrame, significance: float) -> pd.DataFrame:
    """A row for each ego, best first, the table `league_ranks`.

    `games` has the columns `GAME`, `PLAYER` and `ego_failed`. Only games count that every ego played. Each two egos are
    compared by McNemar's exact test of their failures, two-sided, with Holm's correction over all pairs. The rank of an
    ego is 1 and the number of egos that fail significantly less often: so egos of one rank may still differ, and no ego
    is before another by chance.

    Raises ValueError when an ego has two games of one name.
    """
    failed = games.pivot(index=GAME, columns=PLAYER, values="ego_failed").astype(float)
    common = failed.dropna()
    egos = list(common.columns)
    pairs = list(combinations(range(len(egos)), 2))
    values = common.to_numpy()
    p_values = np.array([mcnemar(values[:, a] - values[:, b], "two-sided") for a, b in pairs])
    better = np.zeros((len(egos), len(egos)), dtype=bool)
    for (a, b), p_holm in zip(pairs, holm(p_values) if pairs else [], strict=True):
        if p_holm < significance:
            a_fails_less = values[:, a].sum() < values[:, b].sum()
            better[(a, b) if a_fails_less else (b, a)] = True
    rows = [
        {"ego": ego, "shield": shield, "rank": 1 + int(better[:, place].sum()), "games": len(common)}
        | {"games_left_out": int(failed[ego, shield].notna().sum()) - len(common)}
        | rate_cells("failure_rate", values[:, place].sum(), len(common))
        | {"told_apart": " + ".join(with_shield(*egos[k]) for k in np.flatnonzero(better[:, place] | better[place]))}
        for place, (ego, shield) in enumerate(egos)
    ]
    ranked = sorted(rows, key=lambda row: (row["rank"], row["failure_rate"], row["ego"], row["shield"]))
    return table_of("league_ranks", ranked)


def with_shield(words: str, shield: str) -> str:
    """Words on an ego or its games, and the shield that it has in them; empty: none."""
    return f"{words} with shield {shield}" if shield else words
