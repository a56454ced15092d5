"""Persons of a route file: how they are read, which walks SUMO can carry out, and how they depart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

from harness.errors import UsageError
from harness.road.demand.route_file import RouteFile
from harness.road.demand.route_reading import read_route_file
from harness.road.scene.load_check import check_loads
from harness.road.scene.open_scene import open_scene
from tests.support.scenes import CROSSING_EDGES, CROSSING_NODES, build_scene

Places = Mapping[str, Sequence[str]]
STREETS: Places = {"ego": ("wc ce", "wc_0"), "non_ego": ("wc ce", "wc_0", "[50.0, 60.0]"), "goal": "ce"}
PAVED = CROSSING_EDGES.replace('spreadType="right"', 'spreadType="right" sidewalkWidth="2"')
CARS_ALONE = CROSSING_EDGES.replace('id="cn"', 'id="cn" allow="passenger"')
PAVED_PLACES: Places = {"ego": ("wc ce", "wc_1"), "non_ego": ("wc ce", "wc_1", "[50.0, 60.0]"), "goal": "ce"}


def read(folder: Path, content: str) -> RouteFile:
    path = folder / "a.rou.xml"
    path.write_text(f"<routes>{content}</routes>", encoding="utf-8")
    return read_route_file(path)


def person(walk: str, attributes: str = 'depart="2"') -> str:
    return f'<person id="p" {attributes}>{walk}</person>'


def test_person__has_the_type_the_size_and_the_places_of_sumo(tmp_path: Path) -> None:
    routes = read(tmp_path, person('<walk edges="a b" arrivalPos="-5" speed="1.1"/>', 'depart="2" departPos="7"'))
    found = routes.vehicles["p"]
    kind = routes.types[found.vehicle_type]
    assert (found.on_foot, found.edges, found.depart_s) == (True, ("a", "b"), 2.0)
    assert (found.position, found.arrival[1], found.speed) == ("7", "-5", "1.1")
    assert (kind.name, kind.length_m, kind.width_m) == ("DEFAULT_PEDTYPE", 0.215, 0.478)
    assert kind.vehicle_class == "pedestrian"


def test_walk__along_a_named_route_has_its_edges(tmp_path: Path) -> None:
    routes = read(tmp_path, '<route id="r" edges="a b"/>' + person('<walk route="r"/>'))
    assert routes.vehicles["p"].edges == ("a", "b")


@pytest.mark.parametrize(
    ("walk", "message"),
    [
        ('route="q"', "unknown route 'q'"),
        ('route="several"', "'several' is a routeDistribution"),
        ('route="r" edges="a"', "has edges and a route"),
    ],
)
def test_walk__along_no_single_route_is_refused(walk: str, message: str, tmp_path: Path) -> None:
    several = '<routeDistribution id="several"><route id="r" edges="a"/><route id="s" edges="b"/></routeDistribution>'
    with pytest.raises(UsageError, match=f"person p.walk: {message}"):
        read(tmp_path, several + person(f"<walk {walk}/>"))


def test_flow__of_persons_has_the_rates_of_other_flows(tmp_path: Path) -> None:
    flow = '<personFlow id="f" begin="0" end="100" personsPerHour="360"><walk edges="a"/></personFlow>'
    drawn = read(tmp_path, flow).departures(set(), 25.0, np.random.default_rng(1))
    assert [(each.name, each.depart_s) for each in drawn] == [("f.0", 0.0), ("f.1", 10.0), ("f.2", 20.0)]


def test_place__at_random_is_drawn_for_each_game(tmp_path: Path) -> None:
    routes = read(tmp_path, person('<walk edges="a" departPos="random"/>'))
    places = [routes.departures(set(), 9.0, np.random.default_rng(k))[0].position for k in (1, 2, 1)]
    assert places[0] == places[2] != places[1]
    assert all(0.0 <= float(each.removesuffix(" of the edge")) <= 1.0 for each in places)


def test_walk__without_edges_is_found_by_sumo(tmp_path: Path) -> None:
    walk = person('<walk from="sc" to="ce"/>', 'depart="2" departPos="max"')
    scene = build_scene(tmp_path, CROSSING_NODES, CROSSING_EDGES, STREETS, others=walk, goal_m=50.0)
    (found,) = scene.departures(1)
    assert found.edges == ("sc", "ce")
    edge_m = float(found.position)  # in metres: SUMO's edges end before the junction
    assert 80.0 < edge_m < 100.0
    check_loads(scene)


def test_walk__against_the_direction_of_edges_is_possible(tmp_path: Path) -> None:
    back = person('<walk edges="ce wc"/>')
    scene = build_scene(tmp_path, CROSSING_NODES, CROSSING_EDGES, STREETS, others=back, goal_m=50.0)
    assert scene.departures(1)[0].edges == ("ce", "wc")


def test_net__with_walking_areas_has_no_persons(tmp_path: Path) -> None:
    net_options = ("--crossings.guess", "true")
    walk = person('<walk edges="wc"/>')
    with pytest.raises(UsageError) as raised:
        build_scene(tmp_path, CROSSING_NODES, PAVED, PAVED_PLACES, others=walk, goal_m=50.0, net_options=net_options)
    (problem,) = raised.value.problems
    assert problem.key == "person"
    assert "libsumo 1.28 may die of a segmentation fault" in problem.message
    assert "rebuild the net without crossings" in problem.remedy


@pytest.mark.parametrize(
    ("walk", "edges", "expected"),
    [
        ('<walk edges="wc sc"/>', CROSSING_EDGES, r"person p: SUMO moves it "),
        # the pavements of two streets are not connected
        ('<walk edges="wc ce"/>', PAVED, r"person p: SUMO moves it .* at once, from edge 'wc' to 'ce'"),
        ('<walk edges="sc cn"/>', CARS_ALONE, r"person p: walks on edge 'cn', none of whose lanes allows pedestrians"),
        ('<walk edges="wc" arrivalPos="there"/>', CROSSING_EDGES, r"person p\.arrivalPos: 'there' is not a place"),
        ('<walk edges="wc" duration="9"/>', CROSSING_EDGES, r"walk\.duration: is not supported \(give a speed\)"),
        ('<walk edges="wc"/><walk edges="ce"/>', CROSSING_EDGES, r"person p: has 2 walks, one is possible"),
    ],
)
def test_walk__that_sumo_does_not_carry_out_is_refused(tmp_path: Path, walk: str, edges: str, expected: str) -> None:
    places = PAVED_PLACES if edges is PAVED else STREETS
    with pytest.raises(UsageError, match=expected):
        build_scene(tmp_path, CROSSING_NODES, edges, places, others=person(walk), goal_m=50.0)


def test_player__is_no_person_of_the_route_file(tmp_path: Path) -> None:
    scene = build_scene(tmp_path, others='<person id="walker" depart="0"><walk edges="road"/></person>')
    document = (scene.folder / "scene.toml").read_text().replace('vehicle = "non_ego"', 'vehicle = "walker"')
    (scene.folder / "scene.toml").write_text(document)
    with pytest.raises(UsageError, match=r'is a person.*kind = "pedestrian"'):
        open_scene(scene.folder)
