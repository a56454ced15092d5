"""Games drawn by hand as exports write them, on scenes with other kinds of road users."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import pandas as pd

from harness.export.exported_game import ExportedGame, exported_game
from harness.road.scene.open_scene import OpenScene, open_scene
from tests.support.replays import drive, game, straight
from tests.support.repository import REPOSITORY

_MORE_TYPES = '<vType id="van" length="5.5" width="2.0" guiShape="delivery"/><vType id="city_bus" vClass="bus"/>'


def exported(trace: pd.DataFrame, scene: OpenScene, name: str = "game") -> ExportedGame:
    return exported_game(trace, scene, name=name, arm="naive_vs_speedy", seed=1, episode=0, outcome="collision")


def merge_with_vans(folder: Path) -> OpenScene:
    """The scene tests/data/merge with the types `van` and `city_bus`."""
    shutil.copytree(REPOSITORY / "tests" / "data" / "merge", folder)
    routes = next(folder.glob("*.rou.xml"))
    routes.write_text(routes.read_text().replace("</routes>", f"{_MORE_TYPES}</routes>"))
    return open_scene(folder)


def kinds_of_players(scene: OpenScene) -> tuple[str, str]:
    """The vehicle types of the ego and the person."""
    ego, person = (scene.vehicle(player).vehicle_type for player in range(2))
    return ego, person


def walker_game() -> tuple[pd.DataFrame, OpenScene]:
    """On the scene `crossing`: a walker crosses in front of the ego."""
    return _meeting("crossing", [(150.0, -8.0 + 0.06 * k, 0.5 * math.pi + 0.01 * k, 0.6) for k in range(60)])


def bicycle_game() -> tuple[pd.DataFrame, OpenScene]:
    """On the scene `cyclist`: a bicycle turns in front of the ego."""
    return _meeting("cyclist", [(150.0 + 0.4 * k, 0.01 * k**2, 0.02 * k, 4.0) for k in range(60)])


def signals_game() -> tuple[pd.DataFrame, OpenScene]:
    """On the scene `red_light`: its light turns from green to yellow after 2 s and to red after 5 s."""
    trace, scene = _meeting("red_light", [(201.6, 204.0 + k, 0.5 * math.pi, 10.0) for k in range(60)])
    states = ["rrrGGgrrrGGg"] * 20 + ["rrryyyrrryyy"] * 30 + ["GGgrrrGGgrrr"] * 10
    return trace.assign(signals=[f"crossing={states[step]}" for step in trace["step"]]), scene


def _meeting(name: str, person: list[tuple[float, float, float, float]]) -> tuple[pd.DataFrame, OpenScene]:
    scene = open_scene(REPOSITORY / "networks" / name)
    ego_type, person_type = kinds_of_players(scene)
    trace = game(
        drive("ego", straight(100.0, -1.6, 10.0, 50), vehicle_type=ego_type, outcome="goal"),
        drive("non_ego", person, vehicle_type=person_type),
    )
    return trace, scene
