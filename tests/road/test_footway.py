"""Players on foot and on bicycles in a scene: their ways, their surface, their conflicts, the stripes of
marked crossings, and what is refused."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import shapely

from harness.config.road_user import WALKING_MPS
from harness.errors import UsageError
from harness.game.junctions import Control
from harness.road.net.network import read_net
from harness.road.net.walker_conflicts import stripes
from harness.road.scene.open_scene import OpenScene, open_scene
from tests.support.repository import REPOSITORY

NETWORKS = REPOSITORY / "networks"
WAY = "way = [[130.0, -7.6], [150.0, -7.6], [150.0, 6.0]]"


@pytest.fixture(scope="module")
def crossing() -> OpenScene:
    return open_scene(NETWORKS / "crossing")


def changed(folder: Path, scene: str, *edits: tuple[str, str, str]) -> Path:
    """A copy of a shipped scene with changes: file, old and new text."""
    copy = folder / scene
    shutil.copytree(NETWORKS / scene, copy)
    for name, old, new in edits:
        text = (copy / name).read_text(encoding="utf-8")
        assert old in text
        (copy / name).write_text(text.replace(old, new), encoding="utf-8")
    return copy


def problem(folder: Path) -> str:
    with pytest.raises(UsageError) as caught:
        open_scene(folder)
    return str(caught.value)


def test_way__is_the_walkers_route_up_to_its_end(crossing: OpenScene) -> None:
    world, routes = crossing.world, crossing.world.road.routes
    assert world.walks.tolist() == [False, True]
    assert routes.goal_m[1] == pytest.approx(20.0 + 13.6)
    row = routes.rows(np.array([[0.0, 10.0]]))[0, 1]
    assert (routes.x_m[row], routes.y_m[row]) == pytest.approx((140.0, -7.6))
    assert routes.speed_limit_mps[row] == WALKING_MPS
    # on the pavement: 7.6 + 8.5 m to the left edge of the other one, 0.9 m to the right edge
    assert (routes.left_edge_m[row], routes.right_edge_m[row]) == pytest.approx((16.1, -0.9), abs=0.05)


def test_carriageway__is_the_road_between_the_pavements(crossing: OpenScene) -> None:
    y_m = np.array([[-3.7, -3.3], [0.0, 3.3], [0.0, 3.7]])  # in cells of 0.25 m
    x_m = np.full_like(y_m, 150.0)
    assert crossing.world.on_carriageway(x_m, y_m)[:, 1].tolist() == [1.0, 1.0, 0.0]
    assert crossing.world.on_carriageway(x_m, y_m)[:, 0].tolist() == [0.0, 0.0, 0.0]  # the ego is no walker


def test_conflicts__are_where_the_way_crosses_the_lanes(crossing: OpenScene) -> None:
    table = crossing.world.right_of_way.conflicts
    assert table.player.tolist() == [0, 1, 1]
    # the ego, 1.1 m of room on either side of its line at y = -1.75, and the walker, 0.5 m, at x = 150
    assert (table.begin_m[0], table.end_m[0]) == pytest.approx((149.5, 150.5))
    assert (table.zone_m[0], table.length_m[0]) == pytest.approx((20.0 + 7.6 - 2.85, 2.2))
    # the walker, lane by lane: y from -2.85 to -0.65, and from 0.65 to 2.85
    assert table.begin_m[1:] == pytest.approx([24.75, 28.25])
    assert table.length_m[1:] == pytest.approx(1.0)
    # it waits 0.3 m before the lane's side at y = -3.5
    assert table.stop_m[1] == pytest.approx(20.0 + 7.6 - 3.5 - 0.3)
    assert table.yields.tolist() == [False, True, True]  # where there is no marked crossing, the walker


def test_conflicts__at_a_marked_crossing_the_vehicle_yields() -> None:
    tables = open_scene(NETWORKS / "zebra").world.right_of_way
    assert tables.conflicts.yields.tolist() == [True, False, False]
    assert set(tables.stop_lines.player) == {0}
    assert set(tables.stop_lines.control) == {Control.GIVE_WAY}
    assert tables.stop_lines.station_m[-1] == pytest.approx(tables.conflicts.begin_m[0] - 1.0)


def test_way__that_crosses_the_road_inside_a_junction_with_signals_is_refused(tmp_path: Path) -> None:
    walks = """kind = "pedestrian"
