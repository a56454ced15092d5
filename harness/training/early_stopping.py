"""The end of a training: it stops when the learning curve has stopped rising, and its actions become narrow before.

While a learner explores, its actions have a wide standard deviation. A driver with fixed decisions takes their mean,
and meets other situations than the learner did. So the upper bound of the deviation falls before a training ends, and
the last updates are made where the driver will be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

from harness.config.training import Training

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


@dataclass(frozen=True, kw_only=True)
class Narrowing:
    """The last part of a training, in steps of it."""

    start: int
    end: int
    wide: float
    """Upper bound of the standard deviation of actions until the start."""
    narrow: float
    """The same at the end."""

    @classmethod
    def of(cls, settings: Training, converged_at: int | None) -> Narrowing:
        """The last part of a training that has converged after so many steps, or has not (None)."""
        steps = round(settings.narrowing_share * settings.steps)
        start = settings.steps - steps if converged_at is None else converged_at
        return cls(start=start, end=start + steps, wide=settings.max_deviation, narrow=settings.final_deviation)

    def largest_deviation(self, steps: int) -> float:
        """The bound after so many steps: it falls by the same factor in steps of equal size."""
        if steps <= self.start:
            return self.wide
        share = min((steps - self.start) / (self.end - self.start), 1.0) if self.end > self.start else 1.0
        return float(self.wide * (self.narrow / self.wide) ** share)
