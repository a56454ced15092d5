"""The best-response gap (exploitability): a player's gain by a change of its strategy alone (SafeDriveRL, equation 2).

For each response, games are paired by seed and episode: the pair's game against the same game with one player
replaced by its best known response. The gap is the mean difference of that player's payoff. It is a lower bound: a
better response may exist, so a gap that is not distinguishable from 0 does not prove an equilibrium.

The known responses are the player's own strategy, the one that the search trained, and the campaign's other strategies
of this player that met the same other player. So a response is never worse than what it answers with: where nothing
earned more, the player keeps its own, and the gap is 0. The best of several means is too high on average. Therefore the
choice is cross-fitted: for the games of even episodes the response with the highest mean payoff in the odd ones is
taken, and the reverse.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import pandas as pd

from harness.evaluation.comparisons.comparison import (
    games_by_arm,
    holm,
    mean_cells,
    measured_values,
    paired_t_test,
    rate_cells,
)
from harness.evaluation.competence import AloneBound, gate
from harness.evaluation.gap_verdict import GapVerdict
from harness.evaluation.tables import table_of, typed
from harness.game.arrays import FloatArray, IntArray

Role = Literal["ego", "non_ego"]
SEARCH = "the search"
"""The response that the search trained, in the column `best_known`. No strategy has a space in its name."""
OWN = "its own strategy"
"""The response of a player that changes nothing, in the same column."""
LEAST_OF_HALF = 2
"""Fewer games in a half choose no response: only the search counts."""


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
    search_steps: int
    """The budget of each training."""
    search_starts: int
    """The trainings."""
    known_arms: Mapping[str, str] = field(default_factory=dict)
    """By the name of another strategy of this player: the arm in which it meets the same other player."""
    alone: tuple[AloneBound, ...] = ()
    """What the players of the pair have to achieve alone; otherwise there is no verdict on them."""


NOTHING_TO_GAIN = frozenset({GapVerdict.NOT_DISTINGUISHABLE, GapVerdict.NONE_FOUND, GapVerdict.NO_DIFFERENCE})
"""The verdicts on a player without a distinguishable gain, after a search that did not end below its own strategy."""


def gaps(responses: Iterable[Response], episodes: pd.DataFrame, significance: float) -> pd.DataFrame:
    """A row for each response, in their order, the table `gaps`.

    `episodes` has the columns of episodes.csv. A pair is left out, and counted, when its game, or that of a response,
    errored, is missing, or lacks the payoff or the ego's outcome. A strategy without any such game is no response. A
    value that can't be computed is NaN; where all differences are equal
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
    gap that is distinguishable before Holm's correction only, or that has no test, and after a search that lacks power.
    """
    both_sides = set(found["role"]) == {"ego", "non_ego"}
    return both_sides and all(GapVerdict(verdict) in NOTHING_TO_GAIN for verdict in found["verdict"])


def _row(response: Response, games: Mapping[Any, pd.DataFrame]) -> dict[str, object]:
    known, left_out, (pair, search, *others), episodes = _compared(response, games)
    closed = gate(response.alone, response.seed, games)
    row = vars(response) | closed | {"pairs": len(pair), "pairs_left_out": left_out, "known": len(known)}
    if not len(pair):
        return row
    responses = {OWN: pair, SEARCH: search, **dict(zip(known, others, strict=True))}
    taken = _cross_fitted(np.stack([each[:, 0] for each in responses.values()]), episodes)
    best = np.stack(list(responses.values()))[taken, np.arange(len(pair))]
    payoff = float(pair[:, 0].mean())
    test = paired_t_test(pair[:, 0], best[:, 0], closed)
    row |= test | {"payoff": payoff, "payoff_best_response": best[:, 0].mean(), "gap": test["mean_difference"]}
    row["best_known"] = " + ".join(list(responses)[place] for place in sorted(set(taken.tolist())))
    if payoff != 0:
        row["gap_share"] = test["mean_difference"] / abs(payoff)
    of_search = paired_t_test(pair[:, 0], search[:, 0], closed)
    names = {"search_gap": "mean_difference", "search_gap_low": "ci_low", "search_gap_high": "ci_high"}
    row |= {name: of_search.get(cell, np.nan) for name, cell in names.items()}
    row |= rate_cells("ego_failure_rate", pair[:, 1].sum(), len(pair))
    row |= rate_cells("ego_failure_rate_best_response", best[:, 1].sum(), len(best))
    return row | mean_cells("failure_difference", best[:, 1] - pair[:, 1])


def _compared(
    response: Response, games: Mapping[Any, pd.DataFrame]
) -> tuple[Sequence[str], int, Sequence[FloatArray], IntArray]:
    """The known strategies that count, the number of games left out, and of the N games that are compared: payoff and
    the ego's failure in the pair, with the search and with each known strategy [N, 2], and the episodes [N]."""
    columns = [f"{response.role}_payoff", "ego_failed"]

    def measured(arm: str) -> pd.DataFrame:
        values = measured_values(games.get((arm, response.seed)), columns)
        return values.where(np.isfinite(values))

    both = [measured(response.pair_arm), measured(response.response_arm)]
    known = {name: values for name, arm in response.known_arms.items() if len((values := measured(arm)).dropna())}
    table = pd.concat([*both, *known.values()], axis=1)
    of_half = np.bincount(table.dropna().index.to_numpy(dtype=np.int64) % 2, minlength=2)
    if of_half.min() < LEAST_OF_HALF:
        known, table = {}, pd.concat(both, axis=1)
    complete = table.dropna()
    values = np.split(complete.to_numpy(dtype=np.float64), 2 + len(known), axis=1)
    return list(known), len(table) - len(complete), values, complete.index.to_numpy(dtype=np.int64)


def _cross_fitted(payoffs: FloatArray, episodes: IntArray) -> IntArray:
    """For each of N games the place of the response to take: that of the highest mean payoff, of [K, N], in the other
    half of the games. Of equal ones the first. With too few games in a half it is the second, the search."""
    if np.bincount(episodes % 2, minlength=2).min() < LEAST_OF_HALF:
        return np.ones(len(episodes), dtype=np.int64)
    of_even, of_odd = (payoffs[:, episodes % 2 == half].mean(axis=1).argmax() for half in (0, 1))
    return np.where(episodes % 2 == 0, of_odd, of_even)


def _verdict(row: Mapping[Any, Any], significance: float) -> GapVerdict:
    if row["reason"]:
        return GapVerdict.NOT_ANSWERED
    if row["pairs"] < 2:
        return GapVerdict.NOT_ENOUGH_PAIRS
    if row["p_holm"] < significance:
        return GapVerdict.DISTINGUISHABLE
    if row["p_value"] < significance:
        return GapVerdict.BEFORE_HOLM_ONLY
    if np.isnan(row["p_value"]) and row["gap"] > 0:
        return GapVerdict.ALL_EQUAL
    if row["search_gap"] < 0 and not row["search_gap_high"] >= 0:  # NaN: less by the same number in every game
        return GapVerdict.LACKS_POWER
    if row["search_gap"] == 0 and np.isnan(row["search_gap_low"]) and row["gap"] == 0:
        return GapVerdict.NO_DIFFERENCE
    return GapVerdict.NOT_DISTINGUISHABLE if row["gap"] > 0 else GapVerdict.NONE_FOUND
