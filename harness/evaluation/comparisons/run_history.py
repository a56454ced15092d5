"""Runs in their order: how often the egos fail in each, and which games change from one run to the next."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Literal

import pandas as pd

from harness.evaluation.comparisons.comparison import rate_cells

_GAME = ["arm", "seed", "episode"]
GameChange = Literal["fixed", "new", "came back"]
"""A game is fixed if the ego fails in the run before and not in this one. A failure that is not in the run before came
back if it is in an earlier run, and is new otherwise."""


@dataclass(frozen=True, kw_only=True)
class ChangedGame:
    """A game that ends in a failure in one of two runs and not in the other."""

    change: GameChange
    arm: str
    seed: int
    episode: int


@dataclass(frozen=True, kw_only=True)
class FailureRate:
    """How often the ego of a run fails in an arm, for one training seed, with the Clopper-Pearson interval."""

    failures: int
    games: int
    low: float
    high: float


def failure_rates(episodes: pd.DataFrame) -> dict[tuple[str, int], FailureRate]:
    """The rates of a run by arm and seed, of games of an ego that could be played."""
    played = episodes[episodes["ego_failed"].notna()]
    found = {}
    for (arm, seed), failed in played.groupby(["arm", "seed"], sort=False)["ego_failed"]:
        cells = rate_cells("rate", int(failed.sum()), len(failed))
        found[str(arm), int(seed)] = FailureRate(
            failures=int(failed.sum()), games=len(failed), low=cells["rate_low"], high=cells["rate_high"]
        )
    return found


def changed_games(runs: Sequence[pd.DataFrame], starts: Sequence[Hashable]) -> list[list[ChangedGame]]:
    """For each run but the first, the games that change from the run before it, by arm, seed and episode.

    `runs` are tables of games in order, and `starts` says for each which starts its games have: game k of two runs is
    the same only if these are equal. Raises ValueError where an arm has two games for one episode.
    """
    failed = [run[run["ego_failed"].notna()].set_index(_GAME, verify_integrity=True)["ego_failed"] == 1 for run in runs]
    changes: list[list[ChangedGame]] = []
    for place in range(1, len(runs)):
        if starts[place] != starts[place - 1]:
            changes.append([])
            continue
        both = pd.concat([failed[place - 1], failed[place]], axis=1, keys=["before", "after"], join="inner")
        both = both[both["before"] != both["after"]].sort_index()
        earlier = [each for each, of in zip(failed[:place], starts[:place], strict=True) if of == starts[place]]
        before: set[Hashable] = set().union(*(each[each].index for each in earlier))
        changes.append(
            [
                ChangedGame(
                    change="fixed" if row.before else "came back" if game in before else "new",
                    arm=game[0],
                    seed=int(game[1]),
                    episode=int(game[2]),
                )
                for game, row in zip(both.index, both.itertuples(), strict=True)
            ]
        )
    return changes
