"""Conflicts and stop lines of small nets, by hand.

The crossing has its centre at the origin (100, 100 in the net), lanes of 3.2 m, and stop lines 7.2 m from the centre.
The road from west to east has priority. Cars need 2.2 m of a lane's width.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from sumolib.net import Net

from harness.game.geometry import Box, box_distance
from harness.game.junctions import SAMPLE, Conflicts, Control, RightOfWay
from harness.game.roles import EGO, NON_EGO
from harness.road.net import network
from harness.road.net.lane_route import LaneRoute
from harness.road.net.right_of_way_table import right_of_way
from harness.road.net.stream import Feeders, Stream, carries_traffic
from harness.road.scene.open_scene import open_scene
from tests.support.repository import REPOSITORY
from tests.support.roads import roundabout_sources

Build = Callable[..., Path]
ARMS = [f"{a}{b}" for arm in "wesn" for a, b in ((arm, "c"), ("c", arm))]
CONTROLS = ("priority", "priority_stop", "allway_stop", "right_before_left", "traffic_light", "zipper", "unregulated")


def crossing_sources(kind: str) -> tuple[str, str]:
    """The nodes and edges of a crossing of two two-way roads."""
    nodes = f'<node id="c" x="0" y="0" type="{kind}"/>'
    ends = (("w", -100, 0), ("e", 100, 0), ("s", 0, -100), ("n", 0, 100))
    nodes += "".join(f'<node id="{name}" x="{x}" y="{y}"/>' for name, x, y in ends)
    edges = [f'<edge id="{e}" from="{e[0]}" to="{e[1]}" priority="{2 if set(e) & set("we") else 1}"/>' for e in ARMS]
    return nodes, "".join(edges)


@pytest.fixture(scope="module")
def crossings(build_net: Build) -> dict[str, Net]:
    built = {kind: build_net(*crossing_sources(kind), "", "--no-turnarounds") for kind in CONTROLS}
    built["bare"] = build_net(*crossing_sources("priority"), "", "--no-internal-links", "--no-turnarounds")
    built["lefthand"] = build_net(*crossing_sources("priority"), "", "--lefthand", "--no-turnarounds")
    return {kind: network.read_net(path) for kind, path in built.items()}


def of(net: Net, *routes: str) -> RightOfWay:
    """The right of way of players with these routes, each a list of edges."""
    return right_of_way(net, [LaneRoute([net.getEdge(name) for name in route.split()]) for route in routes])


def conflict(net: Net, route: str, stream: str) -> dict[str, Any] | None:
    """The conflict of a route with the stream between two edges of one lane; None without one."""
    tables = of(net, route)
    source, target = stream.split()
    lanes = (f"{source}_0", f"{target}_0")
    if lanes not in tables.stream_lanes:
        return None
    row = tables.conflicts.stream.tolist().index(tables.stream_lanes.index(lanes))
    return {name: getattr(tables.conflicts, name)[row] for name in Conflicts._fields}


@pytest.mark.parametrize("kind", ["priority", "traffic_light", "unregulated", "bare"])
def test_zone__of_two_straight_streams_is_where_their_cars_need_room(crossings: dict[str, Net], kind: str) -> None:
    # northbound on x = 1.6, a route from y = -100; westbound traffic on y = 1.6 has its stop line at x = 7.2
    met = conflict(crossings[kind], "sc cn", "ec cw")
    assert met is not None
    assert (met["begin_m"], met["end_m"]) == pytest.approx((100.5, 102.7))
    assert (met["zone_m"], met["length_m"]) == pytest.approx((7.2 - 2.7, 2.2))
    assert met["stop_m"] == pytest.approx(92.8)


@pytest.mark.parametrize(
    ("kind", "route", "stream", "inside"),
    [
        ("traffic_light", "sc cw", "nc cs", True),  # a left turn across oncoming traffic
        ("priority", "wc cn", "ec cw", True),  # the same from the road with priority
        ("priority", "sc cw", "nc cs", False),  # from the other road cars wait at the line, for the road with priority
        ("traffic_light", "sc cn", "ec cw", False),
    ],
)
def test_wait__is_where_sumo_divides_the_lane_inside_the_junction(
    crossings: dict[str, Net], kind: str, route: str, stream: str, inside: bool
) -> None:
    net, met = crossings[kind], conflict(crossings[kind], route, stream)
    assert met is not None
    before, after = (net.getLane(f"{edge}_0") for edge in route.split())
    inner_m = shapely.LineString(net.getLane(before.getConnection(after).getViaLaneID()).getShape()).length
    assert met["wait_m"] == pytest.approx(92.8 + (inner_m if inside else 0.0), abs=0.01)
    assert met["stop_m"] == pytest.approx(92.8)
    assert met["wait_m"] < met["begin_m"]


def test_zone__mirrored_with_left_hand_traffic(crossings: dict[str, Net]) -> None:
    met = conflict(crossings["lefthand"], "sc cn", "wc ce")  # eastbound traffic is on y = 1.6
    assert met is not None
    assert (met["begin_m"], met["end_m"]) == pytest.approx((100.5, 102.7))
    assert met["yields"]


def test_zone__of_a_stream_that_joins_goes_on_for_10_m(crossings: dict[str, Net]) -> None:
    met = conflict(crossings["priority"], "sc cn", "wc cn")
    assert met is not None
    assert met["end_m"] == pytest.approx(met["begin_m"] + 10.0)
    assert met["length_m"] == pytest.approx(10.0)
    assert 92.8 < met["begin_m"] < 107.2, "the lanes begin to overlap inside the junction"
    # from where its centre line is within half a lane of the route's, a car of the stream is a leader
    assert met["zone_m"] < met["until_m"] < met["zone_m"] + 10.0


@pytest.mark.parametrize("stream", ["ec cn", "sc ce", "sc cw"])
def test_zone__none_with_streams_that_do_not_meet_the_route(crossings: dict[str, Net], stream: str) -> None:
    assert conflict(crossings["priority"], "wc cs", stream) is None


def test_stream__leads_back_to_the_start_of_its_road_and_on_behind_the_junction(crossings: dict[str, Net]) -> None:
    tables = of(crossings["priority"], "sc cn")
    west = tables.stream_lanes.index(("wc_0", "ce_0"))
    samples = tables.streams.samples[tables.streams.stream == west]
    x_m, along_m = (samples[:, SAMPLE.index(name)] for name in ("x_m", "along_m"))
    assert along_m == pytest.approx(x_m - 92.8)
    assert along_m.min() < -88.0  # the road begins 92.8 m before the stop line
    assert 14.4 + 16.0 < along_m.max() < 14.4 + 20.0


def test_stream__begins_120_m_before_its_stop_line(build_net: Build) -> None:
    nodes = '<node id="a" x="-300" y="0"/><node id="b" x="-60" y="0"/><node id="c" x="0" y="0" type="priority"/>'
    nodes += '<node id="d" x="80" y="0"/><node id="s" x="0" y="-80"/><node id="n" x="0" y="80"/>'
    edges = "".join(f'<edge id="{each}" from="{each[0]}" to="{each[1]}"/>' for each in ("ab", "bc", "cd", "sc", "cn"))
    net = network.read_net(build_net(nodes, edges, "", "--no-turnarounds"))
    tables = of(net, "sc cn")
    west = tables.stream_lanes.index(("bc_0", "cd_0"))
    along_m = tables.streams.samples[tables.streams.stream == west, SAMPLE.index("along_m")]
    assert -120.0 < along_m.min() < -116.0, "over the joint at b, which has one way in and one way out"


@pytest.mark.parametrize(
    ("kind", "route", "stream", "yields"),
    [
        # the road from west to east has priority
        ("priority", "sc cn", "wc ce", True),
        ("priority", "sc cn", "ec cw", True),
        ("priority", "wc ce", "sc cn", False),
        ("priority", "wc ce", "nc cs", False),
        ("priority_stop", "sc cn", "wc ce", True),
        ("bare", "sc cn", "wc ce", True),
        # a left turn across oncoming traffic, which turns in two lanes inside the junction
        ("priority", "wc cn", "ec cw", True),
        ("priority", "wc cn", "ec cn", True),
        ("priority", "wc cn", "sc cn", False),
        ("priority", "ec cw", "wc cn", False),
        ("priority", "sc cw", "nc cs", True),
        # the right has priority
        ("right_before_left", "wc ce", "sc cn", True),
        ("right_before_left", "sc cn", "wc ce", False),
        ("right_before_left", "wc cn", "ec cw", True),
        # lights that are off
        ("traffic_light", "sc cn", "wc ce", True),
        ("traffic_light", "wc ce", "sc cn", False),
        ("traffic_light", "wc ce", "sc cw", False),
        ("unregulated", "sc cn", "wc ce", False),
    ],
)
def test_yields__by_the_net(crossings: dict[str, Net], kind: str, route: str, stream: str, yields: bool) -> None:
    met = conflict(crossings[kind], route, stream)
    assert met is not None
    assert met["yields"] == yields
    assert not met["first_come"]


@pytest.mark.parametrize("kind", ["allway_stop", "zipper"])
def test_yields__to_the_first_at_an_all_way_stop_and_a_zipper(crossings: dict[str, Net], kind: str) -> None:
    for route, stream in (("sc cn", "wc ce"), ("wc ce", "sc cn")):
        met = conflict(crossings[kind], route, stream)
        assert met is not None
        assert met["first_come"]


def test_roundabout__an_entry_yields_to_the_ring_and_the_ring_to_no_entry(build_net: Build) -> None:
    tables = of(network.read_net(build_net(*roundabout_sources())), "i0 r0 r1 o2")
    conflicts = tables.conflicts
    met = [(*tables.stream_lanes[s], bool(y)) for s, y in zip(conflicts.stream, conflicts.yields, strict=True)]
    assert met == [("r3_0", "r0_0", True), ("i1_0", "r1_0", False)]
    assert [Control(each) for each in tables.stop_lines.control] == [Control.GIVE_WAY, Control.NONE, Control.NONE]
    ring = tables.streams.samples[tables.streams.stream == 0, SAMPLE.index("along_m")]
    assert ring.min() < -30.0, "a ring with exits before the entry is watched as well"


def test_merge__only_the_lane_that_is_joined_has_a_conflict(build_net: Build) -> None:
    nodes = '<node id="a" x="0" y="0"/><node id="b" x="200" y="0" type="priority"/><node id="c" x="400" y="0"/>'
    nodes += '<node id="d" x="50" y="-60"/>'
    edges = '<edge id="ab" from="a" to="b" numLanes="2" priority="3"/><edge id="db" from="d" to="b" priority="1"/>'
    edges += '<edge id="bc" from="b" to="c" numLanes="2" priority="3"/>'
    tables = of(network.read_net(build_net(nodes, edges)), "ab bc", "db bc")
    conflicts = tables.conflicts
    assert conflicts.player.tolist() == [0, 1]
    assert [tables.stream_lanes[each] for each in conflicts.stream] == [("db_0", "bc_0"), ("ab_0", "bc_0")]
    assert conflicts.yields.tolist() == [False, True]
    # the main road's line is in its left lane: a car is in the right lane if it is more than half a lane to the right
    assert (conflicts.right_m[0], conflicts.left_m[0]) == (-np.inf, pytest.approx(-1.6))
    assert (conflicts.right_m[1], conflicts.left_m[1]) == (-np.inf, np.inf)


@pytest.mark.parametrize(
    ("kind", "route", "control"),
    [
        ("priority", "wc ce", Control.NONE),
        ("priority", "wc cn", Control.GIVE_WAY),
        ("priority", "sc cn", Control.GIVE_WAY),
        ("priority_stop", "sc cn", Control.STOP),
        ("priority_stop", "wc ce", Control.NONE),
        ("allway_stop", "wc ce", Control.ALL_WAY_STOP),
        ("right_before_left", "wc ce", Control.GIVE_WAY),
        ("traffic_light", "wc ce", Control.SIGNAL),
        ("zipper", "wc ce", Control.NONE),
        ("unregulated", "wc ce", Control.NONE),
    ],
)
def test_stop_lines__by_the_net(crossings: dict[str, Net], kind: str, route: str, control: Control) -> None:
    lines = of(crossings[kind], route).stop_lines
    assert lines.player.tolist() == [0]
    assert lines.control.tolist() == [control]
    assert lines.station_m == pytest.approx([92.8])


def test_signals__those_of_the_route_and_of_its_foes_are_columns(crossings: dict[str, Net]) -> None:
    net = crossings["traffic_light"]
    tables = of(net, "wc ce")
    assert tables.signal_links[0] == ("c", 10), "the route's own link"
    assert tables.stop_lines.link.tolist() == [0]
    assert (tables.conflicts.own_link == 0).all()
    for stream, column in zip(tables.conflicts.stream, tables.conflicts.other_link, strict=True):
        source, target = (net.getLane(lane).getEdge() for lane in tables.stream_lanes[stream])
        (link,) = source.getConnections(target)
        assert tables.signal_links[column] == ("c", link.getTLLinkIndex())


@pytest.mark.parametrize("kind", ["priority", "allway_stop", "bare", "lefthand"])
def test_zones__cars_on_their_lanes_touch_in_zones_only(crossings: dict[str, Net], kind: str) -> None:
    net = crossings[kind]
    for route in ("wc ce", "wc cn", "wc cs", "sc cn", "sc cw", "sc ce"):
        check_contacts(net, route)


def check_contacts(net: Net, route: str) -> None:
    """Move a car along the route and one along each stream, in steps of 2 m, and compare where they touch."""
    tables, feeders = of(net, route), Feeders(net)
    first, second = (net.getEdge(name) for name in route.split())
    (own_link,) = first.getConnections(second)
    own = Stream(own_link, feeders).onward
    conflicts, stop_m = tables.conflicts, float(tables.stop_lines.station_m[0])
    for link in first.getToNode().getConnections():
        if link.getFrom() is first or not carries_traffic(link):
            continue
        lanes = (link.getFromLane().getID(), link.getToLane().getID())
        rows = [r for r, s in enumerate(conflicts.stream) if tables.stream_lanes[s] == lanes]
        for place_m, other_m in contacts(own, Stream(link, feeders).onward):
            assert rows, f"{route} touches {lanes}, with which it has no conflict"
            spare_m = 2.3 + 0.5  # half a car, and how far its corners leave the lane in a turn
            assert conflicts.begin_m[rows[0]] - spare_m <= stop_m + place_m
            assert conflicts.zone_m[rows[0]] - spare_m <= other_m
            if conflicts.length_m[rows[0]] != 10.0:  # that of a stream that joins
                assert stop_m + place_m <= conflicts.end_m[rows[0]] + spare_m
                assert other_m <= conflicts.zone_m[rows[0]] + conflicts.length_m[rows[0]] + spare_m


def contacts(first: shapely.LineString, second: shapely.LineString) -> list[tuple[float, float]]:
    """The places along two lines where cars on them touch."""
    boxes = [[(place, car_at(line, place)) for place in np.arange(0.0, line.length, 2.0)] for line in (first, second)]
    return [(a, b) for a, box in boxes[0] for b, other in boxes[1] if box_distance(box, other) == 0.0]


def car_at(line: shapely.LineString, place_m: float) -> Box:
    rear, front = (line.interpolate(min(max(place_m + reach, 0.0), line.length)) for reach in (-1.4, 1.4))
    heading_rad = float(np.arctan2(front.y - rear.y, front.x - rear.x))
    return Box((front.x + rear.x) / 2.0, (front.y + rear.y) / 2.0, heading_rad, 4.6, 1.8)


@pytest.mark.parametrize("name", ["left_across", "priority_crossing", "roundabout", "red_light", "oncoming_bypass"])
def test_junction__the_ego_has_priority_over_the_person_or_a_signal_decides(name: str) -> None:
    right_of_way = open_scene(REPOSITORY / "networks" / name).world.right_of_way
    conflicts, lines = right_of_way.conflicts, right_of_way.stop_lines
    assert {EGO, NON_EGO} <= set(conflicts.player.tolist())
    signals = {"left_across", "red_light"}
    assert (Control.SIGNAL in set(lines.control.tolist())) == (name in signals)
    assert bool(right_of_way.signal_links) == (name in signals)
    if name in {"priority_crossing", "oncoming_bypass"}:
        assert not conflicts.yields[conflicts.player == EGO].any()
        assert conflicts.yields[conflicts.player == NON_EGO].any()
