"""Cross-play: every ego against every non-ego, over the same starts; and how often a retrained ego fails against
personas that it was not trained against."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from harness.evaluation.comparisons.comparison import (
    games_by_arm,
    holm,
    mean_cells,
    measured_values,
    paired_share_test,
    pairs_of,
    rate_cells,
    with_verdicts,
)
from harness.evaluation.competence import AloneBound, gate
from harness.evaluation.tables import table_of, typed

NAIVE = "naive"
MEASURED = ("ego_failed", "ego_payoff", "non_ego_payoff", "ego_mean_speed_mps")


@dataclass(frozen=True, kw_only=True)
class Pairing:
    """One arm as a cell of the cross-play: an ego strategy and a non-ego strategy."""

    arm: str
    seed: int
    ego: str
    non_ego: str
    persona: str
    """Of the non-ego; "" for SUMO's own driver, which has no payoff and is in no empirical game."""
    alone: tuple[AloneBound, ...] = ()
    """What its players have to achieve alone; otherwise there is no verdict on them."""


def crossplay(pairings: Iterable[Pairing], episodes: pd.DataFrame) -> pd.DataFrame:
    """A row for each pairing, in their order, the table `crossplay`.

    `episodes` has the columns of episodes.csv. A game counts when it was played and the ego's outcome is known; the
    other means are over those of these games in which they were measured, and empty without any. Episodes that only
    another pairing of the seed has are counted in `left_out`, like games that errored.

    Raises ValueError when an ego and a non-ego are paired twice, or an arm has two games for one episode.
    """
    games, played = games_by_arm(episodes), dict[int, set[int]]()
    values = dict[tuple[int, str, str], tuple[Pairing, pd.DataFrame]]()
    for pairing in pairings:
        cell = (pairing.seed, pairing.ego, pairing.non_ego)
        if cell in values:
            raise ValueError(f"seed {pairing.seed}: {pairing.ego!r} against {pairing.non_ego!r} are paired twice")
        values[cell] = (pairing, measured_values(games.get((pairing.arm, pairing.seed)), MEASURED))
        played.setdefault(pairing.seed, set()).update(values[cell][1].index)
    rows = [_row(pairing, measured, len(played[pairing.seed])) for pairing, measured in values.values()]
    return table_of("crossplay", rows)


def _row(pairing: Pairing, values: pd.DataFrame, episodes: int) -> dict[str, object]:
    known = values.dropna(subset="ego_failed")
    row = vars(pairing) | {"games": len(known), "left_out": episodes - len(known)}
    row |= rate_cells("failure_rate", known["ego_failed"].sum(), len(known))
    for name in ("ego_payoff", "non_ego_payoff"):
        row |= mean_cells(name, known[name].dropna().to_numpy())
    return row | {"ego_mean_speed_mps": known["ego_mean_speed_mps"].mean()}


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
    where a player, or the naive ego, misses a bound of `Pairing.alone`. Holm's correction is over all rows.

    Raises ValueError when an arm has two games for one episode.
    """
    pairings, games = list(pairings), games_by_arm(episodes)
    naive = {(each.seed, each.non_ego): each for each in pairings if each.ego == NAIVE}
    rows = [
        _generalised(pairing, trained_against[pairing.ego], naive.get((pairing.seed, pairing.non_ego)), games)
        for pairing in pairings
        if pairing.ego in trained_against and pairing.persona and pairing.persona not in trained_against[pairing.ego]
    ]
    table = table_of("generalisation", rows)
    table["p_holm"] = holm(table["p_value"].to_numpy(dtype=np.float64))
    return typed(with_verdicts(table, significance, difference="fewer_failures"))


def _generalised(
    pairing: Pairing, trained_against: Collection[str], baseline: Pairing | None, games: Mapping[Any, pd.DataFrame]
) -> dict[str, object]:
    arm, bounds = (baseline.arm, baseline.alone) if baseline is not None else ("", ())
    closed = gate((*bounds, *pairing.alone), pairing.seed, games)
    naive, ego, left_out = pairs_of(games, pairing.seed, arm, pairing.arm, ["ego_failed"])
    was, now = naive[:, 0], ego[:, 0]
    row = vars(pairing) | closed | {"met": " + ".join(trained_against), "pairs": len(now)}
    row |= {"pairs_left_out": left_out}
    if not len(now):
        return row
    row |= rate_cells("failure_rate", now.sum(), len(now)) | {"naive_failure_rate": was.mean()}
    if was.sum():
        row["share_of_naive"] = now.sum() / was.sum()
    test = paired_share_test(now, was, closed)
    names = {"mean_difference": "fewer_failures", "ci_low": "fewer_failures_low", "ci_high": "fewer_failures_high"}
    return row | {names.get(name, name): cell for name, cell in test.items() if name != "mcnemar_p"}
