"""A policy of several personas: its network has one input more for each persona, 1 for the one that drives, else 0.

A persona is the same in every step of a game, so its inputs only add a constant to the first layer: with this constant
in the biases, the policy of one persona is an ordinary policy. Any numbers that describe K personas, such as the
weights of their payoffs and their limits, are a linear function of these K inputs, so that a first layer can learn the
same from either.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from harness.drivers.policy_file import Policy
from harness.game.observation_layout import LAYOUT, SIZE


def layout_of_many(personas: Sequence[str]) -> tuple[str, ...]:
    """The names of the inputs of a policy of several personas."""
    return (*LAYOUT, *(f"persona {name}" for name in personas))


def as_persona(policy: Policy, number: int) -> Policy:
    """The policy of one of several personas, by its place among them."""
    tensors = dict(policy.tensors)
    for part in ("actor", "critic"):
        (weight, bias), *_ = policy.layers(part)
        tensors[f"{part}.0.weight"] = np.ascontiguousarray(weight[:, :SIZE])
        tensors[f"{part}.0.bias"] = bias + weight[:, SIZE + number]
    return Policy(tensors, {**policy.card, "observation": list(LAYOUT)})
