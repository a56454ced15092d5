"""Checkpoints: an intact file restores a learner, and any other file counts as no checkpoint."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from safetensors import safe_open
from safetensors.torch import load_file, save_file
from stable_baselines3 import PPO

from harness.config.training import CurvePoint
from harness.environments.vector_env import ACTION_SPACE, OBSERVATION_SPACE
from harness.training.checkpoint import Progress, read_checkpoint, write_checkpoint
from harness.training.regret_starts import RegretScores

KEY = "key"
FIRST = CurvePoint(steps=4, mean_payoff=1.5, failure_rate=0.25, games=4, mean_duration_s=3.0)
SECOND = CurvePoint(steps=8, mean_payoff=1.5, failure_rate=0.25, games=4, mean_duration_s=3.0, mean_regret=0.1)
SCORES = RegretScores(
    best_payoffs=[0.1, -2.0], preventable=[True, False], latest_payoffs=[1 / 3, None], last_replays=[1, 0], replays=1
)
PROGRESS = Progress(
    segments=2,
    steps=16,
    segment_payoffs=[-float("inf"), 1.5],
    curve=[FIRST, SECOND],
    alone_games=[{}, {"merge": 4}],
    alone_failures=[{}, {"merge": 1}],
    regret=SCORES,
)
Tensors = dict[str, torch.Tensor]
Metadata = dict[str, str]


class Spaces(gymnasium.Env[Any, Any]):
    """An environment with the harness's spaces and random steps."""

    observation_space, action_space = OBSERVATION_SPACE, ACTION_SPACE

    def reset(self, **options: Any) -> Any:
        return np.zeros(self.observation_space.shape, dtype=np.float32), {}

    def step(self, action: Any) -> Any:
        return np.full(self.observation_space.shape, 0.1, dtype=np.float32), 1.0, True, False, {}


def learner(seed: int) -> PPO:
    network = {"net_arch": [4]}
    return PPO("MlpPolicy", Spaces(), n_steps=8, batch_size=8, policy_kwargs=network, device="cpu", seed=seed)


@pytest.fixture(scope="module")
def intact(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The checkpoint of a learner after one update."""
    model = learner(1).learn(8)
    file = tmp_path_factory.mktemp("checkpoint") / "checkpoint.safetensors"
    write_checkpoint(model, PROGRESS, KEY, file)
    return file


def state_of(model: PPO) -> bytes:
    """All numbers of a learner."""
    optimizer = model.policy.optimizer.state_dict()["state"]
    arrays = [value.numpy() for value in model.policy.state_dict().values()]
    arrays += [torch.as_tensor(value).numpy() for each in optimizer.values() for value in each.values()]
    return b"".join(array.tobytes() for array in arrays)


NEW = learner(2)


def check_unusable(file: Path) -> None:
    before = state_of(NEW)
    assert read_checkpoint(NEW, KEY, file) is None
    assert state_of(NEW) == before


def test_read__restores_learner_and_progress(intact: Path) -> None:
    model = learner(2)
    assert read_checkpoint(model, "another", intact) is None
    assert read_checkpoint(model, KEY, intact.with_name("missing")) is None
    assert read_checkpoint(model, KEY, intact) == PROGRESS
    write_checkpoint(model, PROGRESS, KEY, intact.with_name("again"))
    written, again = load_file(intact), load_file(intact.with_name("again"))
    assert written.keys() == again.keys()
    assert all(torch.equal(written[name], again[name]) for name in written)


DAMAGED: dict[str, Callable[[Tensors, Metadata], object]] = {
    "no tensors": lambda tensors, metadata: tensors.clear(),
    "a parameter missing": lambda tensors, metadata: tensors.pop("policy/action_net.weight"),
    "a parameter changed": lambda tensors, metadata: tensors["policy/action_net.weight"].add_(1e-3),
    "a parameter of another type": lambda tensors, metadata: tensors.update(step=torch.zeros(1, dtype=torch.bfloat16)),
    "another key": lambda tensors, metadata: metadata.update(key="another"),
    "another progress": lambda tensors, metadata: metadata.update(progress="{}"),
    "no progress": lambda tensors, metadata: metadata.pop("progress"),
    "no metadata": lambda tensors, metadata: metadata.clear(),
    "no digest": lambda tensors, metadata: metadata.pop("digest"),
}


@pytest.mark.parametrize("name", DAMAGED)
def test_read__other_content_than_was_written_is_no_checkpoint(name: str, intact: Path, tmp_path: Path) -> None:
    with safe_open(intact, framework="pt") as file:
        metadata = file.metadata()
    tensors = load_file(intact)
    DAMAGED[name](tensors, metadata)
    save_file(tensors, tmp_path / "changed.safetensors", metadata)
    check_unusable(tmp_path / "changed.safetensors")


@settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(place=st.floats(0.0, 1.0, exclude_max=True), byte=st.integers(1, 255))
def test_read__a_changed_byte_makes_it_no_checkpoint(place: float, byte: int, intact: Path, tmp_path: Path) -> None:
    content = bytearray(intact.read_bytes())
    content[int(place * len(content))] ^= byte
    (tmp_path / "damaged.safetensors").write_bytes(content)
    found = read_checkpoint(learner(2), KEY, tmp_path / "damaged.safetensors")
    assert found in (None, PROGRESS)  # a byte of white space or of an unused key may change without effect
