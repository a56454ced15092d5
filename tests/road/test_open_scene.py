"""Opening a scene: each inconsistency of its files is reported with file, key and remedy."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from harness.errors import Problem, UsageError
from harness.road.scene.open_scene import OpenScene, open_scene


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


def only(folder: Path) -> tuple[str, str, str]:
    """File, key, and message with remedy of the only problem."""
    (problem,) = problems(folder)
    return Path(problem.file).name, problem.key, f"{problem.message} ({problem.remedy})"


def test_merge__opens(merge: OpenScene) -> None:
    world = merge.world
    assert world.steps == 250
    assert world.length_m.tolist() == [4.6, 4.6]
    assert world.width_m.tolist() == [1.8, 1.8]
    assert world.actuators.max_speed_mps.tolist() == [40.0, 40.0]
    assert world.actuators.friction == 0.8
    assert merge.edges == (("approach", "exit"), ("approach", "exit"))
    assert merge.vehicle(1).vehicle_type == "person_car"
    assert merge.departures(np.random.default_rng(0)) == []  # there is no background traffic


def test_scene__departures_are_those_of_the_background_traffic(folder: Path) -> None:
    flow = '<flow id="more" type="person_car" route="through" begin="1" period="10" departLane="1"/>'
    change(folder, "merge.rou.xml", "</routes>", f"{flow}</routes>")
    departures = open_scene(folder).departures(np.random.default_rng(0))
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


def test_scene_file__a_missing_one_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "scene.tml").write_text("", encoding="utf-8")
    assert only(tmp_path) == ("scene.toml", "", "there is no such file (did you mean 'scene.tml'?)")


@pytest.mark.parametrize(
    ("file", "old", "new", "expected"),
    [
        (
            "scene.toml",
            'vehicle = "ego"',
            'vehicle = "eggo"',
            ("scene.toml", "ego.vehicle", "merge.rou.xml has no vehicle 'eggo' (did you mean 'ego'?)"),
        ),
        (
            "scene.toml",
            "[-8.0, 8.0]",
            "[-48.0, 8.0]",
            (
                "scene.toml",
                "non_ego.beside_ego_m",
                "reaches from -18 to 53 m, off lane 'approach_0' of 100 m "
                "(keep it between 0 and 100 m, or give route_m instead of lane)",
            ),
        ),
        (
            "merge.rou.xml",
            'maxSpeed="40" speedFactor="1.0" speedDev="0.0"',
            'maxSpeed="12" speedFactor="1.0" speedDev="0.0"',
            ("scene.toml", "ego.speed_mps", "reaches 14 m/s, more than the vehicle's maxSpeed (keep it to 12 m/s)"),
        ),
        (
            "merge.rou.xml",
            "</routes>",
            '<flow id="third" period="5"><route edges="aproach"/></flow></routes>',
            ("merge.rou.xml", "vehicle third", "the net has no edge 'aproach' (did you mean 'approach'?)"),
        ),
    ],
)
def test_scene__an_inconsistency_with_the_net_is_named(
    folder: Path, file: str, old: str, new: str, expected: tuple[str, str, str]
) -> None:
    change(folder, file, old, new)
    assert only(folder) == expected


def own_route(folder: Path, edges: str) -> None:
    """Give the ego a route of its own."""
    change(
        folder,
        "merge.rou.xml",
        '<vehicle id="ego" type="ego_car" route="through"',
        f'<route id="own" edges="{edges}"/><vehicle id="ego" type="ego_car" route="own"',
    )


def test_route__must_be_connected(folder: Path) -> None:
    own_route(folder, "exit approach")
    change(folder, "scene.toml", 'edge = "exit"\nposition_m = 45.0', 'edge = "approach"\nposition_m = 90.0')
    change(
        folder,
        "scene.toml",
        'lane = "approach_1"\nposition_m = [30.0, 45.0]',
        'lane = "exit_0"\nposition_m = [3.0, 4.0]',
    )
    change(folder, "scene.toml", "beside_ego_m = [-8.0, 8.0]", "position_m = [3.0, 4.0]")
    expected = "its route has no connection from edge 'exit' to 'approach' (correct the route's edges)"
    assert only(folder) == ("merge.rou.xml", "vehicle ego", expected)


def test_route__must_pass_the_start(folder: Path) -> None:
    own_route(folder, "exit")
    expected = "'approach_1' is not on the route of vehicle 'ego' (choose a lane of one of its edges)"
    assert only(folder) == ("scene.toml", "ego.lane", expected)


def test_background__may_not_have_the_name_of_a_player(folder: Path) -> None:
    change(folder, "merge.rou.xml", 'vehicle id="ego"', 'vehicle id="hero"')
    change(folder, "merge.rou.xml", "</routes>", '<vehicle id="ego" route="through" depart="3"/></routes>')
    change(folder, "scene.toml", 'vehicle = "ego"', 'vehicle = "hero"')
    expected = "has the name of a player, but is not the player's vehicle (rename it)"
    assert only(folder) == ("merge.rou.xml", "vehicle ego", expected)


def test_scene__all_problems_are_named_at_once(folder: Path) -> None:
    change(folder, "scene.toml", 'edge = "exit"', 'edge = "exi"')
    change(folder, "scene.toml", 'lane = "approach_0"', 'lane = "approach_7"')
    change(folder, "scene.toml", 'vehicle = "ego"', 'vehicle = "eggo"')
    change(folder, "merge.rou.xml", "</routes>", '<vehicle id="third"><route edges="exitt"/></vehicle></routes>')
    keys = [each.key for each in problems(folder)]
    assert keys == ["vehicle third", "ego.vehicle", "goal.edge", "non_ego.lane"]


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
