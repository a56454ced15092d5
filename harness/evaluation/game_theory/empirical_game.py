"""The empirical game: equilibria, dominated strategies and the safest mixture of a cross-play table.

For each seed and persona the egos and that persona's strategies (its rounds) are a game of two players, with the mean
payoffs of the cross-play as its matrix (M. P. Wellman, "Methods for Empirical Game-Theoretic Analysis", AAAI 2006). Its
equilibria hold among these strategies only, and for means over a sample of games. Different personas do not share a
payoff, so there is no such game of all of them; the game "all" has the egos that are dominated against every non-ego,
and the safest mixture of egos, which uses failure rates only.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
import pandas as pd
import scipy  # loads its parts at their first use: a worker that solves nothing does without

from harness.evaluation.game_theory.nash import Equilibrium, regrets, scaled, solve
from harness.evaluation.tables import table_of
from harness.game.arrays import FloatArray

ALL = "all"
"""The game of every non-ego."""
MARGIN = 1e-9
"""A smaller difference counts as none: the accuracy of the linear programs, on payoffs scaled to a range of 1."""


class SolutionKind(str, Enum):
    """Every value the column `solution` can have."""

    NASH = "nash"
    SAFEST = "safest"
    NOT_VERIFIED = "none verified"
    """No candidate equilibrium was verified by its regrets: an equilibrium exists, but was not found."""
    NOT_PLAYED = "left out: not played against all"
    """A strategy with an empty cell is not part of this game."""


@dataclass(frozen=True, kw_only=True)
class _Game:
    """The strategies that were measured against all of the other side, and their means [E, N]."""

    egos: list[str]
    non_egos: list[str]
    failure_rate: FloatArray
    ego_payoff: FloatArray
    non_ego_payoff: FloatArray


def equilibria(crossplay: pd.DataFrame) -> pd.DataFrame:
    """The solutions of every seed's games, the table `equilibria`, from a table of `crossplay`.

    A strategy that was not measured against every strategy of the other side is left out of the game, with a row of
    kind `NOT_PLAYED`. A non-ego without any measured cell is left out itself; the egos stay.
    """
    rows: list[dict[str, object]] = []
    for seed, found in crossplay.groupby("seed", sort=False):
        for persona in dict.fromkeys(filter(None, found["persona"])):
            game, left_out = _game(found, found["persona"] == persona, ["failure_rate", "ego_payoff", "non_ego_payoff"])
            rows.extend({"seed": seed, "game": persona, **row} for row in (*_nash(game), *left_out))
        game, left_out = _game(found, found["persona"].notna(), ["failure_rate", "ego_payoff"])
        rows.extend({"seed": seed, "game": ALL, **row} for row in (*_safest(game), *left_out))
    return table_of("equilibria", rows)


def _game(found: pd.DataFrame, asked: pd.Series, needed: Sequence[str]) -> tuple[_Game, list[dict[str, object]]]:
    """The game of all egos and the non-egos of the rows that are asked for, as far as the needed columns are measured,
    and rows for the strategies left out."""
    egos, non_egos = found["ego"].unique(), found.loc[asked, "non_ego"].unique()
    cells = found.set_index(["ego", "non_ego"])
    tables = {
        name: cells[name].unstack("non_ego").reindex(index=egos, columns=non_egos)
        for name in ("failure_rate", "ego_payoff", "non_ego_payoff")
    }
    measured = pd.concat([tables[name].notna() for name in needed]).groupby(level=0, sort=False).all()
    there = measured.any(axis=0)
    complete = measured.loc[:, there].all(axis=1) & there.any()
    there &= complete.any()
    part = {name: table.loc[complete, there].to_numpy(float) for name, table in tables.items()}
    left_out = [("ego", name) for name in egos[~complete]] + [("non_ego", name) for name in non_egos[~there]]
    game = _Game(egos=egos[complete].tolist(), non_egos=non_egos[there].tolist(), **part)
    return game, [{"solution": SolutionKind.NOT_PLAYED.value, "role": role, "player": name} for role, name in left_out]


def _nash(game: _Game) -> Iterator[dict[str, Any]]:
    if not game.egos:
        return
    non_egos = zip(game.non_egos, dominated(game.non_ego_payoff.T, game.non_egos), strict=True)
    strategies = _egos(game)
    strategies += [{"role": "non_ego", "player": name, "dominated_in_payoff": payoff} for name, payoff in non_egos]
    found = solve(game.ego_payoff, game.non_ego_payoff)
    for number, each in enumerate(found, 1):
        for strategy, cells in zip(strategies, _played(game, each), strict=True):
            yield strategy | cells | {"solution": SolutionKind.NASH.value, "number": number}
    if not found:
        yield from (strategy | {"solution": SolutionKind.NOT_VERIFIED.value} for strategy in strategies)


def _egos(game: _Game) -> list[dict[str, object]]:
    in_payoff, in_failures = (dominated(each, game.egos) for each in (game.ego_payoff, -game.failure_rate))
    return [
        {"role": "ego", "player": name, "dominated_in_payoff": payoff, "dominated_in_failures": failures}
        for name, payoff, failures in zip(game.egos, in_payoff, in_failures, strict=True)
    ]


def _played(game: _Game, at: Equilibrium) -> Iterator[dict[str, float]]:
    """The cells of each ego, then of each non-ego, in an equilibrium."""
    x, y = at.ego_shares, at.non_ego_shares
    ego_regret, non_ego_regret = regrets(game.ego_payoff, game.non_ego_payoff, at)
    for shares, payoffs, failures, regret in (
        (x, game.ego_payoff @ y, game.failure_rate @ y, ego_regret),
        (y, x @ game.non_ego_payoff, x @ game.failure_rate, non_ego_regret),
    ):
        for share, payoff, failure_rate in zip(shares, payoffs, failures, strict=True):
            yield {
                "share": share,
                "payoff": payoff,
                "solution_payoff": float(shares @ payoffs),
                "regret": regret,
                "failure_rate": failure_rate,
                "solution_failure_rate": float(x @ game.failure_rate @ y),
            }


def _safest(game: _Game) -> Iterator[dict[str, object]]:
    if not game.egos:
        return
    shares = safest_mixture(game.failure_rate)
    against = shares @ game.failure_rate
    kind = {"solution": SolutionKind.SAFEST.value, "solution_failure_rate": float(against.max())}
    for row, share, rates in zip(_egos(game), shares, game.failure_rate, strict=True):
        yield kind | row | {"share": share, "failure_rate": rates.max()}
    for name, rate in zip(game.non_egos, against, strict=True):
        yield kind | {"role": "non_ego", "player": name, "failure_rate": rate}


# --- dominated strategies, and the safest mixture: exact for the games that were played, no test ---


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
