"""Routes of trips: they are those of SUMO, respect permissions, and are found once."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

import numpy as np
import platformdirs
import pytest

from harness.environments.arena import Arena, Seat
from harness.errors import UsageError
from harness.road.demand import trips
from harness.road.scene.load_check import check_loads
from harness.road.scene.open_scene import OpenScene
from tests.support.scenes import CARS, CROSSING_EDGES, CROSSING_NODES, build_scene, drawn

BUS_ONLY = CROSSING_EDGES.replace('id="cn"', 'id="cn" allow="bus"')


@pytest.fixture(autouse=True)
def _empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(platformdirs, "user_cache_dir", lambda name: str(tmp_path / "cache"))


def crossing(folder: Path, others: str, edges: str = CROSSING_EDGES, cars: str = CARS) -> OpenScene:
    """A crossing from west to east and from south to north, with background traffic."""
    places = {"ego": ("wc ce", "wc_0"), "non_ego": ("wc ce", "wc_0"), "goal": "ce"}
    return build_scene(folder, CROSSING_NODES, edges, places, others=others, cars=cars, goal_m=50.0)


def test_trip__has_a_route_in_the_game(tmp_path: Path) -> None:
    scene = crossing(tmp_path, '<flow id="f" from="sc" to="ce" period="9"/><trip id="t" from="wc" to="cn" depart="1"/>')
    found = {each.name: each.edges for each in scene.departures(1)}
    assert found == {"f.0": ("sc", "ce"), "f.1": ("sc", "ce"), "f.2": ("sc", "ce"), "t": ("wc", "cn")}
    check_loads(scene)


def test_trip__of_a_mix_has_a_route_for_each_type(tmp_path: Path) -> None:
    mix = '<vTypeDistribution id="mix"><vType id="b" vClass="bus"/><vType id="d" vClass="coach"/></vTypeDistribution>'
    edges = CROSSING_EDGES.replace('id="cn"', 'id="cn" allow="bus coach"')
    scene = crossing(tmp_path, '<flow id="f" type="mix" from="sc" to="cn" period="1"/>', edges, CARS + mix)
    drawn_types = {each.vehicle_type: each.edges for each in scene.departures(1)}
    assert drawn_types == {"b": ("sc", "cn"), "d": ("sc", "cn")}


@pytest.mark.parametrize(
    ("others", "message"),
    [
        ('<trip id="t" type="van" from="sc" to="cn"/>', "trip t: no route for a passenger leads from 'sc' to 'cn'"),
        ('<flow id="t" from="wc" to="ce" via="cs" period="2"/>', "flow t: the net has no edge 'cs'"),
    ],
)
def test_trip__without_a_route_is_named(tmp_path: Path, others: str, message: str) -> None:
    with pytest.raises(UsageError) as raised:
        crossing(tmp_path, others, BUS_ONLY)
    (problem,) = raised.value.problems
    assert message in str(problem)
    assert problem.remedy


def test_trip__after_the_end_of_a_game_does_not_matter(tmp_path: Path) -> None:
    scene = crossing(tmp_path, '<trip id="t" from="ce" to="wc" depart="20"/>')  # games end at 20 s
    assert scene.departures(1) == []


def test_routes__are_found_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    others = '<trip id="t" from="wc" to="cn" depart="1"/>'
    first = crossing(tmp_path / "a", others).departures(1)

    def fail(*_: object) -> None:
        raise AssertionError("duarouter runs again")

    monkeypatch.setattr(trips, "run_program", fail)
    net = tmp_path / "a" / "n.net.xml"
    monkeypatch.setattr(
        Path, "read_bytes", lambda path, read=Path.read_bytes: read(net if path.name == net.name else path)
    )
    assert crossing(tmp_path / "b", others).departures(1) == first


def test_stop__holds_a_vehicle_in_the_game(tmp_path: Path) -> None:
    stop = '<stop lane="ce_0" startPos="20" endPos="30" duration="3"/>'
    place = 'departPos="60" departSpeed="8" arrivalPos="60"'
    vehicle = f'<vehicle id="bus" depart="0" {place}>{stop}<route edges="sc ce"/></vehicle>'
    scene = crossing(tmp_path, vehicle)
    check_loads(scene)
    speeds = []
    with closing(Arena(scene, 1, [Seat(None), Seat(None)], recorded=True)) as arena:
        arena.reset({0: drawn(scene, 1, present=(1.0, 0.0))}, {0: scene.departures(1)})
        for _ in range(150):
            arena.step(np.tile([-1.0, 0.0], (1, 2, 1)))  # the players brake
            reading = arena.reading
            assert reading is not None
            speeds += [float(speed) for speed in reading.speed_mps[0] if reading.present[0].any()]
    assert max(speeds) > 5.0
    assert sum(speed < 0.05 for speed in speeds) * 0.1 == pytest.approx(3.0, abs=0.4)
    assert speeds[-1] > 0.0 or len(speeds) < 150
