"""The last part of a training, in which its actions become narrow.

While a learner explores, its actions have a wide standard deviation. A driver with fixed decisions takes their mean,
and meets other situations than the learner did. So the upper bound of the deviation falls before a training ends, and
the last updates are made where the driver will be.
"""

from __future__ import annotations

from dataclasses import dataclass

from harness.config.training import Training


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
