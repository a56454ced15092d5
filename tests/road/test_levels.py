"""Roads over one another: no player meets or sees a vehicle on a bridge above it, or on the road below its bridge."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.environments.arena import Arena, Seat
from harness.errors import UsageError
from harness.game.observation_layout import LAYOUT
from harness.game.outcome import Outcome
from harness.road.demand.route_file import Departure
from harness.road.net.levels import on_players_level
from harness.road.scene.open_scene import OpenScene
from tests.support.scenes import build_scene, placed

# The road eastward on the ground crosses the one northward, on a bridge of this height, at (0, 0) before netconvert
# moves the net by 150 m; lanes are 1.6 m to the right of the lines.
HEIGHT_M = 7.0
EDGES = '<edge id="east" from="w" to="e"/><edge id="north" from="s" to="n"/>'
CROSSING_X, CROSSING_Y = 151.6, 148.4
VAN = '<vehicle id="some" type="van" depart="50"><route edges="east"/></vehicle>'  # so that there is traffic


def nodes(height_m: float, slope: float = 0.0) -> str:
    """The ends of both roads; the ground rises from west to east."""
    east_z, bridge_z = slope * 300.0, slope * 150.0 + height_m
    return (
        f'<node id="w" x="-150" y="0" z="0"/><node id="e" x="150" y="0" z="{east_z}"/>'
        f'<node id="s" x="0" y="-150" z="{bridge_z}"/><node id="n" x="0" y="150" z="{bridge_z}"/>'
    )


def scene(folder: Path, own: str, height_m: float = HEIGHT_M, slope: float = 0.0) -> OpenScene:
    """Both players on one road."""
    places = {"ego": (own, f"{own}_0"), "non_ego": (own, f"{own}_0"), "goal": own}
    return build_scene(folder, nodes(height_m, slope), EDGES, places, VAN, time_limit_s=60.0)


def seen_and_met(opened: OpenScene, own: str, other: str) -> tuple[int, bool, bool]:
    """The most background vehicles in the bodies of a game, whether the player at the crossing saw one, and whether it
    was hit, in 20 s with vans on the other road."""
    heading = 0.0 if own == "east" else np.pi / 2.0
    start = placed(opened, (CROSSING_X, CROSSING_Y, heading, 0.0), None)
    van = Departure(name="", vehicle_type="van", edges=(other,), depart_s=0.0, lane="0", position="base", speed="max")
    vans = [replace(van, name=f"van{k}", depart_s=2.0 * k) for k in range(5)]
    most, saw = 0, False
    with closing(Arena(opened, 1, [Seat(None), Seat(None)])) as arena:
        arena.reset({0: start}, {0: vans})
        for _ in range(190):
            if not arena.state.running[0, 0]:
                break
            step = arena.step(np.zeros((1, 2, 2)))
            most = max(most, int(step.quantities.bodies.present[0, 2:].sum()))
            saw |= bool(arena.observation[0, 0, LAYOUT.index("other0_seen")])
        return most, saw, arena.state.outcome[0, 0] == Outcome.COLLISION


@pytest.mark.parametrize(("own", "other"), [("east", "north"), ("north", "east")])
@pytest.mark.parametrize("slope", [0.0, 0.015])
def test_bridge__vehicles_on_the_other_level_are_neither_met_nor_seen(
    own: str, other: str, slope: float, tmp_path: Path
) -> None:
    opened = scene(tmp_path / "scene", own, slope=slope)
    assert opened.roads_m is not None
    assert seen_and_met(opened, own, other) == (0, False, False)


def test_level__vehicles_on_the_players_own_road_are_met_whatever_its_slope(tmp_path: Path) -> None:
    opened = scene(tmp_path / "scene", "east", slope=0.05)
    most, saw, met = seen_and_met(opened, "east", "east")
    assert (saw, met) == (True, False)  # SUMO's drivers stop behind a car that stands
    assert most > 1


def test_flat__needs_no_heights(tmp_path: Path) -> None:
    assert scene(tmp_path / "scene", "east", height_m=2.0).roads_m is None
    assert seen_and_met(scene(tmp_path / "flat", "east", height_m=2.0), "east", "north")[2]  # as at a level crossing


def test_bridge__a_player_whose_route_leads_over_the_other_is_refused(tmp_path: Path) -> None:
    places = {"ego": ("east", "east_0"), "non_ego": ("north", "north_0"), "goal": "east"}
    with pytest.raises(
        UsageError, match=r"'east' and 'north' of the players' routes lie over one another, 7\.0 m apart"
    ):
        build_scene(tmp_path / "bridge", nodes(HEIGHT_M), EDGES, places)


def test_level__is_that_of_the_nearest_part_of_the_players_roads() -> None:
    ramp = np.array([[x, 0.0, 0.05 * x] for x in np.arange(0.0, 201.0, 4.0)])  # 10 m up in 200 m
    places = np.array(
        [
            [180.0, 0.0, 9.0],  # on the ramp
            [20.0, 0.0, 9.0],  # over its beginning
            [180.0, 0.0, 2.0],  # under its end
            [100.0, 50.0, 8.0],  # on a side street that rises by 3 m in 50 m
            [100.0, 90.0, 12.0],  # on a bridge 7 m above it, 90 m beside it
            [100.0, 30.0, 12.0],  # on a bridge 7 m above it, 30 m beside it
        ]
    )
    assert on_players_level(ramp, places).tolist() == [True, False, False, True, False, False]
