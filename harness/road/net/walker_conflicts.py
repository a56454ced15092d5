"""Conflicts between players on foot and traffic: a walker's way crosses lanes, and vehicles' routes cross its way.

A lane that a way crosses is a stream for the walker, with the lanes that lead to it; inside a junction, each link that
a marked crossing crosses. The way is a stream for every player whose route crosses it. On a marked crossing the vehicle
must yield, elsewhere the walker.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry
from sumolib.net import Net

from harness.config.road_user import WALKER_WIDTH_M
from harness.config.scene import Scene
from harness.game.arrays import FloatArray
from harness.game.junctions import KERB_M, Conflicts, Control, RightOfWay, StopLines, Streams
from harness.game.road import Route
from harness.road.net.network import lane_line
from harness.road.net.right_of_way_table import extent_of
from harness.road.net.route_table import route_points
from harness.road.net.stream import CORRIDOR_M, USERS, Feeders, Piece, Stream, carries_traffic, samples_on
from harness.road.net.surface import cross_section, lane_shape

WALKERS_STREAM_M = 3.0
"""Width of a way: a walker that is farther beside it is not in its stream."""
_WALKER_M = WALKER_WIDTH_M + 0.5  # what a walker needs
_NEAR_M = 10.0  # lines that are farther apart have no corridors that overlap
_BEFORE_CROSSING_M = 1.0  # a vehicle waits this far before a way
_STRIPE_M, _LONG_M = 0.5, 4.0  # of a stripe: along the way, and across it
_LEAST_M = 1.0  # of the carriageway on a way
_FOLLOWED_SHARE = 0.5  # of the length of a crossing


@dataclass(frozen=True, kw_only=True)
class WalkersWay:
    """The way of a player on foot."""

    player: int
    line: shapely.LineString
    marked: bool
    """Whether it follows a crossing of the net."""


class _Zone(NamedTuple):
    """Where two lines cross: begin and end of the common zone on each, in metres along it."""

    own_m: float
    own_end_m: float
    other_m: float
    other_end_m: float


def ways_of(document: Scene, net: Net) -> list[WalkersWay]:
    """The ways of a scene's players on foot."""
    return [
        WalkersWay(player=k, line=line, marked=follows_crossing(net, line))
        for k, player in enumerate(document.players)
        if player.way is not None and (line := shapely.LineString(player.way))
    ]


def with_walkers_conflicts(
    right_of_way: RightOfWay, net: Net, routes: Sequence[Route], ways: Sequence[WalkersWay]
) -> RightOfWay:
    """The table with the conflicts of players on foot added; `routes` [P] are those of all players."""
    conflicts, streams = right_of_way.conflicts, right_of_way.streams
    rows = [dict(zip(Conflicts._fields, row, strict=True)) for row in zip(*conflicts, strict=True)]
    lines = list(zip(*right_of_way.stop_lines, strict=True))
    samples, lanes = [streams.samples], list(right_of_way.stream_lanes)
    numbers = [streams.stream]
    feeders = Feeders(net)
    walkers = {way.player for way in ways}

    def add(found: FloatArray, name: tuple[str, str]) -> int:
        samples.append(found)
        numbers.append(np.full(len(found), len(lanes), dtype=np.int64))
        lanes.append(name)
        return len(lanes) - 1

    for way in ways:
        for name, found, width_m, zone in _traffic_crossed(feeders, way):
            kerb_m = KERB_M + max(0.5 * (width_m - CORRIDOR_M), 0.0)
            rows.append(_row(way.player, add(found, name), zone, yields=not way.marked, before_m=kerb_m))
        stream = add(samples_on(Piece(0.0, shapely.get_coordinates(way.line), WALKERS_STREAM_M)), ("", ""))
        for player, route in enumerate(routes):
            if player in walkers:
                continue
            for zone in _zones(shapely.LineString(route_points(route)), CORRIDOR_M, way.line, _WALKER_M):
                rows.append(_row(player, stream, zone, yields=way.marked, before_m=_BEFORE_CROSSING_M))
                if way.marked:
                    lines.append((player, zone.own_m - _BEFORE_CROSSING_M, Control.GIVE_WAY, -1))
    table = Conflicts.of(rows)
    return RightOfWay(
        conflicts=table,
        streams=Streams.of(np.concatenate(samples), np.concatenate(numbers), table, players=len(routes)),
        stop_lines=StopLines.of(lines),
        signal_links=right_of_way.signal_links,
        stream_lanes=tuple(lanes),
    )


