"""The marks between own and oncoming lanes, by hand: on two-way roads, in both kinds of countries, at junctions.

Lanes are 3.2 m wide. Offsets are from the centre of the leftmost own lane, positive to the left.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from harness.game.arrays import FloatArray
from harness.game.road import MARGIN_M, SPACING_M, Route
from harness.road.net import network
from harness.road.net.route_table import route_table

Build = Callable[..., Path]
NODES = "".join(f'<node id="{name}" x="{x}" y="0"/>' for name, x in (("a", 0), ("b", 100), ("c", 200)))


def edge(name: str, start: str, end: str, lanes: int = 1, **more: str) -> str:
    extra = "".join(f' {key}="{value}"' for key, value in more.items())
    return f'<edge id="{name}" from="{start}" to="{end}" numLanes="{lanes}" speed="13.9"{extra}/>'


def route(net_file: Path, *names: str) -> Route:
    """The route over these edges, with its goal in the middle of the last one."""
    net = network.read_net(net_file)
    edges = [net.getEdge(name) for name in names]
    return route_table(net, network.drivable_area(net), edges, goal=edges[-1], goal_position_m=20.0)


def marks(route: Route, station_m: float) -> tuple[float, float]:
    """The left and the right mark at a station."""
    row = round((station_m + MARGIN_M) / SPACING_M)
    return float(route.own_left_m[row]), float(route.own_right_m[row])


def two_way(build_net: Build, *options: str, lanes: int = 1) -> Route:
    edges = edge("ab", "a", "b", lanes) + edge("bc", "b", "c", lanes) + edge("ba", "b", "a") + edge("cb", "c", "b")
    return route(build_net(NODES, edges, "", *options), "ab", "bc")


@pytest.mark.parametrize("lanes", [1, 2])
def test_marks__where_traffic_keeps_to_the_right_are_on_the_left(build_net: Build, lanes: int) -> None:
    road = two_way(build_net, lanes=lanes)
    # the route is on the leftmost lane: half a lane to the mark, however many lanes there are to the right
    assert marks(road, 50.0) == pytest.approx((1.6, -np.inf))
    assert marks(road, 150.0) == pytest.approx((1.6, -np.inf))


def test_marks__where_traffic_keeps_to_the_left_are_on_the_right(build_net: Build) -> None:
    assert marks(two_way(build_net, "--lefthand", "true"), 50.0) == pytest.approx((np.inf, -1.6))


def test_marks__of_a_one_way_road_there_are_none(build_net: Build) -> None:
    road = route(build_net(NODES, edge("ab", "a", "b", 2) + edge("bc", "b", "c", 2)), "ab", "bc")
    assert np.isinf(road.own_left_m).all()
    assert np.isinf(road.own_right_m).all()


def test_marks__beyond_a_reservation_there_are_none(build_net: Build) -> None:
    """The carriageways are 8 m apart: oncoming lanes are not next to the own ones."""
    apart = edge("ab", "a", "b", shape="0,0 100,0") + edge("ba", "b", "a", shape="100,8 0,8")
    road = route(build_net(NODES, apart + edge("bc", "b", "c")), "ab", "bc")
    assert marks(road, 50.0) == (np.inf, -np.inf)


def test_marks__end_at_the_junction(build_net: Build) -> None:
    """The road b-d leaves towards the north: inside the junction there is no mark."""
    nodes = NODES + '<node id="d" x="100" y="100"/>'
    edges = "".join(edge(name, name[0], name[1]) for name in ("ab", "ba", "bc", "cb", "bd", "db"))
    road = route(build_net(nodes, edges), "ab", "bd")
    assert marks(road, 50.0) == pytest.approx((1.6, -np.inf))
    stations = np.arange(len(road.x_m)) * SPACING_M - MARGIN_M
    inside = np.isinf(road.own_left_m) & (stations > 0.0) & (stations < road.length_m)
    assert inside.any()
    places: FloatArray = np.stack((road.x_m, road.y_m), axis=1)[inside]
    assert np.hypot(*(places - [100.0, 0.0]).T).max() < 20.0, "only around the junction at (100, 0)"
    assert marks(road, road.length_m - 30.0) == pytest.approx((1.6, -np.inf))
