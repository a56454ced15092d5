"""A PPO learner between two segments, as one safetensors file: parameters, optimiser state, learning curve.

A training that continues from a checkpoint gives the same policy as an uninterrupted one. Opening a checkpoint runs no
code.
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

_OPTIMIZER_ENTRIES = {"step", "exp_avg", "exp_avg_sq"}  # the state of Adam per parameter


@dataclass(frozen=True, kw_only=True)
class CurvePoint:
    """A window of the learning curve, and the games that ended in it."""

    steps: int
    """Steps of the training at the end of the window."""
    mean_payoff: float
    failure_rate: float
    games: int
    mean_duration_s: float


@dataclass(frozen=True, kw_only=True)
class Progress:
    """The progress of a training."""

    segments: int
    steps: int
    segment_payoffs: list[float]
    """Mean payoff of each segment; -inf if no game ended in it."""
    curve: list[CurvePoint]
    alone_games: list[int]
    """Games of each segment without another player."""
    alone_failures: list[int]
    """Those of them that did not end at the goal."""
    converged_at: int | None = None
    """Steps after which the curve had converged; None: it had not."""


@dataclass(frozen=True, kw_only=True)
class _Content:
    """The content of a checkpoint's file."""

    progress: Progress
    policy: Mapping[str, torch.Tensor]
    optimizer: Mapping[int, Mapping[str, torch.Tensor]]


def write_checkpoint(model: PPO, progress: Progress, key: str, path: Path) -> None:
    """Write a learner's checkpoint; `key` identifies the inputs of the training."""
    tensors = {f"policy/{name}": value for name, value in model.policy.state_dict().items()}
    for index, state in model.policy.optimizer.state_dict()["state"].items():
        for name, value in state.items():
            tensors[f"optimizer/{index}/{name}"] = torch.as_tensor(value)
    metadata = {"progress": json.dumps(asdict(progress)), "key": key}
    write_atomically(path, save(tensors, metadata={**metadata, "digest": _digest(tensors, metadata["progress"])}))


def read_checkpoint(model: PPO, key: str, path: Path) -> Progress | None:
    """Load a checkpoint into a new learner. Returns None, and leaves the learner unchanged, if there is no usable
    checkpoint: the file is missing or damaged, has another `key`, or its tensors are not those of this learner."""
    if not path.is_file():
        return None
    try:
        content = _read(path, key)
    # Raised for damaged files, wrong metadata, invalid names of tensors, and number types that NumPy or PyTorch lacks.
    except (SafetensorError, OSError, LookupError, TypeError, ValueError, AttributeError, RecursionError):
        return None
    if content is None or not _fits(model, content):
        return None
    model.policy.load_state_dict(content.policy)
    optimizer = model.policy.optimizer
    optimizer.load_state_dict({**optimizer.state_dict(), "state": content.optimizer})
    return content.progress


def _read(path: Path, key: str) -> _Content | None:
    """The content of a checkpoint; None: it has another key, or its digest does not match.

    Raises ValueError or another of the exceptions that `read_checkpoint` catches if the content is malformed.
    """
    with safe_open(path, framework="pt") as file:
        metadata = file.metadata() or {}
        if metadata.get("key") != key:
            return None
        tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
    digest = metadata.get("digest")  # files of the first versions have none
    if digest is not None and digest != _digest(tensors, metadata["progress"]):
        return None
    policy: dict[str, torch.Tensor] = {}
    optimizer: dict[int, dict[str, torch.Tensor]] = {}
    for name, value in tensors.items():
        part, _, rest = name.partition("/")
        if part == "policy":
            policy[rest] = value
        elif part == "optimizer":
            index, _, entry = rest.partition("/")
            optimizer.setdefault(int(index), {})[entry] = value
        else:
            raise ValueError(f"unknown tensor {name!r}")
    return _Content(progress=_progress(metadata["progress"]), policy=policy, optimizer=optimizer)


