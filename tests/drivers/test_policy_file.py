"""Policies on disk: read back exactly, refused if damaged, and free of code."""

from __future__ import annotations

import json
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import save

from harness.drivers.policy_file import Policy, read_policy, write_policy
from harness.errors import UsageError
from harness.game.arrays import FloatArray
from harness.game.observation_layout import SIZE
from tests.support.policies import some_policy


def test_policy__is_read_back_exactly(tmp_path: Path) -> None:
    policy = some_policy()
    write_policy(policy, tmp_path / "naive")
    again = read_policy(tmp_path / "naive")
    assert set(again.tensors) == set(policy.tensors)
    for name, tensor in policy.tensors.items():
        assert again.tensors[name].dtype == tensor.dtype
        np.testing.assert_array_equal(again.tensors[name], tensor)
    assert again.card["stage"] == "naive-seed1"
    assert [weight.shape for weight, _ in again.layers("actor")] == [(5, SIZE), (2, 5)]


def test_policy__equal_policies_are_equal_bytes(tmp_path: Path) -> None:
    policy = some_policy()
    shuffled = Policy({k: np.asfortranarray(policy.tensors[k]) for k in reversed(policy.tensors)}, policy.card)
    write_policy(policy, tmp_path / "a")
    write_policy(shuffled, tmp_path / "b")
    write_policy(some_policy(seed=1), tmp_path / "c")
    files = {each: (tmp_path / each / "policy.safetensors").read_bytes() for each in "abc"}
    assert files["a"] == files["b"] != files["c"]
    assert (tmp_path / "a" / "policy.json").read_bytes() == (tmp_path / "b" / "policy.json").read_bytes()


Damage = Callable[[Path, Path], object]


def tensors_changed(**changes: FloatArray | None) -> Damage:
    def damage(tensors: Path, card: Path) -> None:
        changed = {**some_policy().tensors, **{name.replace("__", "."): value for name, value in changes.items()}}
        tensors.write_bytes(save({name: value for name, value in changed.items() if value is not None}))

    return damage


def card_changed(**changes: object) -> Damage:
    return lambda tensors, card: card.write_text(json.dumps({**json.loads(card.read_text()), **changes}))


NAN, ZEROS = np.full(2, np.nan, np.float32), np.zeros
DAMAGE: dict[str, tuple[str, Damage]] = {
    "no tensors": ("policy.safetensors", lambda tensors, card: tensors.unlink()),
    "no card": ("policy.json", lambda tensors, card: card.unlink()),
    "a folder in place of the tensors": (
        "policy.safetensors",
        lambda tensors, card: (tensors.unlink(), tensors.mkdir()),
    ),
    "truncated": ("policy.safetensors", lambda tensors, card: tensors.write_bytes(tensors.read_bytes()[:-1])),
    "truncated header": ("policy.safetensors", lambda tensors, card: tensors.write_bytes(tensors.read_bytes()[:20])),
    "empty": ("policy.safetensors", lambda tensors, card: tensors.write_bytes(b"")),
    "zeros": ("policy.safetensors", lambda tensors, card: tensors.write_bytes(bytes(200))),
    "a huge header": ("policy.safetensors", lambda tensors, card: tensors.write_bytes(b"\xff" * 64)),
    "a pickle": ("policy.safetensors", lambda tensors, card: tensors.write_bytes(pickle.dumps({"actor": 1}))),
    "an archive of another learner": ("policy.safetensors", lambda tensors, card: tensors.write_bytes(b"PK\x03\x04")),
    "not a number": ("policy.safetensors", tensors_changed(log_deviation=NAN)),
    "infinite": ("policy.safetensors", tensors_changed(actor__1__bias=np.array([np.inf, 0], np.float32))),
    "no deviation": ("policy.safetensors", tensors_changed(log_deviation=None)),
    "three deviations": ("policy.safetensors", tensors_changed(log_deviation=ZEROS(3, np.float32))),
    "no bias": ("policy.safetensors", tensors_changed(actor__1__bias=None)),
    "a layer left out": ("policy.safetensors", tensors_changed(actor__1__weight=None)),
    "no critic": ("policy.safetensors", tensors_changed(critic__0__weight=None, critic__1__weight=None)),
    "other observations": ("policy.safetensors", tensors_changed(actor__0__weight=ZEROS((5, SIZE - 1), np.float32))),
    "layers that do not fit": ("policy.safetensors", tensors_changed(actor__1__weight=ZEROS((2, 6), np.float32))),
    "three actions": (
        "policy.safetensors",
        tensors_changed(actor__1__weight=ZEROS((3, 5), np.float32), actor__1__bias=ZEROS(3, np.float32)),
    ),
    "a vector for a matrix": ("policy.safetensors", tensors_changed(actor__1__weight=ZEROS(5, np.float32))),
    "whole numbers": ("policy.safetensors", tensors_changed(actor__1__weight=ZEROS((2, 5), np.int32))),
    "no JSON": ("policy.json", lambda tensors, card: card.write_text("{")),
    "no UTF-8": ("policy.json", lambda tensors, card: card.write_bytes(b"\xff\xfe")),
    "a list": ("policy.json", lambda tensors, card: card.write_text("[]")),
    "deeply nested": ("policy.json", lambda tensors, card: card.write_text("[" * 100_000)),
    "a later format": ("policy.json", card_changed(format=2)),
    "another layout": ("policy.json", card_changed(observation=["speed_mps"])),
    "no layout": ("policy.json", lambda tensors, card: card.write_text('{"format": 1}')),
}


@pytest.mark.parametrize("name", DAMAGE)
def test_read_policy__a_damaged_file_is_refused_by_name(name: str, tmp_path: Path) -> None:
    write_policy(some_policy(), tmp_path)
    damaged, damage = DAMAGE[name]
    damage(tmp_path / "policy.safetensors", tmp_path / "policy.json")
    with pytest.raises(UsageError) as error:
        read_policy(tmp_path)
    (problem,) = error.value.problems
    assert problem.file == str(tmp_path / damaged)
    assert problem.message
    assert problem.remedy


def test_read_policy__a_file_that_is_too_large_is_refused_unread(tmp_path: Path) -> None:
    write_policy(some_policy(), tmp_path)
    with (tmp_path / "policy.safetensors").open("ab") as file:
        file.truncate(10**12)  # sparse: it takes no space on disk
    with pytest.raises(UsageError, match="too large"):
        read_policy(tmp_path)


def test_read_policy__imports_nothing_that_can_run_code(tmp_path: Path) -> None:
    write_policy(some_policy(), tmp_path)
    program = (
        "import sys; from pathlib import Path; from harness.drivers.policy_file import read_policy\n"
        "import pickle, builtins, codecs\n"
        "def refuse(*_, **__): raise SystemExit('something was unpickled or evaluated')\n"
        "pickle.load = pickle.loads = pickle.Unpickler = builtins.eval = builtins.exec = refuse\n"
        f"read_policy(Path({str(tmp_path)!r})); assert 'torch' not in sys.modules"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
