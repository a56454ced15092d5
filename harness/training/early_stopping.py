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

RULE = (
    f"stop when the mean payoff of the latest {LATEST} segments is above that of the {LATEST} before by no more than "
    f"{TOLERANCE:.0%} of the span between the worst and the best segment so far, leaving out segments before attention "
    "lapses"
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