def _traffic_crossed(feeders: Feeders, way: WalkersWay) -> Iterator[tuple[tuple[str, str], FloatArray, float, _Zone]]:
    """The streams of traffic that a way crosses, in the order of the net: the lanes at both ends of the stop line,
    samples [N, 7], width (m), and where.

    A stream is a lane of traffic or, for a marked way, a link inside a junction.
    """
    net = feeders.net
    for lane in (lane for edge in net.getEdges(withInternal=False) for lane in edge.getLanes()):
        if not any(lane.allows(user) for user in USERS):
            continue
        line = shapely.LineString(lane_line(lane))
        for zone in _zones(way.line, _WALKER_M, line, min(CORRIDOR_M, lane.getWidth())):
            samples = [samples_on(piece) for piece in feeders.approaches(lane, line.length - zone.other_m)]
            from_line = zone._replace(other_m=0.0, other_end_m=zone.other_end_m - zone.other_m)
            yield (lane.getID(), lane.getID()), np.concatenate(samples), lane.getWidth(), from_line
    for link in (link for node in net.getNodes() if way.marked for link in node.getConnections()):
        if carries_traffic(link):
            stream = Stream(link, feeders)
            name = (link.getFromLane().getID(), link.getToLane().getID())
            for zone in _zones(way.line, _WALKER_M, stream.inner, min(CORRIDOR_M, stream.width_m)):
                yield name, stream.samples, stream.width_m, zone


def _zones(
    own: shapely.LineString, own_width_m: float, other: shapely.LineString, other_width_m: float
) -> Iterator[_Zone]:
    """Where the corridors of two lines overlap."""
    if not shapely.dwithin(own, other, _NEAR_M):  # for large nets: quicker than the areas of corridors
        return
    overlap = lane_shape(own, own_width_m).intersection(lane_shape(other, other_width_m))
    for part in shapely.get_parts(overlap):
        if part.area > 0.0 and part.intersects(own) and part.intersects(other):
            yield _Zone(*extent_of(own, part), *extent_of(other, part))


def _row(player: int, stream: int, zone: _Zone, *, yields: bool, before_m: float) -> dict[str, Any]:
    return {
        "player": player,
        "stream": stream,
        "begin_m": zone.own_m,
        "end_m": zone.own_end_m,
        "yields": yields,
        "stop_m": zone.own_m - before_m,
        "wait_m": zone.own_m - before_m,
        "zone_m": zone.other_m,
        "length_m": zone.other_end_m - zone.other_m,
    }


# --- marked crossings ------------------------------------------------------------------------------------------------


def follows_crossing(net: Net, way: shapely.LineString) -> bool:
    """Whether a way crosses a road on a crossing of the net: it keeps to the crossing for most of its length."""
    for edge in net.getEdges(withInternal=True):
        if edge.getFunction() == "crossing":
            line = shapely.LineString(lane_line(edge.getLane(0)))
            area = line.buffer(0.5 * edge.getLane(0).getWidth(), cap_style="flat")
            if way.intersection(area).length > _FOLLOWED_SHARE * line.length:
                return True
    return False


def stripes(ways: Sequence[FloatArray], carriageway: BaseGeometry) -> Iterator[FloatArray]:
    """The corners [5, 2] of each stripe where ways [n, 2] pass the carriageway: half of its width is painted."""
    for way in ways:
        for part in shapely.get_parts(shapely.intersection(shapely.LineString(way), carriageway)):
            if part.length >= _LEAST_M:
                yield from _painted(shapely.get_coordinates(part))


def _painted(ends: FloatArray) -> Iterator[FloatArray]:
    line = shapely.LineString(ends)
    for station_m in np.arange(_STRIPE_M, line.length, 2.0 * _STRIPE_M):
        places_m = station_m + 0.5 * _STRIPE_M * np.array([-1.0, 1.0])
        near, far = shapely.get_coordinates(shapely.line_interpolate_point(line, places_m))
        (right, left), (far_right, far_left) = (cross_section(end, far - near, _LONG_M) for end in (near, far))
        yield np.array([right, far_right, far_left, left, right])
