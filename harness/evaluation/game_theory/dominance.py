"""Which egos are never the better choice, and how to mix them so that the worst that can come is least bad.

Everything here is of a table's means: exact for the games that were played, no test of what others would show.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.optimize import linprog

Floats = npt.NDArray[np.float64]

MARGIN = 1e-9
"""What is better by less is not better: the accuracy of the linear programs, on payoffs scaled to a range of 1."""


def dominated(payoffs: Floats, names: Sequence[str]) -> list[str]:
    """For each strategy, a row of payoffs [E, N], who strictly dominates it: is better whatever the other side does.

    "" for none, the name of the first pure strategy that does, else the mixture that does so by the widest margin, as
    "0.60 naive + 0.40 robust". To find that is a linear program: the largest margin m with x payoffs >= payoffs of the
    strategy + m in every column, x a mixture (e.g. Shoham and Leyton-Brown, "Multiagent Systems", 2009, section 4.5).
    To ask it of failure rates, give them with a minus sign. Raises ValueError for numbers that are not finite.
    """
    if payoffs.ndim != 2 or not payoffs.size or not np.isfinite(payoffs).all():
        raise ValueError("dominance needs a whole table of finite numbers")
    spread = np.ptp(payoffs)
    scaled = (payoffs - payoffs.min()) / spread if spread > 0 else np.zeros_like(payoffs)
    return [_dominator(scaled, strategy, names) for strategy in range(len(payoffs))]


def _dominator(payoffs: Floats, strategy: int, names: Sequence[str]) -> str:
    better = np.flatnonzero((payoffs > payoffs[strategy] + MARGIN).all(axis=1))
    if len(better):
        return names[better[0]]
    E, N = payoffs.shape
    answer = linprog(
        np.append(np.zeros(E), -1.0),
        A_ub=np.hstack([-payoffs.T, np.ones((N, 1))]),
        b_ub=-payoffs[strategy],
        A_eq=np.append(np.ones(E), 0.0)[None],
        b_eq=[1.0],
        bounds=[(0.0, 1.0)] * E + [(None, None)],
    )
    if answer.status != 0:
        return ""
    shares = _distribution(answer.x[:E])
    if not (shares @ payoffs > payoffs[strategy] + MARGIN).all():
        return ""
    return " + ".join(f"{share:.2f} {name}" for share, name in zip(shares, names, strict=True) if share >= 0.005)


def safest_mixture(failure_rates: Floats) -> Floats:
    """The shares [E] of egos with the least failure rate against whichever non-ego is worst for them, of rates [E, N];
    of those, one with the least mean over the non-egos.

    Two linear programs: the least worst case v, then the least mean that keeps to v. If a pure ego does as well as
    the mixture, the first such ego is the answer. Raises ValueError for rates that are missing or not from 0 to 1.
    """
    if failure_rates.ndim != 2 or not failure_rates.size or not ((failure_rates >= 0) & (failure_rates <= 1)).all():
        raise ValueError("the safest mixture needs a whole table of rates from 0 to 1")
    E, N = failure_rates.shape
    worst = failure_rates.max(axis=1)
    rates, ones = failure_rates.T, np.ones((N, 1))
    simplex = {"A_eq": np.append(np.ones(E), 0.0)[None], "b_eq": [1.0]}
    least = linprog(
        np.append(np.zeros(E), 1.0),
        A_ub=np.hstack([rates, -ones]),
        b_ub=np.zeros(N),
        bounds=[(0.0, 1.0)] * E + [(0.0, 1.0)],
        **simplex,
    )
    best_pure = np.lexsort((failure_rates.mean(axis=1), worst))[0]
    pure = np.eye(E)[best_pure]
    if least.status != 0 or worst[best_pure] <= least.fun + MARGIN:
        return pure
    mean = linprog(
        np.append(failure_rates.mean(axis=1), 0.0),
        A_ub=np.hstack([rates, -ones]),
        b_ub=np.zeros(N),
        bounds=[(0.0, 1.0)] * E + [(0.0, least.fun + MARGIN)],
        **simplex,
    )
    return _distribution((mean if mean.status == 0 else least).x[:E])


def _distribution(shares: Floats) -> Floats:
    """Shares without the rounding of a linear program: none below 0, their sum 1."""
    clean = np.where(shares < MARGIN, 0.0, shares)
    return np.asarray(clean / clean.sum(), dtype=np.float64)
