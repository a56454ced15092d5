"""Nash equilibria of a game of two players with finitely many strategies each. Each is verified by its regret.

Payoffs are matrices [E, N]: the ego chooses the row, the non-ego the column. A mixed strategy is an array of shares.
(x, y) is a Nash equilibrium when neither player gains by changing its strategy alone (SafeDriveRL, equation 2):
its regrets, max(A y) - x A y and max(x B) - x B y, are both 0.

Algorithm. Strategies that another pure strategy strictly dominates are in no equilibrium; they are removed first,
repeatedly. Pure equilibria are found by checking every cell. Mixed ones come from nashpy, where there are at most
`MOST_SUPPORTS` pairs of supports: support enumeration, and vertex enumeration, which also finds the corners of a
continuum of equilibria (Nisan et al., "Algorithmic Game Theory", 2007, algorithms 3.4 and 3.5). With more supports, or
when nothing verifies, a mixed-integer program (Sandholm, Gilpin and Conitzer, "Mixed-Integer Programming Methods for
Finding Nash Equilibria", AAAI 2005, formulation 1, by HiGHS) finds the equilibrium of the highest ego payoff. Every
candidate is verified: the regret of a returned equilibrium is at most `TOLERANCE` of its player's range of payoffs, to
the accuracy of the linear programs.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import scipy  # loads its parts at their first use: a worker that solves nothing does without

from harness.game.arrays import BoolArray, FloatArray

TOLERANCE = 1e-7
"""The largest regret of an equilibrium, as a share of the range of its player's payoffs (max - min of the matrix).
The linear programs keep it to `LP_ACCURACY`, and so does the verification."""
MOST_SUPPORTS = 4_000
"""The most pairs of supports that are enumerated: this takes some tenths of a second."""
LP_ACCURACY = 1e-9
"""Feasibility tolerance of the linear programs, on payoffs from 0 to 1."""
COARSE_DIGITS = 5
"""Digits of the payoffs from 0 to 1 in the integer program. HiGHS keeps its constraints to 1e-6: payoffs that differ by
less than about that make it report an equilibrium that does not verify, or no solution at all."""
SLACK = 2e-5
"""A strategy may be played in the integer program if it earns at most this much less than the best one: twice the
rounding of the payoffs."""
VALUE_ACCURACY = 1e-4
"""Accuracy of the highest ego payoff in the integer program (the default relative gap of HiGHS)."""
MOST_CHOICES = 50
"""The most choices of strategies that are tried with the integer program."""
_DIGITS = 6
"""Equilibria whose shares agree to this many digits are the same."""


class Equilibrium(NamedTuple):
    """Shares of the ego's strategies [E] and of the non-ego's strategies [N]; each sums to 1."""

    ego_shares: FloatArray
    non_ego_shares: FloatArray


def regrets(ego_payoffs: FloatArray, non_ego_payoffs: FloatArray, at: Equilibrium) -> tuple[float, float]:
    """The gain of ego and non-ego by their best pure strategies, each in its own payoff; never below 0."""
    against_non_ego, against_ego = ego_payoffs @ at.non_ego_shares, at.ego_shares @ non_ego_payoffs
    ego = against_non_ego.max() - at.ego_shares @ against_non_ego
    non_ego = against_ego.max() - against_ego @ at.non_ego_shares
    return max(float(ego), 0.0), max(float(non_ego), 0.0)


def solve(ego_payoffs: FloatArray, non_ego_payoffs: FloatArray) -> list[Equilibrium]:
    """The verified equilibria of the game [E, N], the one with the highest ego payoff first; empty when none verified:
    every finite game has one (Nash 1950), but the numerical accuracy is too low. Among equal payoffs the first is the
    one with larger shares, when the ego's, then the non-ego's, are compared in the order of the strategies.

    Of a continuum of equilibria (a degenerate game) they are some corners. There may be more of a game with more than
    `MOST_SUPPORTS` pairs of supports.

    Raises ValueError when the matrices differ in shape, are empty, or contain a number that is not finite.
    """
    ego_payoffs, non_ego_payoffs = (np.asarray(each, dtype=np.float64) for each in (ego_payoffs, non_ego_payoffs))
    if ego_payoffs.ndim != 2 or ego_payoffs.shape != non_ego_payoffs.shape or ego_payoffs.size == 0:
        raise ValueError(f"two matrices of one shape are needed, not {ego_payoffs.shape} and {non_ego_payoffs.shape}")
    if not (np.isfinite(ego_payoffs).all() and np.isfinite(non_ego_payoffs).all()):
        raise ValueError("a payoff is missing or not finite: the game can't be solved")
    game = scaled(ego_payoffs), scaled(non_ego_payoffs)
    rows, columns = _undominated(*game)
    reduced = game[0][np.ix_(rows, columns)], game[1][np.ix_(rows, columns)]
    few = (2 ** len(rows) - 1) * (2 ** len(columns) - 1) <= MOST_SUPPORTS
    found: dict[bytes, Equilibrium] = {}

    def add_verified(candidates: Iterator[tuple[FloatArray, FloatArray]]) -> None:
        for x, y in candidates:
            candidate = _of_all_strategies(x, y, rows, columns, ego_payoffs.shape)
            if candidate is not None and max(regrets(*game, candidate)) <= TOLERANCE + 2 * LP_ACCURACY:
                found.setdefault(_rounded(candidate).tobytes(), candidate)

    add_verified(_pure(reduced[0].shape))
    if few:
        add_verified(_by_supports(*reduced))
        add_verified(_by_vertices(*reduced))
    if not few or not found:
        add_verified(_by_integer_program(*reduced))
    return sorted(found.values(), key=lambda each: _rank(each, game[0]))


def scaled(payoffs: FloatArray) -> FloatArray:
    """Payoffs scaled to 0..1, which changes no equilibrium; all 0 where they are all equal."""
    spread = np.ptp(payoffs)
    return (payoffs - payoffs.min()) / spread if spread > 0 else np.zeros_like(payoffs)


def _rounded(each: Equilibrium) -> FloatArray:
    return np.concatenate(each).round(_DIGITS) + 0.0


def _rank(each: Equilibrium, ego_payoffs: FloatArray) -> tuple[float, ...]:
    payoff = float(each.ego_shares @ ego_payoffs @ each.non_ego_shares)
    return (-round(payoff, _DIGITS), *(-_rounded(each)).tolist())


def _undominated(ego_payoffs: FloatArray, non_ego_payoffs: FloatArray) -> tuple[list[int], list[int]]:
    """The rows and columns that remain after strategies strictly dominated by a pure one are removed repeatedly."""
    rows, columns = list(range(ego_payoffs.shape[0])), list(range(ego_payoffs.shape[1]))
    while True:
        game = ego_payoffs[np.ix_(rows, columns)], non_ego_payoffs[np.ix_(rows, columns)].T
        undominated = [[not (own > strategy + TOLERANCE).all(axis=1).any() for strategy in own] for own in game]
        if all(map(all, undominated)):
            return rows, columns
        rows = [row for row, stays in zip(rows, undominated[0], strict=True) if stays]
        columns = [column for column, stays in zip(columns, undominated[1], strict=True) if stays]


def _of_all_strategies(
    x: FloatArray, y: FloatArray, rows: list[int], columns: list[int], shape: tuple[int, ...]
) -> Equilibrium | None:
    """A candidate of the reduced game as shares of all strategies; None when it is not a pair of distributions."""
    sides = []
    for shares, places, strategies in ((x, rows, shape[0]), (y, columns, shape[1])):
        clean = np.clip(np.asarray(shares, dtype=np.float64), 0.0, None)
        if clean.shape != (len(places),) or not np.isfinite(clean).all() or not clean.sum() > 0:
            return None
        side = np.zeros(strategies)
        side[places] = clean / clean.sum()
        sides.append(side)
    return Equilibrium(ego_shares=sides[0], non_ego_shares=sides[1])


def _pure(shape: tuple[int, ...]) -> Iterator[tuple[FloatArray, FloatArray]]:
    for row, column in np.ndindex(shape):
        yield np.eye(shape[0])[row], np.eye(shape[1])[column]


def _by_supports(ego_payoffs: FloatArray, non_ego_payoffs: FloatArray) -> Iterator[tuple[FloatArray, FloatArray]]:
    from nashpy.algorithms.support_enumeration import support_enumeration

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # "degenerate": the vertices are enumerated anyway
        yield from list(support_enumeration(ego_payoffs, non_ego_payoffs))


def _by_vertices(ego_payoffs: FloatArray, non_ego_payoffs: FloatArray) -> Iterator[tuple[FloatArray, FloatArray]]:
    from nashpy.algorithms.vertex_enumeration import vertex_enumeration

    try:  # its polytopes must be bounded: payoffs above 0
        yield from vertex_enumeration(ego_payoffs + 1.0, non_ego_payoffs + 1.0)
    except (scipy.spatial.QhullError, np.linalg.LinAlgError, ValueError, IndexError):
        return


def _by_integer_program(
    ego_payoffs: FloatArray, non_ego_payoffs: FloatArray
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Candidates for the equilibrium of the highest ego payoff, to `VALUE_ACCURACY`, of payoffs from 0 to 1.

    The integer program chooses which strategies may be played, on payoffs of `COARSE_DIGITS` and with a `SLACK`, so
    that every equilibrium to `TOLERANCE` is a solution of it in spite of the accuracy of HiGHS. Linear programs then
    compute the shares to `TOLERANCE`. A choice without such shares, or with a lower payoff than the program's, is
    excluded and the program is solved again, at most `MOST_CHOICES` times.

    Variables: x [E], y [N], the players' payoffs v, w, and p [E], q [N]: 1 where a strategy may be played.
    """
    E, N = ego_payoffs.shape
    size = E + N + 2 + E + N
    x, y, v, w = slice(0, E), slice(E, E + N), E + N, E + N + 1
    p, q = slice(E + N + 2, E + N + 2 + E), slice(E + N + 2 + E, size)

    sums = np.zeros((2, size))
    sums[0, x], sums[1, y] = 1.0, 1.0
    constraints = [scipy.optimize.LinearConstraint(sums, 1.0, 1.0)]
    for count, own, chosen, value, other, payoffs in (
        (E, x, p, v, y, ego_payoffs.round(COARSE_DIGITS)),
        (N, y, q, w, x, non_ego_payoffs.T.round(COARSE_DIGITS)),
    ):
        unplayed, regret = np.zeros((count, size)), np.zeros((count, size))
        unplayed[:, own], unplayed[:, chosen] = np.eye(count), -np.eye(count)
        # a share only where it may be played
        constraints.append(scipy.optimize.LinearConstraint(unplayed, -np.inf, 0.0))
        regret[:, other], regret[:, value] = -payoffs, 1.0
        constraints.append(scipy.optimize.LinearConstraint(regret, 0.0, np.inf))  # nothing earns more than the value
        bounded = regret.copy()
        bounded[:, chosen] = np.eye(count)
        # what may be played earns it
        constraints.append(scipy.optimize.LinearConstraint(bounded, -np.inf, 1.0 + SLACK))
    objective = np.zeros(size)
    objective[v] = -1.0
    integral = np.zeros(size)
    integral[p] = integral[q] = 1
    highest = -np.inf
    for _ in range(MOST_CHOICES):
        answer = scipy.optimize.milp(
            objective, integrality=integral, bounds=scipy.optimize.Bounds(0.0, 1.0), constraints=constraints
        )
        if answer.x is None or highest >= answer.x[v] - VALUE_ACCURACY:
            return
        yield answer.x[x], answer.x[y]
        rows, columns = answer.x[p] > 0.5, answer.x[q] > 0.5
        y_shares = _indifferent(ego_payoffs, rows, columns, highest=True)
        x_shares = _indifferent(non_ego_payoffs.T, columns, rows, highest=False)
        if x_shares is not None and y_shares is not None:
            yield x_shares, y_shares
            highest = max(highest, float(x_shares @ ego_payoffs @ y_shares))
            if highest >= answer.x[v] - VALUE_ACCURACY:
                return
        choice = np.zeros(size)
        choice[p], choice[q] = np.where(rows, 1.0, -1.0), np.where(columns, 1.0, -1.0)
        constraints.append(scipy.optimize.LinearConstraint(choice, -np.inf, float(rows.sum() + columns.sum()) - 1.0))


def _indifferent(payoffs: FloatArray, own: BoolArray, other: BoolArray, highest: bool) -> FloatArray | None:
    """Shares of the other player's strategies (only those in `other`) to which all of `own` are best responses, to
    `TOLERANCE`; None where there are none. With `highest`, the shares at which the best responses earn most."""
    count = payoffs.shape[1]
    gains = np.hstack([payoffs, -np.ones((len(payoffs), 1))])
    answer = scipy.optimize.linprog(
        np.append(np.zeros(count), -float(highest)),
        A_ub=np.vstack([gains, -gains[own]]),
        b_ub=np.append(np.zeros(len(payoffs)), np.full(int(own.sum()), TOLERANCE)),
        A_eq=np.append(np.ones(count), 0.0)[None],
        b_eq=[1.0],
        bounds=[(0.0, 1.0 if each else 0.0) for each in other] + [(0.0, 1.0)],
        options={"primal_feasibility_tolerance": LP_ACCURACY, "dual_feasibility_tolerance": LP_ACCURACY},
    )
    return answer.x[:count] if answer.status == 0 else None
