"""A policy of several personas: its network has one input more for each persona, 1 for the one that drives, else 0.

A persona is the same in every step of a game, so its inputs only add a constant to the first layer: with this constant
in the biases, the policy of one persona is an ordinary policy. Any numbers that describe K personas, such as the
weights of their payoffs and their limits, are a linear function of these K inputs, so that a first layer can learn the
same from either.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from harness.config.persona import Persona
from harness.drivers.policy_file import Policy, persona_hash, policy_files, read_card, read_policy
from harness.errors import UsageError
from harness.game.observation_layout import LAYOUT, SIZE


def card_of_many(personas: Sequence[Persona]) -> dict[str, Any]:
    """The part of a card that says whose policy it is: each persona with its hash, and the names of the inputs."""
    hashes = {each.name: persona_hash(each) for each in personas}
    return {"personas": hashes, "observation": _layout(hashes)}


def personas_in(card: dict[str, Any]) -> dict[str, str]:
    """The personas of a policy of several, with their hashes; of other policies none."""
    found = card.get("personas")
    return found if isinstance(found, dict) and all(isinstance(each, str) for each in found.values()) else {}


def read_policy_of_many(folder: Path) -> Policy:
    """Read the folder of a policy of several personas. Raises UsageError as `read_policy` does, and for a policy of
    one."""
    personas = personas_in(read_card(folder))
    if not personas:
        message, remedy = "is not a policy of several personas", "leave out non_ego_training.together"
        raise UsageError.of(policy_files(folder)[0], "personas", message, remedy)
    return read_policy(folder, _layout(personas))


def as_persona(policy: Policy, persona: str) -> Policy:
    """The policy of one of several personas."""
    column = SIZE + list(policy.card["personas"]).index(persona)
    tensors = dict(policy.tensors)
    for part in ("actor", "critic"):
        (weight, bias), *_ = policy.layers(part)
        tensors[f"{part}.0.weight"] = np.ascontiguousarray(weight[:, :SIZE])
        tensors[f"{part}.0.bias"] = bias + weight[:, column]
    card = {key: value for key, value in policy.card.items() if key != "personas"}
    return Policy(tensors, {**card, "observation": list(LAYOUT)})


def _layout(personas: Iterable[str]) -> list[str]:
    return [*LAYOUT, *(f"persona {name}" for name in personas)]
