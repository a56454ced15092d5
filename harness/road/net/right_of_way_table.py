"""Conflicts and control at the junctions on the players' routes, from the net: foes, right of way, stop lines."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry
from sumolib.net import Net
from sumolib.net.connection import Connection
from sumolib.net.lane import Lane
from sumolib.net.node import Node

from harness.game.arrays import FloatArray
from harness.game.junctions import Conflicts, Control, RightOfWay, StopLines, Streams
from harness.road.net.lane_route import LaneRoute
from harness.road.net.network import lane_line
from harness.road.net.route_table import JunctionOnRoute, junctions_on_route
from harness.road.net.stream import Feeders, Stream, carries_traffic
from harness.road.net.surface import unit

_MERGING_M = 10.0  # length of the zone of a stream that joins the route
_LEAST_AREA_M2 = 0.5
_STEP_M = 0.5
_ALIKE = float(np.cos(np.pi / 4.0))
_STRAIGHT = float(np.cos(np.pi / 6.0))
_CONTROL = {"m": Control.GIVE_WAY, "=": Control.GIVE_WAY, "s": Control.STOP, "w": Control.ALL_WAY_STOP}
_MAJOR = "MO"  # states of links with the right of way


def right_of_way(net: Net, routes: Sequence[LaneRoute]) -> RightOfWay:
    """Conflicts and stop lines of players with routes, in the order of the players. That of a player on foot has no
    edges."""
    return _Builder(net).build([junctions_on_route(net, each) for each in routes])


def _control_of(link: Connection) -> Control:
    return Control.SIGNAL if link.getTLSID() else _CONTROL.get(link.getState(), Control.NONE)


class _Builder:
    def __init__(self, net: Net) -> None:
        self._feeders = Feeders(net)
        self._streams: dict[Connection, Stream] = {}
        self._numbers: dict[Connection, int] = {}  # of the streams with conflicts
        self._columns: dict[tuple[str, int], int] = {}  # of the table of signals

    def build(self, junctions: Sequence[Sequence[JunctionOnRoute]]) -> RightOfWay:
        numbered = [(player, junction) for player, on_route in enumerate(junctions) for junction in on_route]
        lines = [(k, each.begin_m, _control_of(each.link), self._column(each.link)) for k, each in numbered]
        conflicts = Conflicts.of([row for k, each in numbered for row in self._conflicts(k, each)])
        samples = [self._stream(link).samples for link in self._numbers]
        number = np.repeat(np.arange(len(samples), dtype=np.int64), [len(each) for each in samples])
        return RightOfWay(
            conflicts=conflicts,
            streams=Streams.of(np.concatenate([*samples, np.zeros((0, 7))]), number, conflicts, players=len(junctions)),
            stop_lines=StopLines.of(lines),
            signal_links=tuple(self._columns),
            stream_lanes=tuple((link.getFromLane().getID(), link.getToLane().getID()) for link in self._numbers),
        )

    def _stream(self, link: Connection) -> Stream:
        return self._streams.setdefault(link, Stream(link, self._feeders))

    def _column(self, link: Connection) -> int:
        """The column of a link in the table of signals; -1 if it has no signal."""
        if not link.getTLSID():
            return -1
        return self._columns.setdefault((link.getTLSID(), link.getTLLinkIndex()), len(self._columns))

    def _conflicts(self, player: int, junction: JunctionOnRoute) -> Iterator[dict[str, Any]]:
        """The rows of `Conflicts` of a junction on a player's route: where the lanes of two links overlap."""
        on_route = self._stream(junction.link).onward
        for link, right_m, left_m in _own_links(junction):
            for foe in foes_of(link):
                way, stream = self._stream(link), self._stream(foe)
                joins, overlap = link.getToLane() is foe.getToLane(), overlap_of(way, stream)
                if overlap is None:
                    continue
                begin_m, end_m = extent_of(on_route, overlap)
                zone_m, zone_end_m = extent_of(stream.onward, overlap)
                from_m, until_m = _apart(stream, way, zone_m)
                yields, first_come = yields_to(link, foe)
                yield {
                    "player": player,
                    "stream": self._numbers.setdefault(foe, len(self._numbers)),
                    "begin_m": junction.begin_m + begin_m,
                    "end_m": junction.begin_m + (begin_m + _MERGING_M if joins else end_m),
                    "yields": yields,
                    "first_come": first_come,
                    "stop_m": junction.begin_m,
                    "wait_m": junction.begin_m + (way.inner_wait_m if way.inner_wait_m < begin_m else 0.0),
                    "right_m": right_m,
                    "left_m": left_m,
                    "own_link": self._column(link),
                    "other_link": self._column(foe),
                    "from_m": from_m,
                    "until_m": until_m,
                    "zone_m": zone_m,
                    "length_m": _MERGING_M if joins else zone_end_m - zone_m,
                    "across": not joins and _turns_across(way, stream),
                }