def _progress(text: str) -> Progress:
    """Raises ValueError, TypeError, LookupError or RecursionError if the text is malformed."""
    stored = json.loads(text)
    curve = [CurvePoint(**window) for window in stored["curve"]]
    progress = Progress(
        segments=stored["segments"],
        steps=stored["steps"],
        segment_payoffs=stored["segment_payoffs"],
        curve=curve,
        alone_games=stored["alone_games"],
        alone_failures=stored["alone_failures"],
        converged_at=stored["converged_at"],
    )
    counts = [progress.segments, progress.steps, *(count for each in curve for count in (each.steps, each.games))]
    counts += [*progress.alone_games, *progress.alone_failures, progress.converged_at or 0]
    numbers = [
        *progress.segment_payoffs,
        *(number for each in curve for number in (each.mean_payoff, each.failure_rate, each.mean_duration_s)),
    ]
    if not all(type(each) is int and each >= 0 for each in counts) or not all(type(each) is float for each in numbers):
        raise ValueError("a count or a number of the progress has another type")
    for series in (progress.segment_payoffs, progress.alone_games, progress.alone_failures):
        if not isinstance(series, list) or len(series) != progress.segments:
            raise ValueError("the progress does not have a list with an entry for each segment")
    return progress


def _fits(model: PPO, content: _Content) -> bool:
    """Whether the tensors of a checkpoint have the names, shapes and number types of this learner's."""
    own = model.policy.state_dict()
    parameters = dict(enumerate(model.policy.parameters()))
    if content.policy.keys() != own.keys() or content.optimizer.keys() != parameters.keys():
        return False
    return all(
        _alike(value, own[name]) and bool(torch.isfinite(value).all()) for name, value in content.policy.items()
    ) and all(
        state.keys() == _OPTIMIZER_ENTRIES
        and state["step"].shape == ()
        and state["step"].dtype == torch.float32
        and _alike(state["exp_avg"], parameters[index])
        and _alike(state["exp_avg_sq"], parameters[index])
        for index, state in content.optimizer.items()
    )


def _alike(one: torch.Tensor, other: torch.Tensor) -> bool:
    return one.shape == other.shape and one.dtype == other.dtype


def _digest(tensors: Mapping[str, torch.Tensor], progress: str) -> str:
    """SHA-256 of the content. It detects a file of the right length that a power failure has left incomplete."""
    digest = hashlib.sha256(progress.encode())
    for name, tensor in sorted(tensors.items()):
        digest.update(f"\n{name} {tensor.dtype} {tuple(tensor.shape)}\n".encode())
        digest.update(tensor.detach().contiguous().numpy().tobytes())
    return digest.hexdigest()


_LAYERS = {"actor": ("mlp_extractor.policy_net", "action_net"), "critic": ("mlp_extractor.value_net", "value_net")}


def policy_of(model: PPO, card: dict[str, Any]) -> Policy:
    """The learner's policy as arrays, with the metadata `card`."""
    state = model.policy.state_dict()
    tensors = {"log_deviation": state["log_std"].numpy().copy()}
    for part, (hidden, output) in _LAYERS.items():
        for k, layer in enumerate([*_hidden_layers(state, hidden), output]):
            tensors[f"{part}.{k}.weight"] = state[f"{layer}.weight"].numpy().copy()
            tensors[f"{part}.{k}.bias"] = state[f"{layer}.bias"].numpy().copy()
    return Policy(tensors, card)


def put_policy(model: PPO, policy: Policy, deviation: float) -> None:
    """Copy a policy's networks into a learner, and set the standard deviation of its actions to `deviation`. Raises
    ValueError if the networks do not fit."""
    state = model.policy.state_dict()
    for part, (hidden, output) in _LAYERS.items():
        layers = [*_hidden_layers(state, hidden), output]
        initial = policy.layers(part)
        if len(initial) != len(layers):
            raise ValueError(f"the initial {part} has {len(initial)} layers, this training's has {len(layers)}")
        for layer, (weight, bias) in zip(layers, initial, strict=True):
            if state[f"{layer}.weight"].shape != weight.shape:
                raise ValueError(f"the initial {part} has other layer sizes than this training's network")
            state[f"{layer}.weight"] = torch.from_numpy(weight.copy())
            state[f"{layer}.bias"] = torch.from_numpy(bias.copy())
    state["log_std"] = torch.full_like(state["log_std"], float(np.log(deviation)))
    model.policy.load_state_dict(state)


def _hidden_layers(state: dict[str, Any], prefix: str) -> list[str]:
    return [name.removesuffix(".weight") for name in state if name.startswith(prefix) and name.endswith(".weight")]
