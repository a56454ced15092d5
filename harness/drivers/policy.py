"""A learned policy as a driver: the actor's network in NumPy, so that driving needs no framework."""

from __future__ import annotations

import numpy as np

from harness.drivers.policy_file import Policy
from harness.game.arrays import FloatArray, IntArray


class LearnedDriver:
    """Drives by a policy: by its most likely action, or by a sample of its distribution.

    >>> import harness, numpy as np
    >>> driver = harness.LearnedDriver(harness.read_policy("policies/merge/naive-seed1"), sampled=False)
    >>> driver.decide(games=np.arange(3), observation=np.zeros((3, 98)), noise=np.zeros((3, 2))).shape
    (3, 2)
    """

    takes_over = True

    def __init__(self, policy: Policy, sampled: bool) -> None:
        self._layers = [(weight.T.copy(), bias) for weight, bias in policy.layers("actor")]
        self._deviation = np.exp(policy.tensors["log_deviation"]) if sampled else None

    def reset(self, games: IntArray) -> None:
        """Do nothing: each decision depends on the current observation only."""

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """Actions [N, 2] from observations [N, SIZE]; `noise` [N, 2] is used if decisions are sampled."""
        hidden = observation
        for weight, bias in self._layers[:-1]:
            hidden = np.tanh(hidden @ weight + bias)
        weight, bias = self._layers[-1]
        action = hidden @ weight + bias
        if self._deviation is not None:
            action = action + self._deviation * noise
        return np.clip(action, -1.0, 1.0)
