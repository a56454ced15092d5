"""The folder of an export, which appears only when it is complete.

games.csv                 a row per game: arm, seed, episode, outcome, and the name or number of its files
NAME.xosc                 OpenSCENARIO, a file per game
scene.xodr                OpenDRIVE, one file for all games
NN_tracks.csv and so on   the layout of highD, with a number per game
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import pandas as pd

from harness.errors import UsageError
from harness.export.exported_game import ExportedGame
from harness.export.highd import highd_tables
from harness.export.lane_courses import LaneCourses
from harness.export.opendrive import ROAD_FILE, road_file
from harness.road.scene.open_scene import OpenScene

_NEW = "name a new folder"


@dataclass(frozen=True, kw_only=True)
class Formats:
    """The formats to write."""

    openscenario: bool = False
    opendrive: bool = False
    csv: bool = False


def check_export(folder: Path, formats: Formats) -> None:
    """Raise UsageError unless the folder is new or empty, its parent is there, and the packages of the formats are
    installed."""
    if formats.openscenario and find_spec("scenariogeneration") is None:
        message = "needs scenariogeneration, which is not installed"
        raise UsageError.of("--openscenario", "", message, "pip install 'safedriverl-harness[osc]'")
    if folder.is_symlink() or folder.exists():
        if not folder.is_dir():
            raise UsageError.of(folder, "", "is a file, not a folder", _NEW)
        if any(folder.iterdir()):
            raise UsageError.of(folder, "", "is there already, and not empty", _NEW)
    if not folder.absolute().parent.is_dir():
        raise UsageError.of(folder, "", f"there is no folder {folder.absolute().parent}", "create it")


def write_games(
    games: Iterator[ExportedGame],
    scene: OpenScene,
    folder: Path,
    formats: Formats,
    *,
    title: str,
    on_game: Callable[[int], None] = lambda done: None,
) -> int:
    """Write games of a scene to a folder, which must be new or empty; the number of games.

    `on_game` is called with the number of games that are written. Raises UsageError if the folder holds something or
    can't be written, or a package is missing, and HarnessError if the net can't be converted; the folder is then as
    before.
    """
    check_export(folder, formats)
    with _complete(folder) as partial:
        road = road_file(scene.net_file, title) if formats.opendrive else None
        courses = LaneCourses.read(scene.net_file) if formats.csv else None
        if road is not None:
            with _writing(folder):
                (partial / ROAD_FILE).write_bytes(road.xml)
        rows = []
        for number, game in enumerate(games, start=1):
            files = highd_tables(game, number, courses) if courses is not None else {}
            if formats.openscenario:
                from harness.export.openscenario import scenario_file

                files[f"{game.name}.xosc"] = scenario_file(game, road)
            with _writing(folder):
                for name, content in files.items():
                    (partial / name).write_bytes(content)
            rows.append((number, game.name, game.arm, game.seed, game.episode, game.outcome))
            on_game(number)
        table = pd.DataFrame(rows, columns=["number", "name", "arm", "seed", "episode", "outcome"])
        with _writing(folder):
            table.to_csv(partial / "games.csv", index=False, lineterminator="\n")
    return len(rows)


@contextmanager
def _complete(folder: Path) -> Iterator[Path]:
    """A scratch folder beside a folder, whose place it takes if nothing is raised."""
    partial = folder.absolute().with_name(f".{folder.absolute().name}.{os.getpid()}.partial")
    shutil.rmtree(partial, ignore_errors=True)
    try:
        with _writing(folder):
            partial.mkdir()
        yield partial
        with _writing(folder):
            if folder.is_dir():
                folder.rmdir()
            partial.rename(folder)
    finally:
        shutil.rmtree(partial, ignore_errors=True)


@contextmanager
def _writing(folder: Path) -> Iterator[None]:
    """Raises UsageError about the folder where its files can't be written."""
    try:
        yield
    except OSError as error:
        remedy = "name a folder that you may write"
        raise UsageError.of(folder, "", f"can't be written: {error.strerror}", remedy) from None
