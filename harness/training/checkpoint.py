"""A PPO learner between two segments, as one safetensors file: parameters, optimiser state, learning curve.

With it a training goes on as if it had never stopped; opening it runs no code.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from stable_baselines3 import PPO

from harness.drivers.policy_file import Policy
from harness.files import write_atomically


@dataclass(frozen=True)
class CurvePoint:
    """A stretch of the learning curve, of the games that ended in it."""

    steps: int
    mean_payoff: float
    failure_rate: float
    games: int
    mean_duration_s: float


@dataclass(frozen=True)
class Progress:
    """How far a training has come."""

    segments: int
    steps: int
    segment_payoffs: list[float]
    curve: list[CurvePoint]


def write_checkpoint(model: PPO, progress: Progress, key: str, path: Path) -> None:
    """Write a learner's checkpoint; `key` names the inputs it was trained from."""
    tensors = {f"policy/{name}": value for name, value in model.policy.state_dict().items()}
    for index, state in model.policy.optimizer.state_dict()["state"].items():
        for name, value in state.items():
            tensors[f"optimizer/{index}/{name}"] = torch.as_tensor(value)
    metadata = {"progress": json.dumps(asdict(progress)), "key": key}
    write_atomically(path, save(tensors, metadata={**metadata, "digest": _digest(tensors, metadata["progress"])}))


def read_checkpoint(model: PPO, key: str, path: Path) -> Progress | None:
    """Put a checkpoint into a freshly made learner. None if there is none, it is damaged, is of another learner than
    this, or from other inputs: the learner is as it was then."""
    if not path.is_file():
        return None
    try:
        with safe_open(path, framework="pt") as file:
            metadata = file.metadata() or {}
            if metadata.get("key") != key:
                return None
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        was = metadata.get("digest")  # there were none at first
        if was is not None and was != _digest(tensors, metadata["progress"]):
            return None
        progress = _progress(metadata["progress"])
    except (SafetensorError, OSError, KeyError, TypeError, ValueError):
        return None
    policy = {name.removeprefix("policy/"): value for name, value in tensors.items() if name.startswith("policy/")}
    state = _optimizer_state(tensors)
    if not _fits(model, policy, state):
        return None
    model.policy.load_state_dict(policy)
    model.policy.optimizer.load_state_dict({**model.policy.optimizer.state_dict(), "state": state})
    return progress


def _progress(text: str) -> Progress:
    """Raises ValueError, TypeError or KeyError where it is none."""
    stored: dict[str, Any] = json.loads(text)
    curve = [CurvePoint(**window) for window in stored["curve"]]
    return Progress(stored["segments"], stored["steps"], stored["segment_payoffs"], curve)


def _optimizer_state(tensors: Mapping[str, torch.Tensor]) -> dict[int, dict[str, torch.Tensor]]:
    """What Adam keeps of each parameter, by its number."""
    state: dict[int, dict[str, torch.Tensor]] = {}
    for name, value in tensors.items():
        part, *place = name.split("/")
        if part == "optimizer" and len(place) == 2 and place[0].isdecimal():
            state.setdefault(int(place[0]), {})[place[1]] = value
    return state


def _fits(model: PPO, policy: Mapping[str, torch.Tensor], optimizer: Mapping[int, Mapping[str, torch.Tensor]]) -> bool:
    """Whether a checkpoint's tensors are those of this learner."""
    own = model.policy.state_dict()
    if {name: value.shape for name, value in policy.items()} != {name: value.shape for name, value in own.items()}:
        return False
    parameters = list(model.policy.parameters())
    return all(
        index < len(parameters)
        and kept.keys() == _OF_ADAM
        and kept["exp_avg"].shape == kept["exp_avg_sq"].shape == parameters[index].shape
        for index, kept in optimizer.items()
    )


_OF_ADAM = {"step", "exp_avg", "exp_avg_sq"}


def _digest(tensors: Mapping[str, torch.Tensor], progress: str) -> str:
    """Of all that a checkpoint holds: a file that a power cut tore can have its old length."""
    digest = hashlib.sha256(progress.encode())
    for name, tensor in sorted(tensors.items()):
        digest.update(f"\n{name} {tensor.dtype} {tuple(tensor.shape)}\n".encode())
        digest.update(tensor.detach().contiguous().numpy().tobytes())
    return digest.hexdigest()


_LAYERS = {"actor": ("mlp_extractor.policy_net", "action_net"), "critic": ("mlp_extractor.value_net", "value_net")}


def policy_of(model: PPO, card: dict[str, Any]) -> Policy:
    """The learner's policy as plain arrays."""
    state = model.policy.state_dict()
    tensors = {"log_deviation": state["log_std"].numpy().copy()}
    for part, (hidden, output) in _LAYERS.items():
        for k, layer in enumerate([*_hidden_layers(state, hidden), output]):
            tensors[f"{part}.{k}.weight"] = state[f"{layer}.weight"].numpy().copy()
            tensors[f"{part}.{k}.bias"] = state[f"{layer}.bias"].numpy().copy()
    return Policy(tensors, card)


def put_policy(model: PPO, policy: Policy, deviation: float) -> None:
    """Begin from a policy's networks, exploring anew with the given deviation. Raises ValueError if they don't fit."""
    state = model.policy.state_dict()
    for part, (hidden, output) in _LAYERS.items():
        layers = [*_hidden_layers(state, hidden), output]
        given = policy.layers(part)
        if len(given) != len(layers):
            raise ValueError(f"the {part} to begin from has {len(given)} layers, this training's has {len(layers)}")
        for layer, (weight, bias) in zip(layers, given, strict=True):
            if state[f"{layer}.weight"].shape != weight.shape:
                raise ValueError(f"the {part} to begin from has other layer sizes than this training's network")
            state[f"{layer}.weight"] = torch.from_numpy(weight.copy())
            state[f"{layer}.bias"] = torch.from_numpy(bias.copy())
    state["log_std"] = torch.full_like(state["log_std"], float(np.log(deviation)))
    model.policy.load_state_dict(state)


def _hidden_layers(state: dict[str, Any], prefix: str) -> list[str]:
    return [name.removesuffix(".weight") for name in state if name.startswith(prefix) and name.endswith(".weight")]
