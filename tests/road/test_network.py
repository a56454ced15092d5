"""Roads of SUMO nets: the merge scene compared with its geometry, and nets of many kinds built here.

Properties of every net: the drivable area has no holes at its seams, a car on a route's line touches no rail, there are
rails on both sides of the line, and the road is open at the ends of the scene.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pytest
import shapely
from shapely.geometry.base import BaseGeometry
from sumolib.net import Net
from sumolib.net.edge import Edge

from harness.game.arrays import FloatArray
from harness.game.geometry import Box
from harness.game.rails import Rails
from harness.game.road import MARGIN_M, SPACING_M, Route
from harness.road.net import network, surface
from harness.road.net.lane_route import LaneRoute
from harness.road.net.route_table import route_table
from harness.road.net.surface import Part
from harness.road.scene.open_scene import OpenScene
from tests.support.roads import roundabout_sources

Build = Callable[..., Path]

CROSSING = '<node id="c" x="0" y="0"/>' + "".join(
    f'<node id="{name}" x="{x}" y="{y}"/>' for name, x, y in (("n", 0, 80), ("s", 0, -80), ("e", 80, 0), ("w", -80, 0))
)
ARMS = "".join(
    f'<edge id="{arm}c" from="{arm}" to="c" numLanes="{lanes}"/>'
    f'<edge id="c{arm}" from="c" to="{arm}" numLanes="{lanes}"/>'
    for arm, lanes in (("n", 1), ("s", 2), ("e", 1), ("w", 2))
)
CURVE = (
    '<node id="a" x="0" y="0"/><node id="b" x="200" y="200"/>',
    '<edge id="e" from="a" to="b" numLanes="2" shape="0,0 100,0 130,10 160,30 180,60 195,100 200,200"/>',
)
TWO_WAY = (
    '<node id="a" x="0" y="0"/><node id="b" x="150" y="0"/>',
    '<edge id="ab" from="a" to="b" numLanes="2"/><edge id="ba" from="b" to="a"/>',
)
# The entry has one lane, which leads to the right lane of the middle edge; the left exit starts from its left lane.
CHANGE = (
    '<node id="a" x="0" y="-80"/><node id="b" x="80" y="0"/><node id="c" x="180" y="0"/>'
    '<node id="d" x="180" y="80"/><node id="e" x="180" y="-80"/>',
    '<edge id="in" from="a" to="b"/><edge id="middle" from="b" to="c" numLanes="3"/>'
    '<edge id="left" from="c" to="d"/><edge id="right" from="c" to="e"/>',
    '<connection from="in" to="middle" fromLane="0" toLane="0"/>'
    '<connection from="middle" to="left" fromLane="2" toLane="0"/>'
    '<connection from="middle" to="right" fromLane="0" toLane="0"/>',
)
NETS = {
    "curve": CURVE,
    "crossing": (CROSSING, ARMS),
    "crossing without lanes inside": (CROSSING, ARMS, "", "--no-internal-links"),
    "crossing with sidewalks": (CROSSING, ARMS, "", "--sidewalks.guess", "--crossings.guess"),
    "crossing of left-hand traffic": (CROSSING, ARMS, "", "--lefthand"),
    "two-way street": TWO_WAY,
    "roundabout": roundabout_sources(),
    "change of lanes": CHANGE,
}
GENERATED = {
    "grid": ("--grid", "--grid.number", "2", "--grid.attach-length", "60"),
    "grid with turn lanes": ("--grid", "--grid.number", "2", "-L", "2", "--turn-lanes", "1"),
    "random": ("--rand", "--rand.iterations", "8", "--seed", "3"),
}


@dataclass
class Read:
    """A net as the harness reads it, with some routes through it."""

    net: Net

    @cached_property
    def area(self) -> BaseGeometry:
        return network.drivable_area(self.net)

    @cached_property
    def rail_lines(self) -> list[FloatArray]:
        return network.rail_lines(self.net, self.area)

    @cached_property
    def rails(self) -> Rails:
        return network.rails(self.rail_lines)

    @cached_property
    def tables(self) -> list[Route]:
        return [
            route_table(self.net, self.area, LaneRoute(edges), goal=edges[-1], goal_position_m=1.0)
            for edges in routes_through(self.net, 8)
        ]

    def table(self, *names: str, goal_position_m: float = 1.0) -> Route:
        edges = [self.net.getEdge(name) for name in names]
        return route_table(self.net, self.area, LaneRoute(edges), goal=edges[-1], goal_position_m=goal_position_m)


@pytest.fixture(scope="module")
def nets(build_net: Build, generate_net: Build) -> dict[str, Read]:
    built = {name: build_net(*sources) for name, sources in NETS.items()}
    built |= {name: generate_net(*options) for name, options in GENERATED.items()}
    return {name: Read(network.read_net(path)) for name, path in built.items()}


EVERY_NET = pytest.mark.parametrize("name", [*NETS, *GENERATED])


def routes_through(net: Net, most: int) -> list[list[Edge]]:
    """Routes of up to three edges for cars, without turnarounds."""
    found: list[list[Edge]] = []
    for edge in net.getEdges(withInternal=False):
        ways = [[edge]]
        for _ in range(2):
            ways = [[*way, following] for way in ways for following in onward(way[-1]) if following not in way] or ways
        found += ways if edge.allows("passenger") else []
    return found[:: max(1, len(found) // most)]


def onward(edge: Edge) -> list[Edge]:
    return [
        following
        for following, links in edge.getOutgoing().items()
        if any(link.getDirection() not in "tT" and link.getToLane().allows("passenger") for link in links)
    ]


def stations(route: Route) -> FloatArray:
    return np.arange(len(route.x_m)) * SPACING_M - MARGIN_M


def clearance(rails: Rails, route: Route, offset_m: float = 0.0) -> FloatArray:
    """Distance to the rails of a car at all stations of the route, at a lateral offset."""
    along = stations(route)
    inside = (along >= 2.5) & (along <= route.length_m - 2.5)
    heading = route.heading_rad[inside]
    x = route.x_m[inside] - offset_m * np.sin(heading)
    y = route.y_m[inside] + offset_m * np.cos(heading)
    cars = Box(x[:, None], y[:, None], heading[:, None], np.array([4.6]), np.array([1.8]))
    return rails.distance_m(cars, 10.0)


def test_merge__rails_are_in_their_places(merge: OpenScene) -> None:
    lines = sorted(merge.rail_lines, key=lambda line: line[:, 1].mean())
    assert len(lines) == 2
    low, high = (shapely.LineString(line) for line in lines)
    # the right rail: straight, the taper from (100, -6.4) to (130, -3.2), straight; the openings take 0.3 m
    assert low.hausdorff_distance(shapely.LineString([(0.3, -6.4), (100, -6.4), (130, -3.2), (219.7, -3.2)])) < 0.02
    assert high.hausdorff_distance(shapely.LineString([(0.3, 0), (219.7, 0)])) < 0.02


def test_merge__lane_0_ends_at_100_m_and_lane_1_continues(merge: OpenScene) -> None:
    routes = merge.world.road.routes
    row = routes.first_row[0] + round((50.0 + MARGIN_M) / SPACING_M)
    assert routes.lane_offset_m[row].tolist() == pytest.approx([-3.2, 0.0])
    assert routes.lane_end_m[row].tolist() == [100.0, np.inf]


def test_merge__goal_and_limit(merge: OpenScene) -> None:
    routes = merge.world.road.routes
    assert routes.goal_m.tolist() == [175.0, 175.0]  # 100 m approach, 30 m junction, 45 m along the exit
    assert (routes.speed_limit_mps == 13.89).all()


@EVERY_NET
def test_area__has_no_holes_at_seams(nets: dict[str, Read], name: str) -> None:
    area = nets[name].area
    assert area.is_valid
    for part in getattr(area, "geoms", [area]):
        for ring in part.interiors:  # a hole is a block between streets, not a gap at a seam
            assert not shapely.Polygon(ring).buffer(-1.0).is_empty


@EVERY_NET
def test_area__covers_every_lane(nets: dict[str, Read], name: str) -> None:
    area = nets[name].area.buffer(0.05)
    for edge in nets[name].net.getEdges(withInternal=False):
        for lane in network.car_lanes(edge):
            half = 0.5 * lane.getWidth() - 0.05
            assert area.covers(shapely.LineString(network.lane_line(lane)).buffer(half, cap_style="flat"))


@EVERY_NET
def test_route__a_car_on_its_line_touches_no_rail(nets: dict[str, Read], name: str) -> None:
    assert nets[name].tables
    for table in nets[name].tables:
        assert clearance(nets[name].rails, table).min() > 0.0


@EVERY_NET
def test_route__its_line_has_no_jumps(nets: dict[str, Read], name: str) -> None:
    for table in nets[name].tables:
        steps = np.hypot(np.diff(table.x_m), np.diff(table.y_m))
        assert steps.max() <= SPACING_M + 1e-6
        assert steps.min() > 0.3 * SPACING_M
        turned = np.abs((np.diff(table.heading_rad) + np.pi) % (2.0 * np.pi) - np.pi)
        assert turned.max() < 0.8


@EVERY_NET
def test_route__has_rails_on_both_sides(nets: dict[str, Read], name: str) -> None:
    read = nets[name]
    for table in read.tables:
        assert (table.left_edge_m > 0.9).all()
        assert (table.right_edge_m < -0.9).all()
        row = stations(table).searchsorted(15.0)  # on the first edge, outside junctions
        for offset in (table.left_edge_m[row], table.right_edge_m[row]):
            x = np.array([table.x_m[row] - offset * np.sin(table.heading_rad[row])])
            y = np.array([table.y_m[row] + offset * np.cos(table.heading_rad[row])])
            point = Box(x[:, None], y[:, None], np.zeros((1, 1)), np.array([0.1]), np.array([0.1]))
            assert read.rails.distance_m(point, 10.0) < 0.05


@pytest.mark.parametrize("name", ["curve", "crossing", "crossing of left-hand traffic", "two-way street", "roundabout"])
def test_fringe__is_open(nets: dict[str, Read], name: str) -> None:
    read = nets[name]
    outer = [edge.getID() for edge in read.net.getEdges(withInternal=False) if not onward(edge)]
    assert outer
    for edge in outer:
        table = read.table(edge)
        last = np.flatnonzero(stations(table) <= table.length_m)[-1]
        for row in range(last - 6, last + 12):  # from the road to beyond its end
            place = (np.array([[each]]) for each in (table.x_m[row], table.y_m[row], table.heading_rad[row]))
            assert read.rails.distance_m(Box(*place, np.array([4.6]), np.array([1.8])), 10.0) > 0.0


def test_fringe__a_ring_has_none(build_net: Build) -> None:
    square = [(0, 0), (60, 0), (60, 60), (0, 60)]
    nodes = "".join(f'<node id="{k}" x="{x}" y="{y}"/>' for k, (x, y) in enumerate(square))
    edges = "".join(f'<edge id="e{k}" from="{k}" to="{(k + 1) % 4}"/>' for k in range(4))
    lines = Read(network.read_net(build_net(nodes, edges))).rail_lines
    assert len(lines) == 2  # the inner and the outer rail, each closed
    for line in lines:
        assert line[0] == pytest.approx(line[-1])


def test_two_way__the_turnaround_beyond_the_end_is_not_drivable(nets: dict[str, Read]) -> None:
    west, _, east, _ = nets["two-way street"].area.bounds
    assert (west, east) == pytest.approx((0.0, 150.0), abs=0.02)


def test_crossing__left_and_right_edges_reach_into_the_arms(nets: dict[str, Read]) -> None:
    table = nets["crossing"].table("sc", "cn")
    middle = np.abs(table.y_m - nets["crossing"].net.getNode("c").getCoord()[1]).argmin()
    approach = stations(table).searchsorted(30.0)
    assert table.left_edge_m[middle] > 10.0  # in the middle the area extends into the side streets
    assert table.right_edge_m[middle] < -10.0
    assert table.left_edge_m[approach] - table.right_edge_m[approach] == pytest.approx(4 * 3.2, abs=0.05)


def test_change_of_lanes__the_line_changes_lanes_on_the_edge(nets: dict[str, Read]) -> None:
    table = nets["change of lanes"].table("in", "middle", "left")
    middle = nets["change of lanes"].net.getEdge("middle")
    entry, exit_ = (network.lane_line(middle.getLane(k)) for k in (0, 2))
    line = shapely.LineString(np.stack((table.x_m, table.y_m), axis=1))
    assert line.distance(shapely.Point(entry[0])) < 0.3
    assert line.distance(shapely.Point(exit_[-1])) < 0.3


def test_junction__lanes_stay_side_by_side_inside(build_net: Build) -> None:
    places = (("a", 0, 0), ("b", 80, 0), ("c", 160, 0), ("d", 80, 80))
    nodes = "".join(f'<node id="{name}" x="{x}" y="{y}"/>' for name, x, y in places)
    edges = "".join(
        f'<edge id="{start}{end}" from="{start}" to="{end}" numLanes="{lanes}"/>'
        for start, end, lanes in (("a", "b", 2), ("b", "c", 2), ("d", "b", 1))
    )
    table = Read(network.read_net(build_net(nodes, edges))).table("ab", "bc")
    inside = (stations(table) >= 0.0) & (stations(table) <= table.length_m)
    assert np.allclose(table.lane_offset_m[inside], [-3.2, 0.0], atol=0.05)


@pytest.mark.parametrize("name", ["crossing", "crossing without lanes inside"])
def test_goal__is_at_its_position_on_its_edge(nets: dict[str, Read], name: str) -> None:
    table = nets[name].table("wc", "cn", goal_position_m=25.0)
    row = stations(table).searchsorted(table.goal_m)
    lane = nets[name].net.getLane("cn_0")  # SUMO's lane length may differ from its shape
    goal = shapely.LineString(network.lane_line(lane)).interpolate(25.0 / lane.getLength(), normalized=True)
    assert goal.distance(shapely.Point(table.x_m[row], table.y_m[row])) < 0.6


# --- bicycle lanes, pavements, bridges and distant roads --------------------------------------------------------------

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


# --- the marks between own and oncoming lanes: offsets from the leftmost own lane, positive to the left ---------------

IN_A_ROW = "".join(f'<node id="{name}" x="{x}" y="0"/>' for name, x in (("a", 0), ("b", 100), ("c", 200)))


def road_edge(name: str, start: str, end: str, lanes: int = 1, **more: str) -> str:
    extra = "".join(f' {key}="{value}"' for key, value in more.items())
    return f'<edge id="{name}" from="{start}" to="{end}" numLanes="{lanes}" speed="13.9"{extra}/>'


def on_net(net_file: Path, *names: str) -> Route:
    return Read(network.read_net(net_file)).table(*names, goal_position_m=20.0)


def marks(route: Route, station_m: float) -> tuple[float, float]:
    """The left and the right mark at a station."""
    row = round((station_m + MARGIN_M) / SPACING_M)
    return float(route.own_left_m[row]), float(route.own_right_m[row])


def two_way(build_net: Build, *options: str, lanes: int = 1) -> Route:
    edges = (
        road_edge("ab", "a", "b", lanes)
        + road_edge("bc", "b", "c", lanes)
        + road_edge("ba", "b", "a")
        + road_edge("cb", "c", "b")
    )
    return on_net(build_net(IN_A_ROW, edges, "", *options), "ab", "bc")


@pytest.mark.parametrize("lanes", [1, 2])
def test_marks__where_traffic_keeps_to_the_right_are_on_the_left(build_net: Build, lanes: int) -> None:
    road = two_way(build_net, lanes=lanes)
    # the route is on the leftmost lane: half a lane to the mark, however many lanes there are to the right
    assert marks(road, 50.0) == pytest.approx((1.6, -np.inf))
    assert marks(road, 150.0) == pytest.approx((1.6, -np.inf))


def test_marks__where_traffic_keeps_to_the_left_are_on_the_right(build_net: Build) -> None:
    assert marks(two_way(build_net, "--lefthand", "true"), 50.0) == pytest.approx((np.inf, -1.6))


def test_marks__of_a_one_way_road_there_are_none(build_net: Build) -> None:
    road = on_net(build_net(IN_A_ROW, road_edge("ab", "a", "b", 2) + road_edge("bc", "b", "c", 2)), "ab", "bc")
    assert np.isinf(road.own_left_m).all()
    assert np.isinf(road.own_right_m).all()


def test_marks__beyond_a_reservation_there_are_none(build_net: Build) -> None:
    """The carriageways are 8 m apart: oncoming lanes are not next to the own ones."""
    apart = road_edge("ab", "a", "b", shape="0,0 100,0") + road_edge("ba", "b", "a", shape="100,8 0,8")
    road = on_net(build_net(IN_A_ROW, apart + road_edge("bc", "b", "c")), "ab", "bc")
    assert marks(road, 50.0) == (np.inf, -np.inf)


def test_marks__end_at_the_junction(build_net: Build) -> None:
    """The road b-d leaves towards the north: inside the junction there is no mark."""
    nodes = IN_A_ROW + '<node id="d" x="100" y="100"/>'
    edges = "".join(road_edge(name, name[0], name[1]) for name in ("ab", "ba", "bc", "cb", "bd", "db"))
    road = on_net(build_net(nodes, edges), "ab", "bd")
    assert marks(road, 50.0) == pytest.approx((1.6, -np.inf))
    along = stations(road)
    inside = np.isinf(road.own_left_m) & (along > 0.0) & (along < road.length_m)
    assert inside.any()
    places: FloatArray = np.stack((road.x_m, road.y_m), axis=1)[inside]
    assert np.hypot(*(places - [100.0, 0.0]).T).max() < 20.0, "only around the junction at (100, 0)"
    assert marks(road, road.length_m - 30.0) == pytest.approx((1.6, -np.inf))


# --- the surface as plain geometry: slits, levels, and cars that follow lines -----------------------------------------

SQUARE = shapely.box(0.0, 0.0, 20.0, 20.0)


def beside(gap_m: float) -> shapely.MultiPolygon:
    return shapely.union(SQUARE, shapely.box(20.0 + gap_m, 0.0, 40.0, 20.0))


@pytest.mark.parametrize(("gap_m", "parts"), [(0.2, 1), (0.9, 1), (1.1, 2), (3.0, 2)])
def test_slits__thinner_than_a_metre_are_closed(gap_m: float, parts: int) -> None:
    assert len(shapely.get_parts(surface.without_slits(beside(gap_m)))) == parts


@pytest.mark.parametrize(("width_m", "holes"), [(0.9, 0), (1.1, 1)])
def test_slits__holes_thinner_than_a_metre_are_closed(width_m: float, holes: int) -> None:
    area = surface.without_slits(SQUARE.difference(shapely.box(5.0, 5.0, 15.0, 5.0 + width_m)))
    assert len(area.interiors) == holes


def road(x_from: float, x_to: float, height_m: float, own: bool) -> Part:
    """A road along x, 6 m wide, whose height begins at 0 and ends at `height_m`."""
    line = np.array([[x_from, 0.0, 0.0], [0.5 * (x_from + x_to), 0.0, height_m], [x_to, 0.0, height_m]])
    return Part(shape=surface.lane_shape(line[:, :2], 6.0), line=line, own=own)


def test_levels__only_the_overlap_that_differs_in_height_is_cut() -> None:
    """A ramp leaves the own road at its height, climbs in a loop, and crosses it above."""
    ramp_line = np.array([[0.0, 3.0, 0.0], [80.0, 30.0, 3.0], [120.0, 0.0, 6.0], [120.0, -60.0, 6.0]])
    ramp = Part(shape=surface.lane_shape(ramp_line[:, :2], 4.0), line=ramp_line, own=False)
    own = road(-100.0, 200.0, 0.0, True)
    _, kept = surface.own_level([own, ramp])
    assert kept.shape.intersects(shapely.Point(4.0, 3.0))  # where it leaves
    assert not kept.shape.intersects(shapely.Point(120.0, 0.0))  # where it crosses


def test_swept__a_car_that_follows_a_sharp_bend_stays_inside() -> None:
    bend = np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 20.0]])
    lane = surface.lane_shape(bend, 2.2)
    area = surface.with_swept_paths(lane, [bend])
    diagonal = np.array([np.cos(np.pi / 4), np.sin(np.pi / 4)])
    ends = np.stack([(20.0, 0.0) + side * 2.3 * diagonal for side in (-1.0, 1.0)])
    car = surface.lane_shape(ends, 1.8)
    assert not lane.covers(car)
    assert area.covers(car)
