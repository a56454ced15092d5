"""Documents by name: beside the file that names them, else shipped."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import harness
from harness.errors import UsageError
from harness.shipped_documents import document_at, find_document, missing_document, shipped


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
    assert document_at(Path("demo"), "campaigns") == shipped("campaigns") / "demo.toml"
    with pytest.raises(UsageError, match="there is no campaign 'dem'"):
        document_at(Path("dem"), "campaigns")


def test_names_in_python__an_unknown_one_is_refused_with_the_nearest() -> None:
    with pytest.raises(UsageError, match=r"there is no scene 'mergee' .did you mean 'merge'"):
        harness.open_scene("mergee")
    with pytest.raises(UsageError, match=r"there is no persona 'speedyy' .did you mean 'speedy'"):
        harness.DrivingEnv(persona="speedyy")
