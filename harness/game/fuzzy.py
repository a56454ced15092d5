"""Fuzzy terms declared by their membership functions (zero-order Sugeno inference).

The output is the average of the sets' values, weighted by how much the input belongs to each set
(Sugeno, An introductory survey of fuzzy control, Information Sciences 36, 1985).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from harness.game.arrays import FloatArray


@dataclass(frozen=True)
class FuzzySet:
    """Membership rises and falls linearly between points (input, membership in 0..1); constant outside."""

    name: str
    inputs: tuple[float, ...]
    memberships: tuple[float, ...]
    value: float

    def membership(self, value: FloatArray) -> FloatArray:
        """[...] how much inputs [...] belong to the set."""
        return np.interp(value, self.inputs, self.memberships)


@dataclass(frozen=True)
class FuzzyFunction:
    """A function of one quantity of the game, given by fuzzy sets."""

    quantity: str
    sets: tuple[FuzzySet, ...]

    def __call__(self, value: FloatArray) -> FloatArray:
        """[...] value of the function; 0 where the input belongs to no set."""
        memberships = np.stack([each.membership(value) for each in self.sets])
        values = np.array([each.value for each in self.sets]).reshape(-1, *([1] * np.ndim(value)))
        total = memberships.sum(0)
        return np.where(total > 0.0, (memberships * values).sum(0) / np.maximum(total, 1e-12), 0.0)
