"""External drivers: their documents, and the packages and files that they are in."""

from __future__ import annotations

import shutil
from pathlib import Path
from types import ModuleType

import pytest

from harness.campaign.preflight import open_campaign
from harness.drivers.external import ExternalDriver, find_driver
from harness.errors import UsageError
from tests.support.repository import REPOSITORY
from tests.support.scripts import script


def find(written: str, folder: Path, allow_code: bool = True) -> ExternalDriver:
    """The driver that a campaign in `folder` names as `written`."""
    return find_driver(written, folder / "campaign.toml", "ego.driver", allow_code)


def document(folder: Path, text: str, name: str = "mine.toml") -> str:
    """Write a driver's document; its name."""
    (folder / name).write_text(text)
    return name


def problems(file: Path, allow_code: bool = True) -> list[str]:
    """What is wrong with a campaign that can't be opened."""
    with pytest.raises(UsageError) as caught:
        open_campaign(file, allow_code=allow_code)
    return [str(problem) for problem in caught.value.problems]


EXAMPLE = REPOSITORY / "egos" / "examples" / "python"
"""An example of a package with a driver."""


def install(
    folder: Path, name: str = "steady-driver", points: str = "steady = steady:Steady", version: str = "1.0"
) -> None:
    """Put the example package where an installer would: its module, and its metadata."""
    folder.mkdir(exist_ok=True)
    shutil.copy(EXAMPLE / "steady.py", folder)
    info = folder / f"{name.replace('-', '_')}-{version}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    (info / "entry_points.txt").write_text(f"[harness.drivers]\n{points}\n")


def fmu_example() -> ModuleType:
    """The module that builds the example of an FMU, egos/examples/fmu/build.py."""
    return script("../egos/examples/fmu/build.py")
