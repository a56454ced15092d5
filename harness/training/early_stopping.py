"""Early convergence: training stops when the learning curve has stopped rising."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

LATEST = 6
"""Segments in each of the two windows that are compared."""
LEAST = 2 * LATEST
"""Segments before training may stop."""
TOLERANCE = 0.01
"""Rise that counts as none, as a share of the span of the curve."""

MOST_FAILURES = 0.5
"""Share of failures above which a flat curve is no convergence: nothing has been learned that could converge."""

RULE = (
    f"stop when the mean payoff of the latest {LATEST} segments is above that of the {LATEST} before by no more than "
    f"{TOLERANCE:.0%} of the span between the worst and the best segment so far, leaving out segments before attention "
    f"lapses; not while more than {MOST_FAILURES:.0%} of the games without another player fail in the latest {LATEST}; "
    "then train on while the deviation of the actions becomes narrow"
)


def has_converged(segment_payoffs: Sequence[float]) -> bool:
    """Whether a training may stop by `RULE`, given the mean payoff of each segment so far. False before `LEAST`.

    A segment in which no game ended has a mean that is not finite; it is ignored.
    """
    segment_payoffs = [payoff for payoff in segment_payoffs if isfinite(payoff)]
    if len(segment_payoffs) < LEAST:
        return False
    latest = sum(segment_payoffs[-LATEST:]) / LATEST
    before = sum(segment_payoffs[-2 * LATEST : -LATEST]) / LATEST
    span = max(segment_payoffs) - min(segment_payoffs)
    return latest - before <= TOLERANCE * span


def still_fails(games: Sequence[int], failures: Sequence[int]) -> bool:
    """Whether a player can't drive yet, given its games without another player in each segment and their failures.

    Only these games count: in the others, a failure may be the opponent's doing, and a selfish player may accept it. A
    training without such games in the latest segments (`alone_share = 0`) is never held back. The bound is far from the
    campaign's for assessment, because training explores.
    """
    latest = sum(games[-LATEST:])
    return latest > 0 and sum(failures[-LATEST:]) > MOST_FAILURES * latest
