"""Fuzzy functions, declared by membership functions (zero-order Sugeno inference).

The output is the average of the sets' values, weighted by the input's membership in each set (Sugeno, An introductory
survey of fuzzy control, Information Sciences 36, 1985).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from harness.game.arrays import FloatArray
from harness.game.jit import compiled


@dataclass(frozen=True, kw_only=True)
class FuzzySet:
    """A membership function through points (input, membership from 0 to 1), linear between them, constant outside."""

    name: str
    inputs: tuple[float, ...]
    memberships: tuple[float, ...]
    value: float


@dataclass(frozen=True)
class FuzzyFunction:
    """A function of one quantity of the game, defined by fuzzy sets."""

    quantity: str
    sets: tuple[FuzzySet, ...]

    def __call__(self, value: FloatArray) -> FloatArray:
        """[...] values of the function: 0 where the input belongs to no set, NaN where the input is NaN."""
        value = np.asarray(value, dtype=float)
        return _infer(value.ravel(), *self._points, self._values).reshape(value.shape)

    @cached_property
    def _points(self) -> tuple[FloatArray, FloatArray]:
        """[S, N] inputs and memberships of the sets' points; a set with fewer points repeats its last point."""
        most = max(len(each.inputs) for each in self.sets)
        inputs, memberships = (
            [[*points, *[points[-1]] * (most - len(points))] for points in columns]
            for columns in zip(*((each.inputs, each.memberships) for each in self.sets), strict=True)
        )
        return np.array(inputs), np.array(memberships)

    @cached_property
    def _values(self) -> FloatArray:
        return np.array([each.value for each in self.sets])


@compiled
def _infer(value: FloatArray, inputs: FloatArray, memberships: FloatArray, values: FloatArray) -> FloatArray:
    result = np.zeros(value.shape)
    for n in range(len(value)):
        total, weighted = 0.0, 0.0
        for k in range(len(values)):
            membership = np.interp(value[n], inputs[k], memberships[k])
            total += membership
            weighted += membership * values[k]
        if not total <= 0.0:
            result[n] = weighted / total
    return result