def _turns_across(way: Stream, other: Stream) -> bool:
    """Whether a way turns, and another one comes from the opposite direction."""
    begin_rad, end_rad = (_heading_rad(way.onward, place_m) for place_m in (0.0, way.inner.length))
    turns = np.cos(end_rad - begin_rad) < _STRAIGHT
    return bool(turns and np.cos(_heading_rad(other.onward, 0.0) - begin_rad) < -_ALIKE)


def overlap_of(way: Stream, other: Stream) -> BaseGeometry | None:
    """The area that cars on both ways need; None if it is negligible. Ways to the same lane share its beginning too."""
    joins = way.link.getToLane() is other.link.getToLane()
    overlap = way.swept(joins).intersection(other.swept(joins))
    return None if overlap.area < _LEAST_AREA_M2 else overlap


def _heading_rad(line: shapely.LineString, place_m: float) -> float:
    return float(_points_and_headings(line, np.array([place_m]))[1][0])


def _own_links(junction: JunctionOnRoute) -> list[tuple[Connection, float, float]]:
    """The links of a junction on a route, each with the lateral offsets, right and left, between which a car is on its
    lane: halfway to the next lane of the route."""
    end = lane_line(junction.link.getFromLane())[-2:]
    along = unit(end[1] - end[0])
    left = np.array([-along[1], along[0]])
    lanes: dict[Lane, float] = {
        link.getFromLane(): float((lane_line(link.getFromLane())[-1] - end[1]) @ left) for link in junction.links
    }
    offsets = sorted(lanes.values())
    bounds = [-np.inf, *((a + b) / 2.0 for a, b in pairwise(offsets)), np.inf]
    places = [offsets.index(lanes[link.getFromLane()]) for link in junction.links]
    return [(link, bounds[k], bounds[k + 1]) for link, k in zip(junction.links, places, strict=True)]


def foes_of(own: Connection) -> list[Connection]:
    """The links of the junction whose traffic may be in conflict with that of a link."""
    node = own.getJunction()
    links = [link for link in _carrying(node) if link is not own]
    try:
        indices = _indices(node)
        return [link for link in links if node.areFoes(indices[own], indices[link])]
    except (KeyError, IndexError):  # the net has no rules for the junction
        return [link for link in links if link.getFromLane() is not own.getFromLane()]


def yields_to(own: Connection, foe: Connection) -> tuple[bool, bool]:
    """Whether a link must yield to a foe while no signal says otherwise, and whether the first to come has priority.

    With signals, SUMO lets major links regard vehicles that wait inside the junction: that is no duty to yield.
    """
    node = own.getJunction()
    try:
        own_yields, foe_yields = _forbids(node, foe, own), _forbids(node, own, foe)
    except (KeyError, IndexError):
        return False, False
    if not (own_yields and foe_yields):
        return own_yields, False
    own_major, foe_major = own.getState() in _MAJOR, foe.getState() in _MAJOR
    return (True, True) if own_major == foe_major else (foe_major, False)


@lru_cache(maxsize=1)
def _indices(node: Node) -> dict[Connection, int]:
    """The index of each link from a road of a junction. sumolib searches through all of them for one."""
    return {link: node.getLinkIndex(link) for link in node.getConnections() if not link.getFrom().isSpecial()}


@lru_cache(maxsize=1)
def _carrying(node: Node) -> list[Connection]:
    return [link for link in node.getConnections() if carries_traffic(link)]


def _forbids(node: Node, link: Connection, other: Connection) -> bool:
    """`Node.forbids`, without its searches: whether a link makes another one yield."""
    index, other_index = _indices(node)[link], _indices(node)[other]
    return index >= 0 <= other_index and node._prohibits[other_index][-index - 1] == "1"


def extent_of(line: shapely.LineString, overlap: BaseGeometry) -> tuple[float, float]:
    """The begin and the end of an area along a line, in metres."""
    places = shapely.line_locate_point(line, shapely.points(shapely.get_coordinates(overlap)))
    return float(places.min()), float(places.max())


def _apart(stream: Stream, way: Stream, zone_m: float) -> tuple[float, float]:
    """The part of a stream around its zone on which it is not on the player's own way: positions along the stream."""
    line, begin_m = stream.nearby
    other, _ = way.nearby
    places = np.arange(0.0, line.length, _STEP_M)
    points, headings = _points_and_headings(line, places)
    nearest = shapely.line_locate_point(other, shapely.points(points))
    on_way, headings_on_way = _points_and_headings(other, nearest)
    near = np.hypot(*(points - on_way).T) < 0.5 * stream.width_m
    shared = places[near & (np.cos(headings - headings_on_way) > _ALIKE)] + begin_m
    before, after = shared[shared < zone_m], shared[shared >= zone_m]
    return before.max(initial=-np.inf), after.min(initial=np.inf)


def _points_and_headings(line: shapely.LineString, places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Points [N, 2] and headings [N] of a line at places [N] along it."""
    low = np.clip(places - _STEP_M, 0.0, line.length)
    high = np.clip(places + _STEP_M, 0.0, line.length)
    first, last = (shapely.get_coordinates(shapely.line_interpolate_point(line, each)) for each in (low, high))
    points = shapely.get_coordinates(shapely.line_interpolate_point(line, places))
    return points, np.arctan2(*(last - first).T[::-1])
