"""The end of a training: it stops when the learning curve has stopped rising, and its actions become narrow before.

While a learner explores, its actions have a wide standard deviation. A driver with fixed decisions takes their mean,
and meets other situations than the learner did. So the upper bound of the deviation falls before a training ends, and
the last updates are made where the driver will be.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
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
    f"lapses; not while more than {MOST_FAILURES:.0%} of the games on a road without another player fail in the latest "
    f"{LATEST}; "
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


def failing_roads(games: Sequence[Mapping[str, int]], failures: Sequence[Mapping[str, int]]) -> list[str]:
    """The roads on which a player can't drive yet, given the number of its games without another player on each road in
    each segment, and of their failures.

    Only these games count: in the others, a failure may be the opponent's doing, and a selfish player may accept it. A
    training without such games in the latest segments (`alone_share = 0`) is never held back. The bound is far from the
    campaign's for assessment, because training explores.
    """
    played, failed = Counter[str](), Counter[str]()
    for counts, segments in ((played, games), (failed, failures)):
        for each in segments[-LATEST:]:
            counts.update(each)
    return [road for road in played if failed[road] > MOST_FAILURES * played[road]]


def by_road(roads: Iterable[str]) -> dict[str, int]:
    """The number of games on each road, given the road of each game."""
    return dict(Counter(roads))


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
