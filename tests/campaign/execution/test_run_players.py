"""The policies that a finished run read are found by their checksums, wherever its manifest says they were."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from harness.campaign.execution.run_players import policies_of_run
from tests.support.shipped import NAIVE, POLICIES

WRITTEN, NAMES = "../policies/mine", ["naive-seed1"]


@pytest.fixture
def policies(tmp_path: Path) -> Path:
    folder = tmp_path / "policies" / "mine" / "naive-seed1"
    folder.mkdir(parents=True)
    (folder / "policy.json").write_text("{}")
    (folder / "policy.safetensors").write_bytes(b"weights")
    return folder.parent


@pytest.fixture
def hashes(policies: Path) -> dict[str, str]:
    """As a manifest has them: paths from the campaign's file."""
    files = sorted((policies / "naive-seed1").iterdir())
    found = {f"{WRITTEN}/naive-seed1/{each.name}": hashlib.sha256(each.read_bytes()).hexdigest() for each in files}
    return {"mine.toml": "0" * 64, **found}


def test_policies__beside_the_folder_of_the_run_are_found_unless_they_have_changed(
    tmp_path: Path, policies: Path, hashes: dict[str, str]
) -> None:
    (tmp_path / "reports" / "mine").mkdir(parents=True)
    found = policies_of_run(tmp_path / "reports" / "mine", WRITTEN, hashes, NAMES)
    assert found is not None
    assert found.resolve() == policies
    (policies / "naive-seed1" / "policy.safetensors").write_bytes(b"others")
    assert policies_of_run(tmp_path / "reports" / "mine", WRITTEN, hashes, NAMES) is None


def test_policies__shipped_ones_are_found_whatever_the_path_was(tmp_path: Path) -> None:
    files = sorted((POLICIES / NAIVE).glob("policy.*"))
    hashes = {f"/home/x/{NAIVE}/{each.name}": hashlib.sha256(each.read_bytes()).hexdigest() for each in files}
    assert policies_of_run(tmp_path, "/home/x", hashes, [NAIVE]) == POLICIES


@pytest.mark.parametrize("ego", ["naive-seed2", "naive-seed1"])
def test_policies__are_found_though_the_ego_is_a_policy_of_another_folder(
    ego: str, tmp_path: Path, policies: Path, hashes: dict[str, str]
) -> None:
    hashes = {**hashes, f"../policies/others/{ego}/policy.json": "1" * 64}
    (tmp_path / "reports" / "mine").mkdir(parents=True)
    assert policies_of_run(tmp_path / "reports" / "mine", WRITTEN, hashes, NAMES) is not None


def test_policies__of_a_run_that_read_none_are_none(tmp_path: Path, hashes: dict[str, str]) -> None:
    assert policies_of_run(tmp_path, None, hashes, NAMES) is None
    assert policies_of_run(tmp_path, WRITTEN, {"mine.toml": "0" * 64}, NAMES) is None
