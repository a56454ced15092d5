"""What is drivable in nets with bicycle lanes, pavements, bridges and distant roads."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
import shapely
from sumolib.net import Net

from harness.road.net import network

Build = Callable[..., Path]

STREET = '<node id="a" x="0" y="0"/><node id="b" x="100" y="0"/>'
# lanes from the right: pavement, bicycle lane, car lane; and a bicycle lane behind a pavement
PAINTED = (
    '<edge id="e" from="a" to="b" numLanes="3"><lane index="0" allow="pedestrian" width="2"/>'
    '<lane index="1" allow="bicycle" width="1.5"/></edge>'
)
BEHIND = (
    '<edge id="e" from="a" to="b" numLanes="3"><lane index="0" allow="bicycle" width="1.5"/>'
    '<lane index="1" allow="pedestrian" width="2"/></edge>'
)
BUS = '<edge id="e" from="a" to="b" numLanes="2"><lane index="0" allow="bus"/></edge>'
BRIDGE = (
    '<node id="w" x="-150" y="0" z="0"/><node id="e" x="150" y="0" z="0"/>'
    '<node id="s" x="0" y="-150" z="7"/><node id="n" x="0" y="150" z="7"/>',
    '<edge id="below" from="w" to="e"/><edge id="above" from="s" to="n"/>',
)
LONG = (
    "".join(f'<node id="{k}" x="{400 * k}" y="0"/>' for k in range(4)),
    "".join(f'<edge id="e{k}" from="{k}" to="{k + 1}"/>' for k in range(3)),
)


def on_lane(net: Net, name: str) -> shapely.Point:
    return shapely.LineString(network.lane_line(net.getLane(name))).interpolate(50.0)


@pytest.mark.parametrize(
    ("edges", "lane", "drivable"),
    [
        (PAINTED, "e_2", True),
        (PAINTED, "e_1", True),
        (PAINTED, "e_0", False),
        (BEHIND, "e_0", False),
        (BUS, "e_0", True),
    ],
)
def test_area__of_the_lanes_beside_a_car_lane(build_net: Build, edges: str, lane: str, drivable: bool) -> None:
    net = network.read_net(build_net(STREET, edges))
    assert network.drivable_area(net).intersects(on_lane(net, lane)) is drivable


def test_area__pavements_inside_a_junction_are_not_drivable(generate_net: Build) -> None:
    net = network.read_net(generate_net("--grid", "--grid.number", "3", "--sidewalks.guess", "--crossings.guess"))
    area = network.drivable_area(net)
    corners = [edge for edge in net.getEdges() if edge.getFunction() == "walkingarea"]
    assert corners
    for corner in corners:
        pavement = shapely.Polygon(network.lane_line(corner.getLane(0)))
        assert area.intersection(pavement).area < 0.35 * pavement.area  # cars cut some corners


@pytest.mark.parametrize(("own", "other"), [("below", "above"), ("above", "below")])
def test_bridge__the_rails_of_the_players_road_are_closed_and_no_other_rail_crosses_it(
    build_net: Build, own: str, other: str
) -> None:
    net = network.read_net(build_net(*BRIDGE))
    edges = [net.getEdge(own)]
    area = network.drivable_area(net, edges)
    rails = shapely.MultiLineString(network.rail_lines(net, area, edges))
    lines = {name: shapely.LineString(network.lane_line(net.getLane(f"{name}_0"))) for name in (own, other)}
    assert not rails.intersects(lines[own].buffer(0.9))
    place = lines[own].intersection(lines[other])
    assert rails.distance(place) == pytest.approx(1.6, abs=0.02)  # the edge of its lane, under or on the bridge, too
    assert not area.covers(lines[other])


def test_area__ends_some_way_from_the_players_routes_where_roads_stay_open(build_net: Build) -> None:
    net = network.read_net(build_net(*LONG))
    own = [net.getEdge("e0")]
    area = network.drivable_area(net, own)
    assert area.covers(shapely.LineString([(1.0, -1.6), (799.0, -1.6)]))  # e0 and e1, which begins beside it
    assert not area.intersects(shapely.LineString([(810.0, -1.6), (1199.0, -1.6)]))
    rails = shapely.MultiLineString(network.rail_lines(net, area, own))
    assert not rails.intersects(shapely.box(0.0, -2.6, 1200.0, -0.6))  # no wall across the road where the area ends
