"""Nash equilibria of a game of two players with finitely many strategies each, every one verified by its regret.

Payoffs are matrices [E, N]: the ego chooses the row, the non-ego the column. A mixed strategy is an array of shares.
(x, y) is a Nash equilibrium when neither player gains by changing its strategy alone (SafeDriveRL, equation 2):
its regrets, max(A y) - x A y and max(x B) - x B y, are both 0.

How they are found. Strategies that another pure one strictly dominates are in no equilibrium and are left out first,
again and again. Pure equilibria are looked up. The others come from nashpy, where there are at most `MOST_SUPPORTS`
pairs of supports: support enumeration, and vertex enumeration, which knows the corners of a continuum of equilibria
too (Nisan et al., "Algorithmic Game Theory", 2007, algorithms 3.4 and 3.5). Where supports are too many to go through,
or nothing verifies, a mixed-integer program (Sandholm, Gilpin and Conitzer, "Mixed-Integer Programming Methods for
Finding Nash Equilibria", AAAI 2005, formulation 1, by HiGHS) finds the equilibrium of the highest ego payoff. No
candidate is taken on trust: what is returned has a regret of at most `TOLERANCE` of its player's range of payoffs.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import Bounds, LinearConstraint, linprog, milp
from scipy.spatial import QhullError

from harness.errors import HarnessError

Floats = npt.NDArray[np.float64]

TOLERANCE = 1e-7
"""The largest regret of an equilibrium, as a share of the range of its player's payoffs (max - min of the matrix)."""
MOST_SUPPORTS = 4_000
"""Pairs of supports that are gone through: some tenths of a second."""
_DIGITS = 6
"""Equilibria whose shares are equal to so many digits are one."""


class NoEquilibrium(HarnessError):
    """No candidate verified. Every finite game has an equilibrium (Nash 1950): the numbers got in the way."""


@dataclass(frozen=True)
class Equilibrium:
    """Shares of the ego's strategies [E] and of the non-ego's [N], each a distribution."""

    ego_shares: Floats
    non_ego_shares: Floats


@dataclass(frozen=True)
class Solution:
    """The equilibria of a game, the one to choose first (see `equilibrium_shares`)."""

    equilibria: tuple[Equilibrium, ...]
    """Empty when none verified. Of a continuum of equilibria (a degenerate game), some of its corners."""
    went_through_all_supports: bool
    """Otherwise there may be more than are found."""


def equilibrium_shares(ego_payoffs: Floats, non_ego_payoffs: Floats) -> tuple[Floats, Floats]:
    """The shares [E] and [N] of one verified equilibrium of the game [E, N], always the same one.

    Of those found it is the one with the highest ego payoff, of equals the one whose ego shares, then non-ego shares,
    come first where strategies are in the order given and more of an earlier one comes before less.

    Raises NoEquilibrium when none verifies, ValueError when the matrices are no game.
    """
    found = solve(ego_payoffs, non_ego_payoffs).equilibria
    if not found:
        raise NoEquilibrium("none of the candidate equilibria held when it was verified")
    return found[0].ego_shares, found[0].non_ego_shares


def regrets(ego_payoffs: Floats, non_ego_payoffs: Floats, at: Equilibrium) -> tuple[float, float]:
    """What ego and non-ego would gain by their best pure strategy, in their own payoffs; never below 0."""
    against_non_ego, against_ego = ego_payoffs @ at.non_ego_shares, at.ego_shares @ non_ego_payoffs
    ego = against_non_ego.max() - at.ego_shares @ against_non_ego
    non_ego = against_ego.max() - against_ego @ at.non_ego_shares
    return max(float(ego), 0.0), max(float(non_ego), 0.0)


