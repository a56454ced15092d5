"""Generalisation: how often a retrained ego fails against personas that it was not trained against."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Any

import numpy as np
import pandas as pd

from harness.evaluation.comparisons.comparison import (
    games_by_arm,
    holm,
    paired_t_test,
    pairs_of,
    rate_interval,
    verdict_of,
)
from harness.evaluation.competence import gate
from harness.evaluation.game_theory.records import Pairing
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

    Raises ValueError when significance is not in (0, 1), or an arm has two games for one episode.
    """
    if not 0 < significance < 1:
        raise ValueError(f"significance must be between 0 and 1, not {significance}")
    pairings, games = list(pairings), games_by_arm(episodes)
    naive = {(each.seed, each.non_ego): each for each in pairings if each.ego == NAIVE}
    rows = [
        _row(pairing, trained_against[pairing.ego], naive.get((pairing.seed, pairing.non_ego)), games)
        for pairing in pairings
        if pairing.ego in trained_against and pairing.persona and pairing.persona not in trained_against[pairing.ego]
    ]
    table = table_of("generalisation", rows)
    table["p_holm"] = holm(table["p_value"].to_numpy(dtype=np.float64))
    judged = table.rename(columns={"fewer_failures": "mean_difference"}).to_dict("records")
    table["verdict"] = [verdict_of(row, significance).value for row in judged]
    return typed(table)


def _row(
    pairing: Pairing, trained_against: Collection[str], baseline: Pairing | None, games: Mapping[Any, pd.DataFrame]
) -> dict[str, object]:
    arm, bounds = (baseline.arm, baseline.alone) if baseline is not None else ("", ())
    closed = gate((*bounds, *pairing.alone), pairing.seed, games)
    naive, ego, left_out = pairs_of(games, pairing.seed, arm, pairing.arm, ["ego_failed"])
    was, now = naive[:, 0], ego[:, 0]
    row: dict[str, object] = {
        "seed": pairing.seed,
        "ego": pairing.ego,
        "met": " + ".join(trained_against),
        "persona": pairing.persona,
        "non_ego": pairing.non_ego,
        "pairs": len(now),
        "pairs_left_out": left_out,
        "verdict": closed.verdict.value if closed is not None else "",
        "reason": closed.reason if closed is not None else "",
    }
    if not len(now):
        return row
    low, high = rate_interval(int(now.sum()), len(now))
    row |= {"failure_rate": now.mean(), "failure_rate_low": low, "failure_rate_high": high}
    row |= {"naive_failure_rate": was.mean()}
    if was.sum():
        row["share_of_naive"] = now.sum() / was.sum()
    test = paired_t_test(now, was, closed)
    names = {"mean_difference": "", "ci_low": "_low", "ci_high": "_high"}
    row |= {f"fewer_failures{end}": test[name] for name, end in names.items() if name in test}
    return row | ({"p_value": test["p_value"]} if "p_value" in test else {})
