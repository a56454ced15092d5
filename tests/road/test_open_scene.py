"""Opening a scene: each inconsistency of its files is reported with file, key and remedy."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from harness.errors import Problem, UsageError
from harness.game.geometry import Box
from harness.game.quantities import REACH_M
from harness.game.rails import Rails
from harness.road.scene.open_scene import OpenScene, open_scene
from tests.support.scenes import CARS, CROSSING, CROSSING_EDGES, CROSSING_NODES, build_scene


@pytest.fixture
def folder(repository: Path, tmp_path: Path) -> Path:
    """A copy of tests/data/merge to modify, with a document without comments."""
    copy = Path(shutil.copytree(repository / "tests" / "data" / "merge", tmp_path / "merge"))
    document = (copy / "scene.toml").read_text(encoding="utf-8")
    (copy / "scene.toml").write_text(re.sub(r" *#.*", "", document), encoding="utf-8")
    return copy


def change(folder: Path, name: str, old: str, new: str) -> None:
    path = folder / name
    text = path.read_text(encoding="utf-8")
    assert old in text, "the scene does not have the text that this test replaces"
    path.write_text(text.replace(old, new), encoding="utf-8")


def problems(folder: Path) -> list[Problem]:
    with pytest.raises(UsageError) as raised:
        open_scene(folder)
    for each in raised.value.problems:
        assert Path(each.file).parent == folder
        assert each.remedy
    return raised.value.problems


def test_merge__opens(merge: OpenScene) -> None:
    world = merge.world
    assert world.steps == 250
    assert world.length_m.tolist() == [4.6, 4.6]
    assert world.width_m.tolist() == [1.8, 1.8]
    assert world.actuators.max_speed_mps.tolist() == [40.0, 40.0]
    assert world.actuators.friction == 0.8
    assert merge.edges == (("approach", "exit"), ("approach", "exit"))
    assert merge.vehicle(1).vehicle_type == "person_car"
    assert merge.departures(0) == []  # there is no background traffic


def test_rails__are_found_as_far_as_a_long_player_reaches(tmp_path: Path) -> None:
    """Beside the roads of a crossing, where only the ends of a player of 40 m are near the rails."""
    long = CARS.replace('id="person_car" length="4.6"', 'id="person_car" length="40"')
    scene = build_scene(tmp_path / "long", CROSSING_NODES, CROSSING_EDGES, CROSSING, cars=long, goal_m=50.0)
    own, everything = scene.world.road.rails, Rails.of(scene.world.road.rails.segments[:-1], 200.0)
    x_m, y_m = np.meshgrid(np.arange(0.0, 200.0, 7.0), np.arange(0.0, 200.0, 1.0))
    cars = Box(x_m, y_m, np.full(x_m.shape, 0.5 * np.pi), np.full(x_m.shape[1], 40.0), np.full(x_m.shape[1], 2.5))
    distances_m = everything.distance_m(cars, REACH_M)
    np.testing.assert_array_equal(own.distance_m(cars, REACH_M), distances_m)
    assert (distances_m < REACH_M).any()


def test_scene__departures_are_those_of_the_background_traffic(folder: Path) -> None:
    flow = '<flow id="more" type="person_car" route="through" begin="1" period="10" departLane="1"/>'
    change(folder, "merge.rou.xml", "</routes>", f"{flow}</routes>")
    departures = open_scene(folder).departures(0)
    assert [(each.name, each.depart_s) for each in departures] == [("more.0", 1.0), ("more.1", 11.0), ("more.2", 21.0)]


def test_scene__each_player_has_its_own_actuators_and_size(folder: Path) -> None:
    change(folder, "merge.rou.xml", 'id="person_car" length="4.60"', 'id="person_car" length="9.10"')
    change(folder, "scene.toml", "[[non_ego]]", "[ego.actuators]\nmax_braking_mps2 = 5.5\n[[non_ego]]")
    world = open_scene(folder).world
    assert world.length_m.tolist() == [4.6, 9.1]
    assert world.actuators.max_braking_mps2.tolist() == [5.5, 8.0]


def test_scene__starts_use_the_lane_length_of_sumo(folder: Path) -> None:
    # the shape of approach is 100 m long; with a lane length of 200 m, a bumper at 40 m is at 20 m of the shape
    change(folder, "merge.net.xml", 'length="100.00"', 'length="200.00"')
    x, y, _ = open_scene(folder).places[0].pose(40.0, 4.6)
    assert (x, y) == pytest.approx((20.0 - 2.3, -1.6))


def test_scene__all_problems_are_named_at_once(folder: Path) -> None:
    change(folder, "scene.toml", 'edge = "exit"', 'edge = "exi"')
    change(folder, "scene.toml", 'lane = "approach_0"', 'lane = "approach_7"')
    change(folder, "scene.toml", 'vehicle = "ego"', 'vehicle = "eggo"')
    change(folder, "merge.rou.xml", "</routes>", '<vehicle id="third"><route edges="exitt"/></vehicle></routes>')
    keys = [each.key for each in problems(folder)]
    assert keys == ["vehicle third", "ego.vehicle", "goal.edge", "non_ego.lane"]


def test_scene__a_problem_of_the_route_file_hides_no_misspelt_lane(folder: Path) -> None:
    change(folder, "scene.toml", 'lane = "approach_0"', 'lane = "aproach_0"')
    change(folder, "merge.rou.xml", "</routes>", '<vehicle id="third" depart="soon"/></routes>')
    found = {(Path(each.file).name, each.key, each.remedy) for each in problems(folder)}
    assert ("scene.toml", "non_ego.lane", "did you mean 'approach_0'?") in found
    assert any(name == "merge.rou.xml" for name, *_ in found)


def test_scene__a_problem_of_the_document_hides_none_of_the_files(folder: Path) -> None:
    change(folder, "scene.toml", "friction =", "fricton =")
    change(folder, "merge.rou.xml", 'route="through" depart="0" departLane="0"', 'route="trough" depart="soon"')
    change(folder, "merge.net.xml", 'speed="13.89" length="90.00"', 'speed="-1" length="nan"')
    assert {(Path(each.file).name, each.key) for each in problems(folder)} >= {
        ("scene.toml", "fricton"),
        ("merge.rou.xml", "vehicle non_ego"),
        ("merge.net.xml", "lane exit_0.speed"),
        ("merge.net.xml", "lane exit_0.length"),
    }
