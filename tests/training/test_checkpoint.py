"""Checkpoints: an intact file restores a learner, and any other file counts as no checkpoint."""

from __future__ import annotations

import json
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

from harness.environments.vector_env import ACTION_SPACE, OBSERVATION_SPACE
from harness.training.checkpoint import CurvePoint, Progress, read_checkpoint, write_checkpoint

KEY = "key"
POINT = CurvePoint(steps=8, mean_payoff=1.5, failure_rate=0.25, games=4, mean_duration_s=3.0)
PROGRESS = Progress(
    segments=2,
    steps=16,
    segment_payoffs=[-float("inf"), 1.5],
    curve=[POINT],
    alone_games=[0, 4],
    alone_failures=[0, 1],
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


def changed(intact: Path, folder: Path, change: Callable[[Tensors, Metadata], object], digest: bool = False) -> Path:
    """A well-formed safetensors file with other content; by default without the digest."""
    with safe_open(intact, framework="pt") as file:
        metadata = file.metadata()
    tensors = load_file(intact)
    if not digest:
        del metadata["digest"]
    change(tensors, metadata)
    save_file(tensors, folder / "changed.safetensors", metadata)
    return folder / "changed.safetensors"


NEW = learner(2)


def check_unusable(file: Path) -> None:
    before = state_of(NEW)
    assert read_checkpoint(NEW, KEY, file) is None
    assert state_of(NEW) == before


def test_read__restores_learner_and_progress(intact: Path) -> None:
    model = learner(2)
    assert read_checkpoint(model, KEY, intact) == PROGRESS
    write_checkpoint(model, PROGRESS, KEY, intact.with_name("again"))
    written, again = load_file(intact), load_file(intact.with_name("again"))
    assert written.keys() == again.keys()
    assert all(torch.equal(written[name], again[name]) for name in written)


def test_read__accepts_a_file_without_digest(intact: Path, tmp_path: Path) -> None:
    file = changed(intact, tmp_path, lambda tensors, metadata: None)
    assert read_checkpoint(learner(2), KEY, file) == PROGRESS


WEIGHT, STEP, MOMENT = "policy/action_net.weight", "optimizer/0/step", "optimizer/0/exp_avg"


def tensor(name: str, value: torch.Tensor | None) -> Callable[[Tensors, Metadata], object]:
    """A change that replaces, adds or removes a tensor."""
    if value is None:
        return lambda tensors, metadata: tensors.pop(name)
    return lambda tensors, metadata: tensors.update({name: value})


def cast(name: str, dtype: torch.dtype) -> Callable[[Tensors, Metadata], object]:
    return lambda tensors, metadata: tensors.update({name: tensors[name].to(dtype)})


def metadata(**values: str | None) -> Callable[[Tensors, Metadata], object]:
    """A change that replaces, adds or removes metadata."""

    def change(tensors: Tensors, metadata: Metadata) -> None:
        metadata.update({name: value for name, value in values.items() if value is not None})
        for name in [name for name, value in values.items() if value is None]:
            del metadata[name]

    return change


def progress(**values: Any) -> Callable[[Tensors, Metadata], object]:
    whole = {"segments": 1, "steps": 8, "segment_payoffs": [1.0], "curve": []}
    return metadata(progress=json.dumps(whole | values))


ONE = torch.zeros(1)
MALFORMED: dict[str, Callable[[Tensors, Metadata], object]] = {
    "no tensors": lambda tensors, metadata: tensors.clear(),
    "no parameter": tensor(WEIGHT, None),
    "unknown parameter": tensor("policy/more", ONE),
    "unknown part": tensor("other/0/step", ONE),
    "no part": tensor("step", ONE),
    "parameter of another shape": tensor(WEIGHT, torch.zeros(3, 3)),
    "parameter without dimensions": tensor(WEIGHT, torch.zeros(())),
    "parameter that is not finite": lambda tensors, metadata: tensors[WEIGHT].fill_(float("nan")),
    **{
        f"parameter of {dtype}": cast(WEIGHT, dtype)
        for dtype in (torch.float64, torch.float16, torch.bfloat16, torch.int32, torch.bool, torch.float8_e5m2)
    },
    "no optimizer": lambda tensors, metadata: [tensors.pop(name) for name in list(tensors) if "optimizer" in name],
    "no moment": tensor(MOMENT, None),
    "no step": tensor(STEP, None),
    "unknown moment": tensor("optimizer/0/max_exp_avg_sq", ONE),
    "moment of another shape": tensor(MOMENT, torch.zeros(7)),
    "moment of another type": cast(MOMENT, torch.int64),
    "step of another shape": tensor(STEP, torch.zeros(2)),
    "step of another type": cast(STEP, torch.int64),
    "moment of no parameter": tensor("optimizer/99/step", ONE),
    "negative index": tensor("optimizer/-1/step", ONE),
    "index that is no number": tensor("optimizer/first/step", ONE),
    "index of 5000 digits": tensor(f"optimizer/{'9' * 5000}/step", ONE),
    "no index": tensor("optimizer/step", ONE),
    "nested name": tensor("optimizer/0/step/more", ONE),
    "no key": metadata(key=None),
    "another key": metadata(key="another"),
    "another digest": metadata(digest="0"),
    "another digest and no progress": metadata(digest="0", progress=None),
    "no progress": metadata(progress=None),
    "empty progress": metadata(progress=""),
    "deeply nested progress": metadata(progress="[" * 100_000),
    "progress without a curve": metadata(progress='{"segments": 1, "steps": 8, "segment_payoffs": [1.0]}'),
    "progress that is a list": metadata(progress="[1, 2]"),
    "segments that are text": progress(segments="1"),
    "segments that are true": progress(segments=True),
    "negative steps": progress(steps=-8),
    "steps that are not whole": progress(steps=8.5),
    "payoffs that are text": progress(segment_payoffs=["1.0"]),
    "payoffs that are null": progress(segment_payoffs=None),
    "payoffs of other segments": progress(segment_payoffs=[1.0, 2.0]),
    "curve that is null": progress(curve=None),
    "curve of numbers": progress(curve=[1]),
    "curve with an unknown key": progress(curve=[{"step": 1}]),
    "curve of text": progress(
        curve=[{"steps": 8, "mean_payoff": "1", "failure_rate": 0.0, "games": 1, "mean_duration_s": 1.0}]
    ),
}


@pytest.mark.parametrize("name", MALFORMED)
def test_read__a_well_formed_file_with_wrong_content_is_no_checkpoint(name: str, intact: Path, tmp_path: Path) -> None:
    check_unusable(changed(intact, tmp_path, MALFORMED[name]))


def test_read__a_file_without_metadata_is_no_checkpoint(intact: Path, tmp_path: Path) -> None:
    save_file(load_file(intact), tmp_path / "plain.safetensors")
    check_unusable(tmp_path / "plain.safetensors")


@pytest.mark.parametrize("dtype", ["F8_E8M0", "F4", "F6_E2M3", "C64", "U16", "U64", "F128"])
def test_read__a_number_type_of_the_format_that_is_not_the_learners_is_no_checkpoint(
    dtype: str, intact: Path, tmp_path: Path
) -> None:
    content = intact.read_bytes()
    length = int.from_bytes(content[:8], "little")
    header = json.loads(content[8 : 8 + length])
    header[WEIGHT]["dtype"] = dtype
    del header["__metadata__"]["digest"]
    text = json.dumps(header).encode()
    file = tmp_path / "other.safetensors"
    file.write_bytes(len(text).to_bytes(8, "little") + text + content[8 + length :])
    check_unusable(file)


@settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(place=st.floats(0.0, 1.0, exclude_max=True), byte=st.integers(1, 255))
def test_read__a_changed_byte_makes_it_no_checkpoint(place: float, byte: int, intact: Path, tmp_path: Path) -> None:
    content = bytearray(intact.read_bytes())
    content[int(place * len(content))] ^= byte
    (tmp_path / "damaged.safetensors").write_bytes(content)
    found = read_checkpoint(learner(2), KEY, tmp_path / "damaged.safetensors")
    assert found in (None, PROGRESS)  # a byte of white space or of an unused key may change without effect


@settings(deadline=None, max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    tensors=st.dictionaries(
        st.one_of(st.text(max_size=20), st.from_regex(r"(policy|optimizer)/[\w./]{0,12}", fullmatch=True)),
        st.lists(st.integers(0, 3), max_size=3),
        max_size=4,
    ),
    text=st.one_of(st.text(max_size=20), st.recursive(st.integers() | st.text(max_size=3), st.lists).map(json.dumps)),
)
def test_read__any_well_formed_file_is_read_or_ignored(
    tensors: dict[str, list[int]], text: str, tmp_path: Path
) -> None:
    zeros = {name: torch.zeros(shape) for name, shape in tensors.items() if name != "__metadata__"}
    save_file(zeros, tmp_path / "any.safetensors", {"key": KEY, "progress": text})
    check_unusable(tmp_path / "any.safetensors")
