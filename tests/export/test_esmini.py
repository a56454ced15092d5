"""Exports in esmini: `make test-esmini ESMINI=/path/to/bin/esmini` runs these tests."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from harness.export.folder import Formats, write_games
from harness.road.scene.open_scene import OpenScene
from tests.support.esmini import largest_difference_m, play
from tests.support.exports import bicycle_game, exported, merge_with_vans, signals_game, walker_game
from tests.support.replays import GAMES, STEP_S

BOTH = Formats(openscenario=True, opendrive=True)
pytestmark = pytest.mark.esmini


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> OpenScene:
    return merge_with_vans(tmp_path_factory.mktemp("scene") / "merge")


def assert_plays(trace: pd.DataFrame, scene: OpenScene, folder: Path) -> str:
    """esmini shows every body where it was in every step, to 1 cm; what it logs."""
    of_game = exported(trace, scene)
    write_games(iter([of_game]), scene, folder / "export", BOTH, title="test")
    played, log = play(folder / "export" / "game.xosc", STEP_S, folder)
    assert largest_difference_m(played, of_game.bodies, STEP_S) < 0.01
    assert "[error]" not in log
    return log


@pytest.mark.parametrize("name", GAMES)
def test_esmini__plays_every_frame_of_the_trace(name: str, scene: OpenScene, tmp_path: Path) -> None:
    assert_plays(GAMES[name](), scene, tmp_path)


@pytest.mark.parametrize("drawn", [walker_game, bicycle_game])
def test_esmini__plays_walkers_and_bicycles(
    drawn: Callable[[], tuple[pd.DataFrame, OpenScene]], tmp_path: Path
) -> None:
    assert_plays(*drawn(), tmp_path)


def test_esmini__switches_the_signals(tmp_path: Path) -> None:
    log = assert_plays(*signals_game(), tmp_path)
    for change in ("crossing at 0.00 s", "crossing at 2.00 s", "crossing at 5.00 s"):
        assert change in log
