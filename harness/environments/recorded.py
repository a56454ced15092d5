"""Recorded games of a scene: traces with the vehicle types of the scene's routes and obstacles."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

import pandas as pd

from harness.evaluation.recorded_game import BodyKind, RecordedGame
from harness.game.roles import EGO
from harness.road.scene.open_scene import OpenScene, open_scene


def recorded_game(trace: pd.DataFrame, scene: OpenScene) -> RecordedGame:
    """The game of a trace, which was played on this scene, with the ego's vehicle type that is in the trace."""
    types = trace.loc[trace["player"] == scene.world.roles[EGO], "vehicle_type"]
    if len(types) and types.iloc[0] in scene.routes.types and types.iloc[0] != scene.vehicle(EGO).vehicle_type:
        scene = _opened(scene.folder, str(types.iloc[0]))
    return RecordedGame(trace=trace, world=scene.world, kinds=kinds_of(scene))


@lru_cache(maxsize=4)
def _opened(folder: Path, ego_type: str) -> OpenScene:
    return open_scene(folder, ego_type)


def kinds_of(scene: OpenScene) -> Mapping[str, BodyKind]:
    """The kind of each vehicle type of a scene, and of its obstacles, by its name in traces."""
    return {
        name: BodyKind(length_m=each.length_m, width_m=each.width_m, vehicle_class=each.vehicle_class)
        for name, each in scene.routes.types.items()
    }