way = [[204.4, 80.0], [204.4, 150.0]]                  # along the path beside the road, over the other road
"""
    goal = """speed_mps = [4.0, 5.5]
goal = { edge = "north_out", position_m = 40.0 }"""
    folder = changed(
        tmp_path, "cyclist", ("scene.toml", 'kind = "bicycle"\nvehicle = "non_ego"\n', walks),
        ("scene.toml", goal, "speed_mps = [1.0, 1.4]"),
        ("cyclist.net.xml", 'allow="bicycle"', 'allow="bicycle pedestrian"'),
    )  # fmt: skip
    assert "crosses the road inside junction 'centre'" in problem(folder)


STREET_NODES = '<node id="w" x="0" y="0"/><node id="m" x="150" y="0"/><node id="e" x="300" y="0"/>'
STREET_EDGES = """
    <edge id="wm" from="w" to="m" numLanes="1" speed="13.89" sidewalkWidth="2"/>
    <edge id="me" from="m" to="e" numLanes="1" speed="13.89" sidewalkWidth="2"/>
    <edge id="em" from="e" to="m" numLanes="1" speed="13.89" sidewalkWidth="2"/>
    <edge id="mw" from="m" to="w" numLanes="1" speed="13.89" sidewalkWidth="2"/>"""
STREET_CROSSING = '<crossing node="m" edges="me em" priority="true"/>'
STREET_ROUTES = """<routes><vehicle id="ego" depart="0"><route edges="wm me"/></vehicle></routes>"""
STREET = """name = "street"
net = "test.net.xml"
routes = "street.rou.xml"
time_limit_s = 40.0
[ego]
vehicle = "ego"
route_m = [60.0, 80.0]
speed_mps = [8.0, 13.0]
goal = { edge = "me", position_m = 50.0 }
[[non_ego]]
kind = "pedestrian"
way = [[135.0, 4.2], [X, 4.2], [X, -4.2]]
arrival_after_ego_s = [-2.0, 2.0]
speed_mps = [1.0, 1.4]
"""


@pytest.fixture
def street(tmp_path: Path, build_net: Callable[..., Path]) -> Path:
    """The folder of a street with a crossing of SUMO, which is inside a junction."""
    file = build_net(STREET_NODES, STREET_EDGES, STREET_CROSSING, "--walkingareas")
    (crossing,) = [edge for edge in read_net(file).getEdges(withInternal=True) if edge.getFunction() == "crossing"]
    folder = tmp_path / "street"
    folder.mkdir()
    shutil.copyfile(file, folder / "test.net.xml")
    (folder / "street.rou.xml").write_text(STREET_ROUTES)
    (folder / "scene.toml").write_text(STREET.replace("X", str(crossing.getLane(0).getShape()[0][0])))
    return folder


def test_way__inside_a_junction_is_refused_unless_it_follows_a_crossing(street: Path) -> None:
    tables = open_scene(street).world.right_of_way
    of_walker = tables.conflicts.player == 1
    lanes = [tables.stream_lanes[stream] for stream in tables.conflicts.stream]
    assert lanes == [("", ""), ("em_1", "mw_1"), ("wm_1", "me_1")]
    assert tables.conflicts.yields.tolist() == [True, False, False]
    assert (tables.conflicts.zone_m[of_walker] >= 0.0).all()  # behind the stop lines
    (before_m,) = tables.conflicts.begin_m[~of_walker] - tables.stop_lines.station_m[-1]
    assert before_m == pytest.approx(1.0)
    net = street / "test.net.xml"
    net.write_text(net.read_text().replace('function="crossing"', 'function="walkingarea"'))
    assert "crosses the road inside junction 'm'" in problem(street)


def test_bicycle__rides_on_its_own_lane_and_the_turning_car_yields(tmp_path: Path) -> None:
    turns = ("cyclist.rou.xml", 'edges="west_in east_out"', 'edges="south_in east_out"')
    scene = open_scene(changed(tmp_path, "cyclist", turns, ("scene.toml", 'lane = "west_in_0"', 'lane = "south_in_1"'),
        ("scene.toml", "[110.0, 135.0]", "[40.0, 70.0]")))  # fmt: skip
    routes, table = scene.world.road.routes, scene.world.right_of_way.conflicts
    row = routes.rows(np.array([[0.0, 50.0]]))[0, 1]
    assert routes.x_m[row] == pytest.approx(204.4)  # the centre of south_in_0
    lanes = [scene.world.right_of_way.stream_lanes[stream] for stream in table.stream]
    turn = [row for row in range(len(lanes)) if table.player[row] == 0 and lanes[row] == ("south_in_0", "north_out_0")]
    assert table.yields[turn].tolist() == [True]
    assert scene.world.actuators.max_lateral_mps2.tolist() == [15.0, 3.6]


@pytest.mark.parametrize(
    ("way", "words"),
    [
        ("way = [[150.0, -12.0], [150.0, 6.0]]", ("leaves the surface", "[150.0, -12.0]", "pavements")),
        ("way = [[150.0, -5.5], [150.0, 0.0]]", ("ends on the carriageway", "end it on a pavement")),
        ("way = [[150.0, -1.5], [250.0, -1.5]]", ("ends on the carriageway",)),  # along a lane, without a way off it
        ("way = [[150.0, 6.0], [150.0, 6.0]]", ("is 0.0 m long", "2 to 150 m")),
        ("way = [[10.0, -5.5], [290.0, -5.5]]", ("is 280.0 m long",)),
        ("way = [[150.0, -5.5]]", ("non_ego.way",)),
        (WAY + '\nvehicle = "ego"', ("a pedestrian has no vehicle",)),
        (WAY + '\ngoal = { edge = "eastbound", position_m = 9.0 }', ("a pedestrian has no goal",)),
    ],
)
def test_way__that_nobody_can_walk_is_refused_in_a_line(tmp_path: Path, way: str, words: tuple[str, ...]) -> None:
    text = problem(changed(tmp_path, "crossing", ("scene.toml", WAY, way)))
    assert "scene.toml: non_ego" in text
    assert all(word in text for word in words)


def test_walker__faster_than_people_run_is_refused(tmp_path: Path) -> None:
    text = problem(changed(tmp_path, "crossing", ("scene.toml", "[1.0, 1.4]", "[1.0, 9.0]")))
    assert "a pedestrian's speed_mps is up to 4" in text


def test_bicycle__on_a_route_that_forbids_bicycles_is_refused(tmp_path: Path) -> None:
    forbid = ("cyclist.net.xml", 'id="north_out_0" index="0" allow="bicycle"', 'id="north_out_0" index="0" allow="bus"')
    text = problem(changed(tmp_path, "cyclist", forbid))
    assert "vehicle non_ego: its route passes edge 'north_out', which forbids bicycles" in text


ROAD = shapely.box(0.0, 0.0, 100.0, 7.0)


def test_stripes__cover_every_other_half_metre_of_the_carriageway() -> None:
    corners = np.array(list(stripes([np.array([[50.0, -5.0], [50.0, 12.0]])], ROAD)))
    middles = corners[:, :4].mean(axis=1)
    assert middles[:, 0] == pytest.approx(50.0)
    assert middles[:, 1] == pytest.approx([0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5])
    assert np.ptp(corners, axis=1) == pytest.approx(np.array([[4.0, 0.5]] * 7))  # along the road, along the way


def test_stripes__way_beside_the_road_has_none() -> None:
    assert not list(stripes([np.array([[10.0, 9.0], [90.0, 9.0]])], ROAD))


def test_shipped_scenes__only_the_zebra_is_striped(crossing: OpenScene) -> None:
    assert len(open_scene(NETWORKS / "zebra").stripes) == 7
    assert not crossing.stripes
