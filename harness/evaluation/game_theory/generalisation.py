"""Generalisation: how often a retrained ego fails against personas that it was not trained against."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Any

import pandas as pd

from harness.evaluation.comparisons.comparison import (
    games_by_arm,
    paired_t_test,
    pairs_of,
    rate_cells,
    with_verdicts,
)
from harness.evaluation.competence import gate
from harness.evaluation.game_theory.crossplay import Pairing
from harness.evaluation.tables import table_of, typed

NAIVE = "naive"


def generalisation(
    trained_against: Mapping[str, Collection[str]],
    pairings: Iterable[Pairing],
    episodes: pd.DataFrame,
    significance: float,
) -> pd.DataFrame:
    """A row for each pairing of an ego in `trained_against` with a non-ego of another persona, in the order of the
    pairings, the table `generalisation`. The baseline is the naive ego against the same non-ego.

    `trained_against` names for each retrained ego the personas it was trained against; the naive ego is not in it.
    `episodes` has the columns of episodes.csv. Pairs and tests are those of `comparisons.comparison`; there is no test
    where a player, or the naive ego, misses a bound of `Pairing.alone`.

    Raises ValueError when an arm has two games for one episode.
    """
    pairings, games = list(pairings), games_by_arm(episodes)
    naive = {(each.seed, each.non_ego): each for each in pairings if each.ego == NAIVE}
    rows = [
        _row(pairing, trained_against[pairing.ego], naive.get((pairing.seed, pairing.non_ego)), games)
        for pairing in pairings
        if pairing.ego in trained_against and pairing.persona and pairing.persona not in trained_against[pairing.ego]
    ]
    return typed(with_verdicts(table_of("generalisation", rows), significance, difference="fewer_failures"))


def _row(
    pairing: Pairing, trained_against: Collection[str], baseline: Pairing | None, games: Mapping[Any, pd.DataFrame]
) -> dict[str, object]:
    arm, bounds = (baseline.arm, baseline.alone) if baseline is not None else ("", ())
    closed = gate((*bounds, *pairing.alone), pairing.seed, games)
    naive, ego, left_out = pairs_of(games, pairing.seed, arm, pairing.arm, ["ego_failed"])
    was, now = naive[:, 0], ego[:, 0]
    row = vars(pairing) | vars(closed) | {"met": " + ".join(trained_against), "pairs": len(now)}
    row |= {"pairs_left_out": left_out}
    if not len(now):
        return row
    row |= rate_cells("failure_rate", now.sum(), len(now)) | {"naive_failure_rate": was.mean()}
    if was.sum():
        row["share_of_naive"] = now.sum() / was.sum()
    test = paired_t_test(now, was, closed)
    names = {"mean_difference": "fewer_failures", "ci_low": "fewer_failures_low", "ci_high": "fewer_failures_high"}
    return row | {names.get(name, name): cell for name, cell in test.items()}
