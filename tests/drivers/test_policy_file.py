"""Policies on disk: read back exactly, refused if damaged, and free of code."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from harness.drivers.policy_file import Policy, read_policy, write_policy
from harness.errors import UsageError
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


def test_read_policy__a_misspelt_parameter_is_named_with_the_nearest(tmp_path: Path) -> None:
    """Further damage is in `tests/hostile/bad_documents.py`."""
    tensors = dict(some_policy().tensors)
    tensors["actor.1.wieght"] = tensors.pop("actor.1.weight")
    write_policy(Policy(tensors), tmp_path)
    with pytest.raises(UsageError, match=r"'actor\.1\.wieght': did you mean 'actor\.1\.weight'"):
        read_policy(tmp_path)


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