def solve(ego_payoffs: Floats, non_ego_payoffs: Floats) -> Solution:
    """The verified equilibria of the game [E, N] in the order of `equilibrium_shares`.

    Raises ValueError when the matrices differ in shape, are empty, or hold what is no finite number.
    """
    ego_payoffs, non_ego_payoffs = (np.asarray(each, dtype=np.float64) for each in (ego_payoffs, non_ego_payoffs))
    if ego_payoffs.ndim != 2 or ego_payoffs.shape != non_ego_payoffs.shape or ego_payoffs.size == 0:
        raise ValueError(f"two matrices of one shape are no {ego_payoffs.shape} and {non_ego_payoffs.shape}")
    if not (np.isfinite(ego_payoffs).all() and np.isfinite(non_ego_payoffs).all()):
        raise ValueError("a payoff is missing or not finite: such a game can't be solved")
    whole = _scaled(ego_payoffs), _scaled(non_ego_payoffs)
    rows, columns = _undominated(*whole)
    reduced = whole[0][np.ix_(rows, columns)], whole[1][np.ix_(rows, columns)]
    pairs = (2 ** len(rows) - 1) * (2 ** len(columns) - 1)
    few = pairs <= MOST_SUPPORTS
    found: dict[bytes, Equilibrium] = {}

    def keep(candidates: Iterator[tuple[Floats, Floats]]) -> None:
        for x, y in candidates:
            candidate = _whole(x, y, rows, columns, ego_payoffs.shape)
            if candidate is not None and max(regrets(*whole, candidate)) <= TOLERANCE:
                found.setdefault(_rounded(candidate).tobytes(), candidate)

    keep(_pure(reduced[0].shape))
    if few:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # "degenerate": the vertices are gone through anyway
            keep(_by_supports(*reduced))
        keep(_by_vertices(*reduced))
    if not few or not found:
        keep(_by_integer_program(*reduced))
    ordered = sorted(found.values(), key=lambda each: _rank(each, whole[0]))
    return Solution(tuple(ordered), few)


def _scaled(payoffs: Floats) -> Floats:
    """Payoffs from 0 to 1, which changes no equilibrium; all 0 where they are all alike."""
    spread = np.ptp(payoffs)
    return (payoffs - payoffs.min()) / spread if spread > 0 else np.zeros_like(payoffs)


def _rounded(each: Equilibrium) -> Floats:
    return np.concatenate([each.ego_shares, each.non_ego_shares]).round(_DIGITS) + 0.0


def _rank(each: Equilibrium, ego_payoffs: Floats) -> tuple[float, ...]:
    payoff = float(each.ego_shares @ ego_payoffs @ each.non_ego_shares)
    return (-round(payoff, _DIGITS), *(-_rounded(each)).tolist())


def _undominated(ego_payoffs: Floats, non_ego_payoffs: Floats) -> tuple[list[int], list[int]]:
    """Rows and columns that are left when what a pure strategy strictly dominates is left out, again and again."""
    rows, columns = list(range(ego_payoffs.shape[0])), list(range(ego_payoffs.shape[1]))
    while True:
        game = ego_payoffs[np.ix_(rows, columns)], non_ego_payoffs[np.ix_(rows, columns)].T
        kept = [[not (own > strategy + TOLERANCE).all(axis=1).any() for strategy in own] for own in game]
        if all(map(all, kept)):
            return rows, columns
        rows = [row for row, stays in zip(rows, kept[0], strict=True) if stays]
        columns = [column for column, stays in zip(columns, kept[1], strict=True) if stays]


def _whole(x: Floats, y: Floats, rows: list[int], columns: list[int], shape: tuple[int, ...]) -> Equilibrium | None:
    """A candidate of the reduced game as shares of all strategies; None when it is no pair of distributions."""
    sides = []
    for shares, places, strategies in ((x, rows, shape[0]), (y, columns, shape[1])):
        clean = np.clip(np.asarray(shares, dtype=np.float64), 0.0, None)
        if clean.shape != (len(places),) or not np.isfinite(clean).all() or not clean.sum() > 0:
            return None
        side = np.zeros(strategies)
        side[places] = clean / clean.sum()
        sides.append(side)
    return Equilibrium(*sides)


def _pure(shape: tuple[int, ...]) -> Iterator[tuple[Floats, Floats]]:
    for row in range(shape[0]):
        for column in range(shape[1]):
            yield np.eye(shape[0])[row], np.eye(shape[1])[column]


