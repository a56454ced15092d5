"""The road of a planner: lanes with neighbours and successors, and a route that leads over them to the goal."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from harness.game.cartesian_view import CartesianRoad
from harness.game.roles import EGO
from harness.road.net.lane_map import lane_map
from harness.road.net.network import read_net
from harness.road.scene.open_scene import OpenScene, open_scene

NODES = '<node id="a" x="0" y="0"/><node id="b" x="100" y="0"/><node id="c" x="200" y="0"/>'
EDGES = (
    '<edge id="ab" from="a" to="b" numLanes="2" speed="13.89"/><edge id="bc" from="b" to="c" numLanes="1" speed="20"/>'
)


@pytest.mark.parametrize(("options", "left", "right"), [((), "ab_1", None), (("--lefthand",), None, "ab_1")])
def test_lane__has_its_neighbours_where_traffic_keeps_right_and_left(
    options: tuple[str, ...], left: str | None, right: str | None, build_net: Callable[..., Path]
) -> None:
    net = read_net(build_net(NODES, EDGES, "", *options))
    lanes = lane_map(net, [net.getEdge("ab"), net.getEdge("bc")])
    outer = lanes["ab_0"]
    assert (outer.left, outer.right) == (left, right)
    assert (outer.edge, outer.speed_limit_mps, outer.width_m) == ("ab", 13.89, 3.2)
    assert "passenger" in outer.vehicle_classes
    successors = {after for lane in ("ab_0", "ab_1") for after in lanes[lane].successors}
    assert all(lanes[inner].in_junction and lanes[inner].successors == ("bc_0",) for inner in successors)
    assert successors


@pytest.fixture(scope="module")
def red_light() -> OpenScene:
    return open_scene("red_light")


@pytest.mark.parametrize("name", ["roundabout", "left_across", "red_light", "cyclist"])
def test_route__leads_over_successors_and_neighbours_to_the_goal(name: str) -> None:
    scene = open_scene(name)
    for player, road in enumerate(scene.cartesian_roads):
        lanes = [road.lanes[lane] for lane in road.route_lanes]
        for lane, following, after in zip(lanes, lanes[1:], road.route_lanes[1:], strict=False):
            assert after in (*lane.successors, lane.left, lane.right), following
        assert list(dict.fromkeys(lane.edge for lane in lanes if not lane.in_junction)) == list(road.route_edges)
        points = np.concatenate([lane.line for lane in lanes])
        assert distance_m(points, road.route_line[0]) < 3.5
        np.testing.assert_allclose(np.hypot(*np.diff(road.route_line, axis=0).T), 0.5, atol=0.05)
        assert road.goal_m == pytest.approx(scene.world.road.routes.goal_m[player])
        nearest = road.route_line[round(road.goal_m / 0.5)]
        assert np.hypot(*(nearest - (road.goal_x_m, road.goal_y_m))) < 0.5
        assert Path(road.net_file).is_file()


def distance_m(points: np.ndarray, point: np.ndarray) -> float:
    return float(np.hypot(*(points - point).T).min())


def test_signals__stand_at_the_ends_of_lanes_of_the_route(red_light: OpenScene) -> None:
    road: CartesianRoad = red_light.cartesian_roads[EGO]
    assert road.signals
    for signal in road.signals:
        assert set(signal.lanes) & set(road.route_lanes)
        line_end = road.route_line[round(signal.station_m / 0.5)]
        ends = [road.lanes[lane].line[-1] for lane in signal.lanes]
        assert min(float(np.hypot(*(end - line_end))) for end in ends) < 8.0
