"""Small policies: of random parameters, and of one action."""

from __future__ import annotations

import numpy as np

from harness.drivers.policy_file import Policy
from harness.game.arrays import FloatArray
from harness.game.observation_layout import SIZE


def some_policy(seed: int = 0, hidden: int = 5) -> Policy:
    """A policy of one hidden layer, its parameters drawn from the seed."""
    draw = np.random.default_rng(seed)

    def array(*shape: int) -> FloatArray:
        return draw.standard_normal(shape).astype(np.float32)

    tensors = {"log_deviation": array(2)}
    for part, outputs in (("actor", 2), ("critic", 1)):
        tensors |= {f"{part}.0.weight": array(hidden, SIZE), f"{part}.0.bias": array(hidden)}
        tensors |= {f"{part}.1.weight": array(outputs, hidden), f"{part}.1.bias": array(outputs)}
    return Policy(tensors, {"stage": "naive-seed1"})


def constant_policy(pedals: float, wheel: float = 0.0) -> Policy:
    """A policy that does the same whatever it sees."""
    tensors: dict[str, FloatArray] = {"log_deviation": np.zeros(2, dtype=np.float32)}
    for part, outputs in (("actor", [pedals, wheel]), ("critic", [0.0])):
        tensors[f"{part}.0.weight"] = np.zeros((len(outputs), SIZE), dtype=np.float32)
        tensors[f"{part}.0.bias"] = np.array(outputs, dtype=np.float32)
    return Policy(tensors)
