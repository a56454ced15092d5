"""People on foot and on bicycles in the replay of a game."""

from __future__ import annotations

import pandas as pd

from harness.replay.vehicles import types_of_vehicles
from harness.traffic.scene import open_scene
from tests.support.repository import REPOSITORY


def test_types__a_walker_and_a_cyclist_look_like_what_they_are() -> None:
    expected = {"crossing": ("pedestrian", 0.5, 0.5), "cyclist": ("bicycle", 1.8, 0.65)}
    for name, looks in expected.items():
        scene = open_scene(REPOSITORY / "networks" / name)
        kinds = [scene.vehicle(player).vehicle_type for player in range(2)]
        trace = pd.DataFrame({"player": ["ego", "non_ego"], "vehicle_type": kinds})
        drawn = types_of_vehicles(trace, scene.route_files)["non_ego"]
        assert (drawn.shape, drawn.length_m, drawn.width_m) == looks
