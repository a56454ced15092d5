"""Dominated egos, and the mixture of egos with the least failure rate in the worst case.

The results hold for the means of a table: they are exact for the games that were played, and are not a test.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy  # loads its parts at their first use: a worker that solves nothing does without

from harness.evaluation.game_theory.nash import scaled
from harness.game.arrays import FloatArray

MARGIN = 1e-9
"""A smaller difference counts as none: the accuracy of the linear programs, on payoffs scaled to a range of 1."""


def dominated(payoffs: FloatArray, names: Sequence[str]) -> list[str]:
    """For each strategy, a row of payoffs [E, N], the one that strictly dominates it: that is better in every column.

    "" for none; the name of the first pure strategy that dominates it; else the mixture with the widest margin, e.g.
    "0.60 naive + 0.40 robust". A linear program finds the mixture x: the largest margin m with
    x payoffs >= payoffs of the strategy + m in every column (e.g. Shoham and Leyton-Brown, "Multiagent Systems", 2009,
    section 4.5).
    For failure rates, pass them with a minus sign.
    """
    return [_dominator(scaled(payoffs), strategy, names) for strategy in range(len(payoffs))]


def _dominator(payoffs: FloatArray, strategy: int, names: Sequence[str]) -> str:
    better = np.flatnonzero((payoffs > payoffs[strategy] + MARGIN).all(axis=1))
    if len(better):
        return names[better[0]]
    E, N = payoffs.shape
    margins = np.hstack([-payoffs.T, np.ones((N, 1))])
    answer = _program(np.append(np.zeros(E), -1.0), margins, -payoffs[strategy], (None, None))
    if answer.status != 0:
        return ""
    shares = _distribution(answer.x[:E])
    if not (shares @ payoffs > payoffs[strategy] + MARGIN).all():
        return ""
    return " + ".join(f"{share:.2f} {name}" for share, name in zip(shares, names, strict=True) if share >= 0.005)


def safest_mixture(failure_rates: FloatArray) -> FloatArray:
    """The shares [E] of egos with the least failure rate against the worst non-ego for them, of rates [E, N]. Of equal
    ones, those with the least mean over the non-egos.

    Two linear programs: the least worst case v, then the least mean with at most v. If a pure ego is as safe as the
    mixture, the result is the first such ego.
    """
    E, N = failure_rates.shape
    means, worst = failure_rates.mean(axis=1), failure_rates.max(axis=1)
    above_v = np.hstack([failure_rates.T, -np.ones((N, 1))])
    least = _program(np.append(np.zeros(E), 1.0), above_v, np.zeros(N), (0.0, 1.0))
    best_pure = np.lexsort((means, worst))[0]
    if least.status != 0 or worst[best_pure] <= least.fun + MARGIN:
        return np.eye(E)[best_pure]
    mean = _program(np.append(means, 0.0), above_v, np.zeros(N), (0.0, least.fun + MARGIN))
    return _distribution((mean if mean.status == 0 else least).x[:E])


def _program(cost: FloatArray, rows: FloatArray, most: FloatArray, last: tuple[float | None, float | None]) -> Any:
    """The solution of least cost: shares, whose sum is 1, and a number within the bounds `last`; rows @ x <= most."""
    shares = len(cost) - 1
    simplex = np.append(np.ones(shares), 0.0)[None]
    bounds = [(0.0, 1.0)] * shares + [last]
    return scipy.optimize.linprog(cost, A_ub=rows, b_ub=most, A_eq=simplex, b_eq=[1.0], bounds=bounds)


def _distribution(shares: FloatArray) -> FloatArray:
    """Shares without the rounding errors of a linear program: none below 0, their sum 1."""
    clean = np.where(shares < MARGIN, 0.0, shares)
    return np.asarray(clean / clean.sum(), dtype=np.float64)