def _by_supports(ego_payoffs: Floats, non_ego_payoffs: Floats) -> Iterator[tuple[Floats, Floats]]:
    from nashpy.algorithms.support_enumeration import support_enumeration

    yield from support_enumeration(ego_payoffs, non_ego_payoffs)


def _by_vertices(ego_payoffs: Floats, non_ego_payoffs: Floats) -> Iterator[tuple[Floats, Floats]]:
    from nashpy.algorithms.vertex_enumeration import vertex_enumeration

    try:  # its polytopes have to be bounded: payoffs above 0
        yield from vertex_enumeration(ego_payoffs + 1.0, non_ego_payoffs + 1.0)
    except (QhullError, np.linalg.LinAlgError, ValueError, IndexError):
        return


def _by_integer_program(ego_payoffs: Floats, non_ego_payoffs: Floats) -> Iterator[tuple[Floats, Floats]]:
    """The equilibrium of the highest ego payoff, of payoffs from 0 to 1: which strategies are played (integers),
    then their shares once more by themselves, for accuracy.

    Variables: x [E], y [N], the players' payoffs v, w, and p [E], q [N]: 1 where a strategy may be played.
    """
    E, N = ego_payoffs.shape
    size = E + N + 2 + E + N
    x, y, v, w = slice(0, E), slice(E, E + N), E + N, E + N + 1
    p, q = slice(E + N + 2, E + N + 2 + E), slice(E + N + 2 + E, size)

    sums = np.zeros((2, size))
    sums[0, x], sums[1, y] = 1.0, 1.0
    constraints = [LinearConstraint(sums, 1.0, 1.0)]
    for count, own, chosen, value, other, payoffs in (
        (E, x, p, v, y, ego_payoffs),
        (N, y, q, w, x, non_ego_payoffs.T),
    ):
        unplayed, regret = np.zeros((count, size)), np.zeros((count, size))
        unplayed[:, own], unplayed[:, chosen] = np.eye(count), -np.eye(count)
        constraints.append(LinearConstraint(unplayed, -np.inf, 0.0))  # a share only where it may be played
        regret[:, other], regret[:, value] = -payoffs, 1.0
        constraints.append(LinearConstraint(regret, 0.0, np.inf))  # nothing earns more than the value
        bounded = regret.copy()
        bounded[:, chosen] = np.eye(count)
        constraints.append(LinearConstraint(bounded, -np.inf, 1.0))  # and what may be played earns it
    objective = np.zeros(size)
    objective[v] = -1.0
    integral = np.zeros(size)
    integral[p] = integral[q] = 1
    answer = milp(objective, integrality=integral, bounds=Bounds(0.0, 1.0), constraints=constraints)
    if answer.x is None:
        return
    played = answer.x[x] > 1e-6, answer.x[y] > 1e-6
    others = _indifferent(ego_payoffs, *played), _indifferent(non_ego_payoffs.T, *played[::-1])
    yield answer.x[x], answer.x[y]
    if others[0] is not None and others[1] is not None:
        yield others[1], others[0]


def _indifferent(payoffs: Floats, own: npt.NDArray[np.bool_], other: npt.NDArray[np.bool_]) -> Floats | None:
    """Shares of the other player's strategies (those in `other`) to which all of `own` are best answers, or None."""
    count = payoffs.shape[1]
    answers = np.hstack([payoffs, -np.ones((len(payoffs), 1))])
    equal = np.vstack([answers[own], np.append(np.ones(count), 0.0)])
    answer = linprog(
        np.zeros(count + 1),
        A_ub=answers[~own] if (~own).any() else None,
        b_ub=np.zeros(int((~own).sum())) if (~own).any() else None,
        A_eq=equal,
        b_eq=np.append(np.zeros(int(own.sum())), 1.0),
        bounds=[(0.0, 1.0 if each else 0.0) for each in other] + [(None, None)],
    )
    return answer.x[:count] if answer.status == 0 else None
