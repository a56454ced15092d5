"""How often a mixture fails in games that did not choose it: cross-validation of the solutions of empirical games.

The shares of a mixture are computed from a sample of games, and are best in this sample: in it the mixture fails less
than in others. So the episodes are split into folds; for each fold the shares are computed from the games of the others
and played in its own (M. Stone, "Cross-Validatory Choice and Assessment of Statistical Predictions", 1974).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from harness.evaluation.comparisons.comparison import games_by_arm, measured_values
from harness.evaluation.game_theory.crossplay import Pairing
from harness.evaluation.game_theory.empirical_game import SolutionKind, safest_mixture
from harness.evaluation.game_theory.nash import NoEquilibrium, equilibrium_shares
from harness.game.arrays import FloatArray

FOLDS = 5
"""The fold of a game is its episode modulo this number, so that games of the same start are in the same fold."""
_MEASURED = ("ego_failed", "ego_payoff", "non_ego_payoff")


def with_held_out_rates(found: pd.DataFrame, pairings: Sequence[Pairing], episodes: pd.DataFrame) -> pd.DataFrame:
    """A table of `equilibria` with `held_out_failure_rate` of each game's safest mixture or equilibrium of number 1;
    `pairings` and `episodes` are those of its cross-play.

    It is NaN where a cell of the game has no measured game in a fold, or where no equilibrium is verified in one.
    """
    games, rates = games_by_arm(episodes), found["held_out_failure_rate"].copy()
    arms = {(each.seed, each.ego, each.non_ego): each.arm for each in pairings}
    for (seed, _), rows in found.groupby(["seed", "game"], sort=False):
        is_safest = rows["solution"] == SolutionKind.SAFEST.value
        chosen = rows[is_safest | ((rows["solution"] == SolutionKind.NASH.value) & (rows["number"] == 1))]
        if len(chosen):
            egos, non_egos = (chosen.loc[chosen["role"] == role, "player"].tolist() for role in ("ego", "non_ego"))
            cells = [[games.get((arms[seed, ego, non_ego], seed)) for non_ego in non_egos] for ego in egos]
            sums, counts = _by_fold(cells)
            rates[chosen.index] = _held_out(sums, counts, safest=bool(is_safest.any()))
    return found.assign(held_out_failure_rate=rates)


def _by_fold(cells: Sequence[Sequence[pd.DataFrame | None]]) -> tuple[FloatArray, FloatArray]:
    """Sums and counts [measure, fold, E, N] of the games of each cell in which the ego's outcome is known."""
    sums = np.zeros((len(_MEASURED), FOLDS, len(cells), len(cells[0])))
    counts = np.zeros_like(sums)
    for row, column in np.ndindex(len(cells), len(cells[0])):
        values = measured_values(cells[row][column], _MEASURED).dropna(subset="ego_failed")
        folds = values.index.to_numpy(dtype=np.int64) % FOLDS
        for measure, name in enumerate(_MEASURED):
            known = values[name].to_numpy(dtype=np.float64)
            is_known = np.isfinite(known)
            sums[measure, :, row, column] = np.bincount(folds[is_known], known[is_known], FOLDS)
            counts[measure, :, row, column] = np.bincount(folds[is_known], minlength=FOLDS)
    return sums, counts


def _held_out(sums: FloatArray, counts: FloatArray, *, safest: bool) -> float:
    """The failure rate in the folds that did not choose the shares: the safest mixture's against its worst non-ego."""
    needed = counts[:1] if safest else counts
    if not (needed > 0).all():
        return float("nan")
    rates = []
    for fold in range(FOLDS):
        with np.errstate(invalid="ignore"):
            chosen_by = (sums.sum(axis=1) - sums[:, fold]) / (counts.sum(axis=1) - counts[:, fold])
        played = sums[0, fold] / counts[0, fold]
        if safest:
            rates.append(safest_mixture(chosen_by[0]) @ played)
            continue
        try:
            at = equilibrium_shares(chosen_by[1], chosen_by[2])
        except NoEquilibrium:
            return float("nan")
        rates.append(np.array([at.ego_shares @ played @ at.non_ego_shares]))
    return float(np.mean(rates, axis=0).max())
