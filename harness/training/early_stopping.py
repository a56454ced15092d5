"""Early convergence: when a learning curve has settled, more training is not worth its time."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

LATEST = 6
LEAST = 2 * LATEST
TOLERANCE = 0.01

RULE = (
    f"stop when the mean payoff of the latest {LATEST} segments is above that of the {LATEST} before by no more than "
    f"{TOLERANCE:.0%} of the span between the worst and the best segment so far, leaving out segments before attention "
    "lapses"
)


def has_converged(segment_payoffs: Sequence[float]) -> bool:
    """Whether a training is done, by `RULE`, given the mean payoff of each segment so far. Never before `LEAST`.

    A segment in which no game ended has no mean (it is not finite), and does not count.
    """
    segment_payoffs = [payoff for payoff in segment_payoffs if isfinite(payoff)]
    if len(segment_payoffs) < LEAST:
        return False
    latest = sum(segment_payoffs[-LATEST:]) / LATEST
    before = sum(segment_payoffs[-2 * LATEST : -LATEST]) / LATEST
    span = max(segment_payoffs) - min(segment_payoffs)
    return latest - before <= TOLERANCE * span
