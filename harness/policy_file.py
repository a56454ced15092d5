"""A learned policy on disk: parameters as safetensors, the rest as JSON. Opening one runs no code.

<name>/policy.safetensors    actor.<k>.weight [out, in], actor.<k>.bias [out], log_deviation [2]; critic likewise
<name>/policy.json           format, what was learned where, the names of the observation's entries
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import load as load_tensors
from safetensors.numpy import save as save_tensors

from harness.errors import UsageError
from harness.files import write_atomically
from harness.game.arrays import FloatArray
from harness.game.observation import LAYOUT

FORMAT = 1
ACTIONS = 2
_LARGEST_BYTES = 100_000_000


@dataclass(frozen=True)
class Policy:
    """Actor and critic as plain arrays: layers with tanh between them, and the actions' log deviation [2]."""

    tensors: Mapping[str, FloatArray]
    card: Mapping[str, Any] = field(default_factory=dict)

    def layers(self, part: str) -> list[tuple[FloatArray, FloatArray]]:
        """Weights [out, in] and biases [out] of `actor` or `critic`, in order."""
        count = sum(name.startswith(f"{part}.") and name.endswith(".weight") for name in self.tensors)
        return [(self.tensors[f"{part}.{k}.weight"], self.tensors[f"{part}.{k}.bias"]) for k in range(count)]


def write_policy(policy: Policy, folder: Path) -> None:
    """Write a policy's folder. The same policy gives the same bytes."""
    folder.mkdir(parents=True, exist_ok=True)
    card_file, tensor_file = policy_files(folder)
    card = {"format": FORMAT, "observation": list(LAYOUT), **policy.card}
    write_atomically(
        tensor_file,
        save_tensors({k: np.ascontiguousarray(v) for k, v in policy.tensors.items()}),
    )
    write_atomically(card_file, (json.dumps(card, indent=2) + "\n").encode())


def policy_files(folder: Path) -> tuple[Path, Path]:
    """What a policy is made of: its JSON and its parameters."""
    return folder / "policy.json", folder / "policy.safetensors"


def read_policy(folder: Path) -> Policy:
    """Read a policy's folder. Raises UsageError if it is missing, damaged, or was made for other observations."""
    card_file, tensor_file = policy_files(folder)
    for file in (card_file, tensor_file):
        if not file.is_file():
            raise UsageError.of(
                file, "", "there is no such file", "name the folder of a policy, as under <run>/policies/"
            )
        if file.stat().st_size > _LARGEST_BYTES:
            raise UsageError.of(file, "", "is too large to be a policy of ours", "name the folder of a policy")
    try:
        card = json.loads(card_file.read_text(encoding="utf-8"))
        version, layout = card["format"], card["observation"]
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise UsageError.of(card_file, "", f"is damaged: {error!r}", "train the policy again") from None
    if version != FORMAT or layout != list(LAYOUT):
        raise UsageError.of(
            card_file,
            "observation",
            "was learned from other observations than this version's",
            "train it again",
        )
    try:
        tensors = load_tensors(tensor_file.read_bytes())
        policy = Policy(tensors, card)
        _check_shapes(policy)
    except (SafetensorError, ValueError, KeyError, IndexError) as error:
        raise UsageError.of(tensor_file, "", f"is damaged: {error}", "train the policy again") from None
    return policy


def _check_shapes(policy: Policy) -> None:
    for part, outputs in (("actor", ACTIONS), ("critic", 1)):
        width = len(LAYOUT)
        for weight, bias in policy.layers(part):
            if weight.ndim != 2 or weight.shape[1] != width or bias.shape != weight.shape[:1]:
                raise ValueError(f"the {part}'s layers do not fit each other")
            width = weight.shape[0]
        if width != outputs:
            raise ValueError(f"the {part} has {width} outputs, not {outputs}")
    if policy.tensors["log_deviation"].shape != (ACTIONS,):
        raise ValueError("log_deviation does not fit the actions")
    for name, tensor in policy.tensors.items():
        if tensor.dtype != np.float32:
            raise ValueError(f"{name} is {tensor.dtype}, not float32")
        if not np.isfinite(tensor).all():
            raise ValueError(f"{name} is not finite")
