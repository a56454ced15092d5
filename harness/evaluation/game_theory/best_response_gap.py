"""The best-response gap (exploitability): a player's gain by a change of its strategy alone (SafeDriveRL, equation 2).

For each response, games are paired by seed and episode: the pair's game against the same game with one player
replaced by its best response. The gap is the mean difference of that player's payoff. It is a lower bound: a better
response may exist, so a gap that is not distinguishable from 0 does not prove an equilibrium.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Literal

import numpy as np
import pandas as pd

from harness.evaluation.comparisons.comparison import (
    games_by_arm,
    holm,
    mean_cells,
    paired_t_test,
    pairs_of,
    rate_cells,
)
from harness.evaluation.competence import AloneBound, gate
from harness.evaluation.tables import table_of, typed

Role = Literal["ego", "non_ego"]


@dataclass(frozen=True, kw_only=True)
class Response:
    """In `response_arm` the player of `role` of the pair in `pair_arm` is replaced by a best response: the best of
    several trainings against the unchanged other player, chosen by separate games."""

    seed: int
    role: Role
    persona: str
    round: int
    pair_arm: str
    response_arm: str
    ego: str
    non_ego: str
    alone: tuple[AloneBound, ...] = ()
    """What the players of the pair have to achieve alone; otherwise there is no verdict on them."""


class GapVerdict(str, Enum):
    """Every value the column `verdict` can have."""

    DISTINGUISHABLE = "distinguishable from 0"
    """p_holm < significance: this player could gain."""
    BEFORE_HOLM_ONLY = "distinguishable from 0 before Holm's correction only"
    NOT_DISTINGUISHABLE = "not distinguishable from 0"
    """The best response earned more, but not significantly."""
    NONE_FOUND = "no better response found"
    """The best response earned less or the same on average: the training found nothing better than the player's own
    strategy. A negative gap is not a gain."""
    NO_DIFFERENCE = "no difference"
    """Every game has the same payoff with and without the best response."""
    ALL_EQUAL = "no t statistic: all differences equal"
    """The best response earned more by the same number in every game."""
    NOT_ENOUGH_PAIRS = "not enough pairs"
    NOT_ANSWERED = "not answered: the pair was not shown to drive this scene"
    """A player of the pair misses a bound of `Response.alone`, so there is no test."""


NOTHING_TO_GAIN = frozenset({GapVerdict.NOT_DISTINGUISHABLE, GapVerdict.NONE_FOUND, GapVerdict.NO_DIFFERENCE})
"""The verdicts on a player without a distinguishable gain."""


def gaps(responses: Iterable[Response], episodes: pd.DataFrame, significance: float) -> pd.DataFrame:
    """A row for each response, in their order, the table `gaps`.

    `episodes` has the columns of episodes.csv. A pair is left out, and counted, when either game errored, is missing,
    or lacks the payoff or the ego's outcome. A value that can't be computed is NaN; where all differences are equal
    there is no test, as in `comparisons.comparison`. Holm's correction is over all rows of this table.
    There is no test either where a player of the pair misses a bound of `Response.alone`.

    Raises ValueError when an arm has two games for one episode.
    """
    games = games_by_arm(episodes)
    table = table_of("gaps", [_row(response, games) for response in responses])
    table["p_holm"] = holm(table["p_value"].to_numpy(dtype=np.float64))
    table["verdict"] = [_verdict(row, significance).value for row in table.to_dict("records")]
    return typed(table)


def nothing_to_gain(found: pd.DataFrame) -> bool:
    """Whether a best response of both sides was trained and neither gap is distinguishable from 0.

    `found` is a table of `gaps`, e.g. of the last round: this is the rule by which rounds stop early. It is false for a
    gap that is distinguishable before Holm's correction only, or that has no test.
    """
    both_sides = set(found["role"]) == {"ego", "non_ego"}
    return both_sides and all(GapVerdict(verdict) in NOTHING_TO_GAIN for verdict in found["verdict"])


def _row(response: Response, games: Mapping[Any, pd.DataFrame]) -> dict[str, object]:
    columns = [f"{response.role}_payoff", "ego_failed"]
    pair, best, left_out = pairs_of(games, response.seed, response.pair_arm, response.response_arm, columns)
    closed = gate(response.alone, response.seed, games)
    row = vars(response) | closed | {"pairs": len(pair), "pairs_left_out": left_out}
    if not len(pair):
        return row
    payoff = float(pair[:, 0].mean())
    test = paired_t_test(pair[:, 0], best[:, 0], closed)
    row |= test | {"payoff": payoff, "payoff_best_response": best[:, 0].mean(), "gap": test["mean_difference"]}
    if payoff != 0:
        row["gap_share"] = test["mean_difference"] / abs(payoff)
    row |= rate_cells("ego_failure_rate", pair[:, 1].sum(), len(pair))
    row |= rate_cells("ego_failure_rate_best_response", best[:, 1].sum(), len(best))
    return row | mean_cells("failure_difference", best[:, 1] - pair[:, 1])


def _verdict(row: Mapping[Any, Any], significance: float) -> GapVerdict:
    if row["reason"]:
        return GapVerdict.NOT_ANSWERED
    if row["pairs"] < 2:
        return GapVerdict.NOT_ENOUGH_PAIRS
    if np.isnan(row["p_value"]) and row["gap"] == 0:
        return GapVerdict.NO_DIFFERENCE
    if row["gap"] <= 0:
        return GapVerdict.NONE_FOUND
    if np.isnan(row["p_value"]):
        return GapVerdict.ALL_EQUAL
    if row["p_holm"] < significance:
        return GapVerdict.DISTINGUISHABLE
    return GapVerdict.BEFORE_HOLM_ONLY if row["p_value"] < significance else GapVerdict.NOT_DISTINGUISHABLE
