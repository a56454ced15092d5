"""What a node of a Ray cluster is refused for when it is checked. No Ray is needed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from harness.campaign.execution.ray_nodes import token_file, wrong_here
from harness.campaign.storage.run_folder import RunFolder
from harness.campaign.storage.versions import versions_of_numbers
from harness.files import make_folder

TOKEN = "4711 1"


@pytest.fixture
def folder(tmp_path: Path) -> Iterator[RunFolder]:
    """The folder of a run whose command is running and has written its token. The node is this process."""
    folder = RunFolder(tmp_path / "run")
    folder.claim("checked")
    with folder.held():
        make_folder(token_file(folder).parent)
        token_file(folder).write_text(TOKEN)
        yield folder


def refusal(folder: RunFolder, token: str = TOKEN, *files: Path, **versions: str) -> str:
    wrong = wrong_here(folder, token, files, {**versions_of_numbers(), **versions})
    assert wrong is not None
    return wrong[0]


def test_node__that_sees_the_run_folder_and_has_the_versions_fits(folder: RunFolder) -> None:
    assert wrong_here(folder, TOKEN, [folder.path], versions_of_numbers()) is None


def test_node__with_another_folder_under_the_path_is_refused(folder: RunFolder, tmp_path: Path) -> None:
    """An empty folder, as an unmounted one is; and one with the token of another run."""
    empty = RunFolder(tmp_path / "empty")
    assert refusal(empty) == f"does not see the run folder {empty.path}"
    assert refusal(folder, "4711 2") == f"does not see the run folder {folder.path}"


def test_node__without_a_file_of_the_campaign_is_refused(folder: RunFolder) -> None:
    assert refusal(folder, TOKEN, Path("/policies/merge")) == "does not see /policies/merge"


def test_node__that_finds_the_lock_free_is_refused(tmp_path: Path) -> None:
    """As on a file system whose locks hold on one machine only: the command is running, and the lock is not held."""
    folder = RunFolder(tmp_path / "run")
    folder.claim("checked")
    make_folder(token_file(folder).parent)
    token_file(folder).write_text(TOKEN)
    assert refusal(folder) == f"the lock of the run folder {folder.path} does not hold there"


def test_node__with_other_versions_is_refused_with_each_of_them(folder: RunFolder) -> None:
    here = versions_of_numbers()
    text = refusal(folder, torch="1.0", libsumo="1.27.0")
    assert f"libsumo {here['libsumo']}, here 1.27.0; torch {here['torch']}, here 1.0" in text
    assert "numpy" not in text
