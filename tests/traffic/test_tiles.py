"""Tiled nets and their cache."""

from __future__ import annotations

import importlib.metadata
from pathlib import Path

import platformdirs
import pytest
import sumo
from sumolib.net import readNet

from harness.traffic import tiles
from harness.traffic.scene import OpenScene


@pytest.fixture
def merges(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The games of each net that netconvert merged, with a cache in a temporary folder."""
    merges: list[int] = []
    merge = tiles._merge

    def counted_merge(net_file: Path, games: int, scratch: Path) -> Path:
        merges.append(games)
        return merge(net_file, games, scratch)

    monkeypatch.setattr(platformdirs, "user_cache_dir", lambda name: str(tmp_path / name))
    monkeypatch.setattr(tiles, "_merge", counted_merge)
    return merges


def test_tiles__of_one_game_are_the_net_itself(merge: OpenScene, merges: list[int]) -> None:
    assert tiles.tiled_net(merge.net_file, 1) == merge.net_file
    assert merges == []


def test_tiles__are_side_by_side_with_prefixed_names(merge: OpenScene, merges: list[int]) -> None:
    net, offset_m = readNet(str(tiles.tiled_net(merge.net_file, 2))), tiles.tile_offset_m(merge.net_file, 2)
    lanes = [net.getLane(f"{tiles.tile_prefix(game, 2)}approach_0") for game in range(2)]
    assert lanes[1].getShape()[0][0] == pytest.approx(lanes[0].getShape()[0][0])
    assert lanes[1].getShape()[0][1] - lanes[0].getShape()[0][1] == pytest.approx(offset_m)


def test_cache__has_a_net_for_each_number_of_games(merge: OpenScene, merges: list[int]) -> None:
    files = [tiles.tiled_net(merge.net_file, games) for games in (2, 3, 2)]
    assert files[0] == files[2] != files[1]
    assert merges == [2, 3]


def test_cache__is_keyed_by_the_version_of_sumo_and_not_by_its_path(
    merge: OpenScene, merges: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tiles.tiled_net(merge.net_file, 2)
    with monkeypatch.context() as moved:
        moved.setattr(sumo, "__file__", "/elsewhere/sumo/__init__.py")
        assert tiles.tiled_net(merge.net_file, 2) == file
    monkeypatch.setattr(importlib.metadata, "version", lambda package: f"another {package}")
    assert tiles.tiled_net(merge.net_file, 2) != file
    assert merges == [2, 2]
