"""Drivers of installed packages: found by entry point, identified by version and code, checked before a run."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from harness.cli import messages
from harness.drivers.car import Car
from harness.drivers.external import ExternalDriver, find_driver
from harness.errors import UsageError
from harness.game.observation_layout import SIZE
from tests.support.external_drivers import EXAMPLE, install
from tests.support.repository import REPOSITORY
from tests.support.tiny import harness, write_campaign


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of installed packages, with the example in it."""
    install(tmp_path / "site")
    monkeypatch.syspath_prepend(tmp_path / "site")
    monkeypatch.delitem(sys.modules, "steady", raising=False)
    return tmp_path / "site"


def find(written: str, folder: Path) -> ExternalDriver:
    return find_driver(written, folder / "campaign.toml", "ego.driver", allow_code=False)


def test_installed__is_found_by_name_and_needs_no_permission(site: Path, tmp_path: Path, car: Car) -> None:
    found = find("steady", tmp_path)
    assert found.in_words == "steady of the package steady-driver 1.0"
    observation = np.zeros((1, SIZE), dtype=np.float32)
    actions = found.make(car, sampled=False).decide(np.array([0]), observation, np.zeros((1, 2)))
    np.testing.assert_allclose(actions, [[2.0 / 3.0, 0.0]])


def test_installed__a_document_gives_it_parameters(site: Path, tmp_path: Path, car: Car) -> None:
    shutil.copy(EXAMPLE / "slow.toml", tmp_path)
    found = find("slow.toml", tmp_path)
    observation = np.zeros((1, SIZE), dtype=np.float32)
    observation[0, 0] = 8.5 / 30.0
    actions = found.make(car, sampled=False).decide(np.array([0]), observation, np.zeros((1, 2)))
    np.testing.assert_allclose(actions, [[-0.5 / 8.0, 0.0]], atol=1e-6)


def test_installed__identity_has_version_parameters_and_code(site: Path, tmp_path: Path) -> None:
    shutil.copy(EXAMPLE / "slow.toml", tmp_path)
    identities = [find("steady", tmp_path).identity, find("slow.toml", tmp_path).identity]
    (site / "steady.py").write_text((site / "steady.py").read_text() + "\n# changed\n")
    identities.append(find("steady", tmp_path).identity)
    (site / "steady_driver-1.0.dist-info").rename(site / "steady_driver-1.1.dist-info")
    metadata = site / "steady_driver-1.1.dist-info" / "METADATA"
    metadata.write_text(metadata.read_text().replace("1.0", "1.1"))
    identities.append(find("steady", tmp_path).identity)
    assert all(identities.count(each) == 1 for each in identities)


def test_installed__identity_has_the_weights_in_the_package(site: Path, tmp_path: Path) -> None:
    (site / "steady.py").rename(site / "moved.py")
    (site / "steady").mkdir()
    (site / "moved.py").rename(site / "steady" / "__init__.py")
    (site / "steady" / "weights.bin").write_bytes(b"one")
    identities = [find("steady", tmp_path).identity]
    (site / "steady" / "__pycache__").mkdir()
    (site / "steady" / "__pycache__" / "left.pyc").write_bytes(b"by Python")
    identities.append(find("steady", tmp_path).identity)
    (site / "steady" / "weights.bin").write_bytes(b"two")
    identities.append(find("steady", tmp_path).identity)
    assert identities[0] == identities[1]
    assert identities[1] != identities[2]


def test_installed__two_packages_of_one_name_are_refused(site: Path, tmp_path: Path) -> None:
    install(site, "other-driver")
    with pytest.raises(UsageError, match="several packages provide a driver 'steady': other-driver, steady-driver"):
        find("steady", tmp_path)


@pytest.mark.parametrize(
    ("point", "message"),
    [
        ("steady:Stedy", "can't be made: AttributeError"),
        ("stedy:Steady", "can't be made: ModuleNotFoundError"),
        ("steady:LAYOUT", "can't be made: TypeError"),
        ("builtins:id", "returned a int without takes_over, reset, decide"),
    ],
)
def test_installed__an_entry_point_that_returns_no_driver_is_an_error(
    point: str, message: str, tmp_path: Path, car: Car, monkeypatch: pytest.MonkeyPatch
) -> None:
    install(tmp_path / "site", points=f"mine = {point}")
    monkeypatch.syspath_prepend(tmp_path / "site")
    monkeypatch.delitem(sys.modules, "steady", raising=False)
    with pytest.raises(UsageError) as caught:
        find("mine", tmp_path).try_out(car, sampled=False)
    assert message in str(caught.value)


def test_installed__the_command_checks_it_and_a_campaign_takes_it(tmp_path: Path) -> None:
    install(tmp_path / "site")
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(tmp_path / "site"), os.environ.get("PYTHONPATH", "")]),
    }
    done = harness("check-driver", "steady", "--games", 2, env=environment)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "steady of the package steady-driver 1.0, on merge" in done.stdout
    campaign = write_campaign(
        tmp_path, ego={"driver": "steady"} | {"persona": str(REPOSITORY / "personas/careful.toml")}
    )
    checked = harness("check", campaign, env=environment)
    assert checked.returncode == 0, checked.stdout + checked.stderr
    assert messages.NOTHING_TO_TUNE in checked.stdout
