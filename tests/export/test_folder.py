"""The folder of an export: complete, or not there."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from harness.errors import HarnessError, UsageError
from harness.export import folder as folder_module
from harness.export.exported_game import ExportedGame
from harness.export.folder import Formats, write_games
from harness.road.scene.open_scene import OpenScene
from tests.support.exports import exported
from tests.support.replays import clean_game, collision_game

BOTH = Formats(openscenario=True, opendrive=True)


def games(scene: OpenScene) -> Iterator[ExportedGame]:
    yield exported(clean_game(), scene, "first")
    yield exported(collision_game(), scene, "second")


def test_folder__has_a_file_per_game_and_a_list(merge: OpenScene, tmp_path: Path) -> None:
    assert write_games(games(merge), merge, tmp_path / "out", BOTH, title="two games") == 2
    names = sorted(file.name for file in (tmp_path / "out").iterdir())
    assert names == ["first.xosc", "games.csv", "scene.xodr", "second.xosc"]
    assert (tmp_path / "out" / "games.csv").read_text().splitlines() == [
        "number,name,arm,seed,episode,outcome",
        "1,first,naive_vs_speedy,1,0,collision",
        "2,second,naive_vs_speedy,1,0,collision",
    ]
    assert sorted(tmp_path.iterdir()) == [tmp_path / "out"]


def test_folder__that_holds_something_stays(merge: OpenScene, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "mine.txt").write_text("mine")
    with pytest.raises(UsageError, match="not empty"):
        write_games(games(merge), merge, tmp_path / "out", BOTH, title="two games")
    assert [file.name for file in (tmp_path / "out").iterdir()] == ["mine.txt"]


def test_folder__nothing_is_left_of_an_export_that_fails(merge: OpenScene, tmp_path: Path) -> None:
    def broken() -> Iterator[ExportedGame]:
        yield exported(clean_game(), merge, "first")
        raise HarnessError("no more games")

    with pytest.raises(HarnessError, match="no more games"):
        write_games(broken(), merge, tmp_path / "out", BOTH, title="broken")
    assert list(tmp_path.iterdir()) == []


def test_folder__a_trace_that_cannot_be_read_is_not_taken_for_a_folder_that_cannot_be_written(
    merge: OpenScene, tmp_path: Path
) -> None:
    def unreadable() -> Iterator[ExportedGame]:
        yield exported(clean_game(), merge, "first")
        raise PermissionError(13, "Permission denied", "traces/naive_alone-seed1.parquet")

    with pytest.raises(PermissionError, match="naive_alone-seed1"):
        write_games(unreadable(), merge, tmp_path / "out", BOTH, title="unreadable")
    assert list(tmp_path.iterdir()) == []


def test_folder__that_can_not_be_written_is_named(
    merge: OpenScene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(file: Path, content: bytes) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(UsageError, match="out: can't be written: No space left on device"):
        write_games(games(merge), merge, tmp_path / "out", Formats(csv=True), title="two games")
    assert list(tmp_path.iterdir()) == []


def test_formats__name_the_package_that_is_missing(
    merge: OpenScene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(folder_module, "find_spec", lambda name: None)
    with pytest.raises(UsageError, match=r"safedriverl-harness\[osc\]"):
        write_games(games(merge), merge, tmp_path / "out", BOTH, title="two games")
    assert list(tmp_path.iterdir()) == []
