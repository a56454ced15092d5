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

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from stable_baselines3 import PPO

from harness.config.training import CurvePoint
from harness.files import write_atomically
from harness.training.regret_starts import RegretScores


@dataclass(frozen=True, kw_only=True)
class Progress:
    """The progress of a training."""

    segments: int
    steps: int
    segment_payoffs: list[float]
    """Mean payoff of each segment; -inf if no game ended in it."""
    curve: list[CurvePoint]
    alone_games: list[dict[str, int]]
    """Games of each segment without another player, on each road."""
    alone_failures: list[dict[str, int]]
    """Those of them that did not end at the goal."""
    converged_at: int | None = None
    """Steps after which the curve had converged; None: it had not."""
    regret: RegretScores | None = None
    """Of a training that replays starts by regret."""


def write_checkpoint(model: PPO, progress: Progress, key: str, path: Path) -> None:
    """Write a learner's checkpoint; `key` identifies the inputs of the training."""
    tensors = {f"policy/{name}": value for name, value in model.policy.state_dict().items()}
    for index, state in model.policy.optimizer.state_dict()["state"].items():
        for name, value in state.items():
            tensors[f"optimizer/{index}/{name}"] = torch.as_tensor(value)
    metadata = {"progress": json.dumps(asdict(progress)), "key": key}
    write_atomically(path, save(tensors, metadata={**metadata, "digest": _digest(tensors, metadata)}))


def read_checkpoint(model: PPO, key: str, path: Path) -> Progress | None:
    """Load a checkpoint into a new learner of the same inputs. Returns None, and leaves the learner unchanged, if there
    is none: the file is missing or damaged, or has another `key`."""
    try:
        with safe_open(path, framework="pt") as file:
            metadata = file.metadata() or {}
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        if metadata.get("key") != key or metadata.get("digest") != _digest(tensors, metadata):
            return None
    # Raised for missing and damaged files, and for number types that NumPy or PyTorch lacks.
    except (SafetensorError, OSError, LookupError, TypeError, ValueError, AttributeError):
        return None
    parts = {name: value for name, value in tensors.items() if name.startswith("policy/")}
    model.policy.load_state_dict({name.removeprefix("policy/"): value for name, value in parts.items()})
    moments: dict[int, dict[str, torch.Tensor]] = {}
    for name in tensors.keys() - parts.keys():
        _, index, entry = name.split("/")
        moments.setdefault(int(index), {})[entry] = tensors[name]
    optimizer = model.policy.optimizer
    optimizer.load_state_dict({**optimizer.state_dict(), "state": moments})
    stored = json.loads(metadata["progress"])
    curve, regret = [CurvePoint(**window) for window in stored["curve"]], stored.get("regret")
    return Progress(**{**stored, "curve": curve, "regret": RegretScores(**regret) if regret is not None else None})


def _digest(tensors: Mapping[str, torch.Tensor], metadata: Mapping[str, str]) -> str:
    """SHA-256 of the content. It detects a file of the right length that a power failure has left incomplete."""
    digest = hashlib.sha256(f"{metadata['key']}\n{metadata['progress']}".encode())
    for name, tensor in sorted(tensors.items()):
        digest.update(f"\n{name} {tensor.dtype} {tuple(tensor.shape)}\n".encode())
        digest.update(tensor.detach().contiguous().numpy().tobytes())
    return digest.hexdigest()
