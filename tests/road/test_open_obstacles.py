"""Obstacles of a scene: what scene.toml may say, and how SUMO's traffic meets them."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from harness.drivers.sumo import SumoDriver
from harness.environments.arena import Arena, Seat
from harness.errors import UsageError
from harness.road.scene.open_obstacles import blockages
from harness.road.scene.open_scene import OpenScene, open_scene
from tests.support.scenes import (
    CROSSING_EDGES,
    CROSSING_NODES,
    LEFT_Y,
    RIGHT_Y,
    STRAIGHT_EDGES,
    build_scene,
    drawn,
    placed,
)

FLOW = '<flow id="f" type="van" begin="0" period="2" departLane="0"><route edges="road"/></flow>'
ONE_LANE = STRAIGHT_EDGES.replace('numLanes="2"', 'numLanes="1"')
ON_ONE_LANE = {"ego": ("road", "road_0"), "non_ego": ("road", "road_0", "[60.0, 70.0]"), "goal": "road"}
CLOSED = '[[obstacle]]\nkind = "closed_lane"\nlane = "road_0"\nposition_m = 150.0\nlength_m = 20.0\n'
VAN = '[[obstacle]]\nkind = "van"\nlane = "road_0"\nposition_m = 150.0\n'


def add(scene: OpenScene, *obstacles: str) -> OpenScene:
    file = scene.folder / "scene.toml"
    file.write_text("\n".join([file.read_text(encoding="utf-8"), *obstacles]), encoding="utf-8")
    return open_scene(scene.folder)


@pytest.fixture
def straight(tmp_path: Path) -> OpenScene:
    return build_scene(tmp_path / "straight", others=FLOW, time_limit_s=60.0)


@pytest.mark.parametrize(
    ("obstacle", "key", "message", "remedy"),
    [
        (VAN.replace("road_0", "roda_0"), "obstacle_1.lane", "the net has no lane 'roda_0'", "did you mean 'road_0'?"),
        (VAN.replace("150.0", "310.0"), "obstacle_1.position_m", "reaches from 310 to 310 m", "between 0 and 3"),
        (VAN.replace("van", "tank"), "obstacle_1.kind", "'tank' is not possible", "input should be 'car'"),
        (VAN + "x_m = 3.0\n", "obstacle_1", "give either lane and position_m, or x_m", ""),
        ('[[obstacle]]\nkind = "cone"\nx_m = 3.0\n', "obstacle_1", "has a part of its place: give x_m, y_m", ""),
        (VAN.replace("150.0", "[160.0, 150.0]"), "obstacle_1.position_m", "write the lower end first", ""),
        ('[[obstacle]]\nkind = "wall"\nlane = "road_0"\nposition_m = 9.0\n', "obstacle_1", "a wall needs its", ""),
        (CLOSED + "offset_m = 1.0\n", "obstacle_1", "a closed_lane fills its lane", ""),
        (CLOSED.replace("20.0", "400.0"), "obstacle_1.length_m", "400.0 is not possible", "less than or equal to 200"),
        (CLOSED.replace("150.0", "5.0"), "obstacle_1.position_m", "reaches from -5 to 15 m", "between 10 and 2"),
        ('[[obstacle]]\nkind = "building"\noutline = [[100.0, -3.0], [120.0, 9.0]]\n', "obstacle_1.outline",
         "stands on the road", "make it a wall"),
        ('[[obstacle]]\nkind = "building"\noutline = [[9, 9], [19, 19], [19, 9], [9, 19]]\n', "obstacle_1.outline",
         "its walls cross one another", "in order"),
        ('[[obstacle]]\nkind = "building"\n', "obstacle_1", "a building needs its outline", ""),
        ('[[obstacle]]\nkind = "bus"\nx_m = 90.0\ny_m = 500.0\nheading_deg = 0.0\n', "obstacle_1",
         "stands 500 m from the nearest route", "correct its place"),
        (VAN.replace("150.0", "35.0"), "obstacle_1", "stands on the start of ego in 162 of 200", "move it"),
        (VAN.replace("150.0", "[42.0, 60.0]"), "obstacle_1", "stands on the start of ego", "move it, or the start"),
    ],
)  # fmt: skip
def test_obstacle__that_is_not_possible_is_refused(
    straight: OpenScene, obstacle: str, key: str, message: str, remedy: str
) -> None:
    with pytest.raises(UsageError) as error:
        add(straight, obstacle)
    (problem,) = error.value.problems
    assert (Path(problem.file).name, problem.key) == ("scene.toml", key)
    assert message in problem.message
    assert remedy in problem.remedy


def test_obstacle__with_the_name_of_a_vehicle_is_refused(tmp_path: Path) -> None:
    other = '<vehicle id="obstacle_1" type="van" depart="0"><route edges="road"/></vehicle>'
    with pytest.raises(UsageError, match="is the name of an obstacle of the scene"):
        add(build_scene(tmp_path / "named", others=other), VAN)


@pytest.mark.parametrize(
    ("place", "blocked"),
    [
        (f"x_m = 150.0\ny_m = {RIGHT_Y}\nheading_deg = 0.0\n", {"road_0": (146.75, 153.25)}),
        (f"x_m = 150.0\ny_m = {RIGHT_Y - 1.97}\nheading_deg = 0.0\n", {"road_0": (146.75, 153.25)}),
        (f"x_m = 150.0\ny_m = {RIGHT_Y - 1.99}\nheading_deg = 0.0\n", {}),  # 0.01 m beside a car in the middle
        # across the road it reaches 3.25 m to each side of the line between the lanes
        ("x_m = 150.0\ny_m = -3.2\nheading_deg = 90.0\n", {"road_0": (148.92, 151.08), "road_1": (148.92, 151.08)}),
    ],
)
def test_lane__is_blocked_where_a_car_in_its_middle_has_no_room(
    straight: OpenScene, place: str, blocked: dict[str, tuple[float, float]]
) -> None:
    scene = add(straight, f'[[obstacle]]\nkind = "van"\n{place}')
    found = blockages(scene.lane_strips, scene.obstacles.poses(), scene.obstacles)
    assert {each.strip.name: (each.front_m - each.length_m, each.front_m) for each in found} == {
        name: pytest.approx(reach) for name, reach in blocked.items()
    }


def _fronts_after(scene: OpenScene, seconds: float) -> dict[str, float]:
    """Where the vehicles of the background traffic have come to at most."""
    away = placed(scene, (280.0, LEFT_Y if scene.lane_strips[-1].name == "road_1" else RIGHT_Y, 0.0, 0.0), None)
    farthest: dict[str, float] = {}
    with closing(Arena(scene, 1, [Seat(None), Seat(None)], recorded=True)) as arena:
        arena.reset({0: away}, {0: scene.departures(1)})
        for _ in range(round(seconds / scene.world.step_s)):
            arena.step()
            assert arena.reading is not None
            for slot in np.flatnonzero(arena.reading.present[0]).tolist():
                farthest[str(arena.reading.names[0, slot])] = float(arena.reading.x_m[0, slot] + 3.0)
    return farthest


def test_traffic__drives_round_a_closed_lane(straight: OpenScene) -> None:
    """The flow departs on the closed lane, one vehicle every 2 s: the first 10 have passed it after 50 s."""
    fronts = _fronts_after(add(straight, CLOSED), 50.0)
    assert "obstacle_1.0" not in fronts
    assert sum(front > 165.0 for front in fronts.values()) >= 10
    assert len(fronts) <= 25


def test_traffic__stops_before_an_obstacle_on_the_only_lane(tmp_path: Path) -> None:
    scene = build_scene(tmp_path / "one", edges=ONE_LANE, places=ON_ONE_LANE, others=FLOW, time_limit_s=60.0)
    fronts = _fronts_after(add(scene, VAN), 40.0)
    assert 140.0 < max(fronts.values()) < 146.75  # the van's back
    assert len(fronts) >= 5


def test_obstacle__stands_inside_a_junction(tmp_path: Path) -> None:
    """SUMO's driver in the ego's place waits before debris on its way through the junction."""
    places = {"ego": ("wc ce", "wc_0", "[60.0, 70.0]"), "non_ego": ("sc ce", "sc_0", "[10.0, 20.0]"), "goal": "ce"}
    scene = build_scene(tmp_path / "crossing", CROSSING_NODES, CROSSING_EDGES, places, goal_m=50.0)
    scene = add(scene, '[[obstacle]]\nkind = "debris"\nx_m = 101.0\ny_m = 98.4\nheading_deg = 0.0\n')
    names = {each.strip.name for each in blockages(scene.lane_strips, scene.obstacles.poses(), scene.obstacles)}
    assert any(name.startswith(":c_") for name in names)
    with closing(Arena(scene, 2, [Seat(SumoDriver()), Seat(None)])) as arena:
        for _ in range(2):  # the obstacle is put back in every game
            arena.reset({game: drawn(scene, "start", game, present=[1.0, 0.0]) for game in range(2)})
            for _ in range(120):
                arena.step()
            assert (arena.state.speed_mps[:, 0] < 0.1).all()
            assert (arena.state.x_m[:, 0] + 2.3 < 100.5).all()
            assert (arena.state.x_m[:, 0] > 85.0).all()
