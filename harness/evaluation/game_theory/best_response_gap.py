"""The best-response gap (exploitability): a player's gain by a change of its strategy alone (SafeDriveRL, equation 2).

For each response, games are paired by seed and episode: the pair's game against the same game with one player
replaced by its best known response: that of a search by training, or another strategy of the campaign. The gap is the
mean difference of that player's payoff. It is a lower bound: a better response may exist, so a gap that is not
distinguishable from 0 does not prove an equilibrium.

The best known response is chosen by cross-fitting, so that the choice does not make its own figure better: for the even
episodes the one with the highest mean payoff in the odd ones is taken, and the reverse (Chernozhukov et al.,
"Double/debiased machine learning for treatment and structural parameters", 2018).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from harness.evaluation.comparisons.comparison import (
    ROUNDING,
    games_by_arm,
    holm,
    mean_cells,
    measured_values,
    paired_t_test,
    rate_cells,
)
from harness.evaluation.competence import AloneBound, gate
from harness.evaluation.tables import table_of, typed
from harness.game.arrays import FloatArray

Role = Literal["ego", "non_ego"]


@dataclass(frozen=True, kw_only=True)
class Response:
    """In `response_arm` the player of `role` of the pair in `pair_arm` is replaced by a best response: the best of
    several trainings against the unchanged other player, chosen by separate games. That is the search."""

    seed: int
    role: Role
    persona: str
    round: int
    pair_arm: str
    response_arm: str
    ego: str
    non_ego: str
    steps: int
    """Budget of each training of the search."""
    starts: int
    """Trainings of the search."""
    known_arms: tuple[str, ...] = ()
    """Arms in which another strategy of the campaign meets the same other player."""
    alone: tuple[AloneBound, ...] = ()
    """What the players of the pair have to achieve alone; otherwise there is no verdict on them."""


class GapVerdict(str, Enum):
    """Every value the column `verdict` can have."""

    DISTINGUISHABLE = "distinguishable from 0"
    """p_holm < significance: this player could gain."""
    BEFORE_HOLM_ONLY = "distinguishable from 0 before Holm's correction only"
    NOT_DISTINGUISHABLE = "not distinguishable from 0"
    """The best known response earned more, but not significantly."""
    NONE_FOUND = "no better response found"
    """The best known response earned less or the same on average: nothing better than the player's own strategy is
    known. A negative gap is not a gain."""
    LACKS_POWER = "the search lacks power: it ends below the player's own strategy"
    """No gain is distinguishable from 0, but the 95 % interval of the search's gain is below 0. The player's own
    strategy is a response too: a search that ends below it says nothing about what a better one would find."""
    NO_DIFFERENCE = "no difference"
    """Every game has the same payoff with and without the best known response."""
    ALL_EQUAL = "no t statistic: all differences equal"
    """The best known response earned more by the same number in every game."""
    NOT_ENOUGH_PAIRS = "not enough pairs"
    NOT_ANSWERED = "not answered: the pair was not shown to drive this scene"
    """A player of the pair misses a bound of `Response.alone`, so there is no test."""


NOTHING_TO_GAIN = frozenset({GapVerdict.NOT_DISTINGUISHABLE, GapVerdict.NONE_FOUND, GapVerdict.NO_DIFFERENCE})
"""The verdicts on a player without a distinguishable gain."""


_LEAST_PAIRS = 4
"""With fewer, the halves are too small to choose by: only the search counts."""


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
    found = {
        arm: measured_values(games.get((arm, response.seed)), columns)
        for arm in (response.pair_arm, response.response_arm, *response.known_arms)
    }
    known = [arm for arm in dict.fromkeys(response.known_arms) if found[arm].notna().all(axis=1).any()]
    both = pd.concat([found[arm] for arm in (response.pair_arm, response.response_arm, *known)], axis=1)
    measured = both.notna().all(axis=1).to_numpy()
    episodes, values = both.index.to_numpy(dtype=np.int64)[measured], both.to_numpy(dtype=np.float64)[measured]
    pair, *responses = np.split(values, 2 + len(known), axis=1)
    closed = gate(response.alone, response.seed, games)
    row = vars(response) | closed | {"pairs": len(pair), "pairs_left_out": int((~measured).sum())}
    row |= {"search_steps": response.steps, "search_starts": response.starts, "known": len(known)}
    if not len(pair):
        return row
    chosen = _best_known(episodes, np.stack([each[:, 0] for each in responses]))
    best = np.stack(responses)[chosen, np.arange(len(pair))]
    payoff = float(pair[:, 0].mean())
    test = paired_t_test(pair[:, 0], best[:, 0], closed)
    row |= test | {"payoff": payoff, "payoff_best_response": best[:, 0].mean(), "gap": test["mean_difference"]}
    if payoff != 0:
        row["gap_share"] = test["mean_difference"] / abs(payoff)
    row["best_known"] = " + ".join(known[place - 1] for place in np.unique(chosen) if place > 0)
    row |= mean_cells("search_gap", responses[0][:, 0] - pair[:, 0])
    row |= rate_cells("ego_failure_rate", pair[:, 1].sum(), len(pair))
    row |= rate_cells("ego_failure_rate_best_response", best[:, 1].sum(), len(best))
    return row | mean_cells("failure_difference", best[:, 1] - pair[:, 1])


def _best_known(episodes: NDArray[np.int64], payoffs: FloatArray) -> NDArray[np.int64]:
    """The response [N] of each game, of payoffs [responses, N]: the best in the other half of the episodes [N]."""
    is_odd = episodes % 2 == 1
    chosen = np.zeros(len(episodes), dtype=np.int64)
    if len(episodes) >= _LEAST_PAIRS and is_odd.any() and not is_odd.all():
        for half in (is_odd, ~is_odd):
            chosen[half] = payoffs[:, ~half].mean(axis=1).argmax()
    return chosen


def _verdict(row: Mapping[Any, Any], significance: float) -> GapVerdict:
    if row["reason"]:
        return GapVerdict.NOT_ANSWERED
    if row["pairs"] < 2:
        return GapVerdict.NOT_ENOUGH_PAIRS
    if np.isnan(row["p_value"]) and row["gap"] > 0:
        return GapVerdict.ALL_EQUAL
    if row["p_value"] < significance:
        return GapVerdict.DISTINGUISHABLE if row["p_holm"] < significance else GapVerdict.BEFORE_HOLM_ONLY
    end = row["search_gap"] if np.isnan(row["search_gap_high"]) else row["search_gap_high"]
    if end < -ROUNDING * abs(row["payoff"]):
        return GapVerdict.LACKS_POWER
    if np.isnan(row["p_value"]) and row["gap"] == 0:
        return GapVerdict.NO_DIFFERENCE
    return GapVerdict.NONE_FOUND if row["gap"] <= 0 else GapVerdict.NOT_DISTINGUISHABLE
