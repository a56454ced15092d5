"""Documents by name: beside the file that names them, else shipped; and every shipped campaign runs from the wheel."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from harness.errors import UsageError
from harness.shipped_documents import document_at, find_document, missing_document, shipped, shipped_names
from tests.support.repository import REPOSITORY


def test_find_document__a_name_is_found_beside_then_in_the_subfolder_then_shipped(tmp_path: Path) -> None:
    assert find_document("speedy", tmp_path, "personas") == shipped("personas") / "speedy.toml"
    inside = tmp_path / "personas" / "speedy.toml"
    inside.parent.mkdir()
    inside.touch()
    assert find_document("speedy", tmp_path, "personas") == inside
    beside = tmp_path / "speedy.toml"
    beside.touch()
    assert find_document("speedy", tmp_path, "personas") == beside


def test_find_document__a_scene_is_a_folder(tmp_path: Path) -> None:
    assert find_document("merge", tmp_path, "networks") == shipped("networks") / "merge"
    (tmp_path / "merge").mkdir()
    assert find_document("merge", tmp_path, "networks") == tmp_path / "merge"


@pytest.mark.parametrize("written", ["../personas/speedy.toml", "speedy.toml", "./speedy"])
def test_find_document__a_path_is_relative_to_the_folder_and_never_shipped(written: str, tmp_path: Path) -> None:
    assert find_document(written, tmp_path, "personas") == Path(os.path.realpath(tmp_path / written))


def test_missing_document__names_the_nearest() -> None:
    assert missing_document("speedyy", Path("/"), "personas") == (
        "there is no persona 'speedyy'",
        "did you mean 'speedy'? a path is relative to /",
    )
    assert "adas, careful_and_competent, fuzzy, rss" in missing_document("qqq", Path("/"), "egos")[1]


def test_document_at__an_existing_path_wins_and_an_unknown_name_is_refused(tmp_path: Path) -> None:
    assert document_at(tmp_path, "campaigns") == tmp_path
    assert document_at(Path("none.toml"), "campaigns") == Path("none.toml")
    assert document_at(Path("merge-demo"), "campaigns") == shipped("campaigns") / "merge-demo.toml"
    with pytest.raises(UsageError, match="there is no campaign 'merge-dem'"):
        document_at(Path("merge-dem"), "campaigns")


# --- the wheel ---


@pytest.fixture(scope="session")
def installed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The variables of an environment in which the package is installed from its wheel, and not the checkout."""
    folder = tmp_path_factory.mktemp("wheel")
    pip = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check"]
    subprocess.run(
        [*pip, "wheel", "--no-deps", "--no-build-isolation", "-w", folder, REPOSITORY], check=True, timeout=300
    )
    (wheel,) = folder.glob("*.whl")
    subprocess.run([*pip, "install", "--no-deps", "--target", folder / "site", wheel], check=True, timeout=300)
    return {**os.environ, "PYTHONPATH": str(folder / "site")}


def run(arguments: list[str], environment: dict[str, str], folder: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "harness", *arguments]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300)


def test_wheel__has_every_shipped_document_and_is_typed(installed: dict[str, str], tmp_path: Path) -> None:
    package = Path(installed["PYTHONPATH"]) / "harness"
    assert (package / "py.typed").is_file()
    for kind in ("networks", "personas", "egos", "policies", "campaigns"):
        there = sorted(each.stem for each in (package / "shipped" / kind).iterdir() if each.name != "README.md")
        assert [name for name in there if name != "examples"] == [n for n in shipped_names(kind) if n != "examples"]
    done = subprocess.run(
        [sys.executable, "-c", "import harness; print(harness.__file__)"],
        cwd=tmp_path,
        env=installed,
        capture_output=True,
        text=True,
        check=True,
    )
    assert Path(done.stdout.strip()).parent == package


def test_wheel__a_new_project_is_in_order_and_shipped_campaigns_have_names(
    installed: dict[str, str], tmp_path: Path
) -> None:
    made = run(["new", "lab"], installed, tmp_path)
    assert made.returncode == 0, made.stderr
    lab = tmp_path / "lab"
    assert sorted(each.name for each in lab.iterdir()) == ["README.md", "campaign.toml", "networks", "personas"]
    checked = run(["check", "campaign.toml"], installed, lab)
    assert checked.returncode == 0, checked.stderr
    assert "5 trainings" in checked.stdout
    assert run(["check", "merge-demo"], installed, lab).returncode == 0
    assert run(["persona", "show", "my_driver"], installed, lab).returncode == 0
