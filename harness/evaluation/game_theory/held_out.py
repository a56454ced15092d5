"""The failure rate of a mixture in games that did not choose it.

A solution of the empirical game is computed from the means of a sample of games. In the same games the safest mixture
fails less often than in others on average, because they chose it. By 10-fold cross-validation the mixture is computed
from nine folds of the games and played in the fold left out, in turn (M. Stone, "Cross-validatory choice and assessment
of statistical predictions", J. R. Statist. Soc. B 36, 1974).
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pandas as pd

from harness.evaluation.comparisons.comparison import games_by_arm, measured_values
from harness.evaluation.game_theory.crossplay import Pairing
from harness.evaluation.game_theory.empirical_game import SolutionKind, safest_mixture
from harness.evaluation.game_theory.nash import solve
from harness.game.arrays import FloatArray

FOLDS = 10
"""The fold of a game is its episode, modulo this."""
_MEASURED = ["ego_failed", "ego_payoff", "non_ego_payoff"]


def with_held_out_rates(equilibria: pd.DataFrame, pairings: Iterable[Pairing], episodes: pd.DataFrame) -> pd.DataFrame:
    """The table `equilibria` with its column `held_out_failure_rate`.

    The first equilibrium and the safest mixture of the table's strategies are computed again for each fold. `episodes`
    has the columns of episodes.csv. The rate is the mean over the folds; of `safest` the largest of these means against
    a non-ego. It is NaN where a fold has no game of a cell, or no equilibrium of it was verified, and in other rows.

    Raises ValueError when an arm has two games for one episode.
    """
    table = equilibria.copy()
    is_first = (table["solution"] == SolutionKind.NASH.value) & (table["number"] == 1).fillna(False)
    solved = table[is_first | (table["solution"] == SolutionKind.SAFEST.value)]
    if not len(solved):
        return table
    sums, counts = _by_fold(pairings, episodes)
    for (seed, _, solution), rows in solved.groupby(["seed", "game", "solution"], sort=False):
        sides = [rows.loc[rows["role"] == role, "player"] for role in ("ego", "non_ego")]
        cells = pd.MultiIndex.from_product([[seed], *sides, range(FOLDS)])
        shape = (len(_MEASURED), len(sides[0]), len(sides[1]), FOLDS)
        values = (
            each.reindex(cells, fill_value=0).to_numpy(dtype=np.float64).T.reshape(shape) for each in (sums, counts)
        )
        table.loc[rows.index, "held_out_failure_rate"] = _rate(SolutionKind(solution), *values)
    return table


def _by_fold(pairings: Iterable[Pairing], episodes: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The sums and the numbers of what was measured in the games of each seed, ego, non-ego and fold. A game counts
    when the ego's outcome is known, as in the table `crossplay`."""
    games, frames = games_by_arm(episodes), []
    for pairing in pairings:
        values = measured_values(games.get((pairing.arm, pairing.seed)), _MEASURED).dropna(subset="ego_failed")
        place = {"seed": pairing.seed, "ego": pairing.ego, "non_ego": pairing.non_ego}
        if len(values):
            frames.append(values.assign(**place, fold=values.index % FOLDS))
    by_cell = pd.concat(frames, ignore_index=True).groupby(["seed", "ego", "non_ego", "fold"], sort=False)[_MEASURED]
    return by_cell.sum(), by_cell.count()


def _rate(kind: SolutionKind, sums: FloatArray, counts: FloatArray) -> float:
    """Of sums and numbers [3, E, N, F] in the order of `_MEASURED`."""
    with np.errstate(invalid="ignore"):
        held_out = sums[0] / counts[0]
        others = (sums.sum(axis=-1, keepdims=True) - sums) / (counts.sum(axis=-1, keepdims=True) - counts)
    needed = others if kind is SolutionKind.NASH else others[0]
    if not (np.isfinite(held_out).all() and np.isfinite(needed).all()):
        return np.nan
    rates = []
    for fold in range(FOLDS):
        failure_rate, ego_payoff, non_ego_payoff = others[..., fold]
        if kind is SolutionKind.SAFEST:
            rates.append(safest_mixture(failure_rate) @ held_out[..., fold])
            continue
        found = solve(ego_payoff, non_ego_payoff)
        if not found:
            return np.nan
        rates.append(found[0].ego_shares @ held_out[..., fold] @ found[0].non_ego_shares)
    return float(np.mean(rates, axis=0).max())
