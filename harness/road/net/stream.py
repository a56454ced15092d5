"""The stream of traffic over a link of a junction: its lines before, inside and beyond the junction."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry
from shapely.ops import substring
from sumolib.net import Net
from sumolib.net.connection import Connection
from sumolib.net.lane import Lane

from harness.game.arrays import FloatArray
from harness.road.net.network import TURNAROUNDS, inner_lanes, lane_line
from harness.road.net.route_table import joined_line, line_over_junction
from harness.road.net.surface import lane_shape

USERS = ("passenger", "bus", "truck", "motorcycle", "bicycle", "tram")
_BEYOND_M = 20.0  # a stream goes on for this length behind the junction
_BACK_M = 120.0  # and begins at most this far before it
_ANYHOW_M = 40.0  # it leads back at least this far, although traffic there may turn off before the junction
_SPACING_M = 4.0  # of samples
_SPARE_M = 0.3  # overlap of the lengths that samples stand for, on the inside of a curve
CORRIDOR_M = 2.2  # what a car needs in its lane: 1.8 m, and 0.2 m on either side


def carries_traffic(link: Connection) -> bool:
    """Whether vehicles use a link of a junction regularly: it joins lanes of roads, and is no turnaround."""
    lanes = (link.getFromLane(), link.getToLane())
    if any(lane.getEdge().isSpecial() for lane in lanes) or link.getDirection() in TURNAROUNDS:
        return False
    return any(all(lane.allows(user) for lane in lanes) for user in USERS)


class Feeders:
    """The links that lead to each lane of a net, and those that lead from it."""

    def __init__(self, net: Net) -> None:
        self.net = net

    @cached_property
    def _into(self) -> dict[str, list[Connection]]:
        into: dict[str, list[Connection]] = {}
        for edge in self.net.getEdges(withInternal=False):
            for links in edge.getOutgoing().values():
                for link in filter(carries_traffic, links):
                    into.setdefault(link.getToLane().getID(), []).append(link)
        return into

    def approaches(self, lane: Lane, along_m: float = 0.0, seen: frozenset[str] = frozenset()) -> Iterator[Piece]:
        """The lines that lead to the end of a lane, which is at `along_m` of a stream, nearest first."""
        piece = Piece.ending_at(along_m, lane_line(lane), lane.getWidth())
        yield piece
        seen |= {lane.getID()}
        for link in self._into.get(lane.getID(), []):
            before = link.getFromLane()
            alone = sum(map(carries_traffic, before.getOutgoing())) == 1
            reach_m = _BACK_M if alone else _ANYHOW_M
            if piece.begin_m <= -reach_m or before.getID() in seen:
                continue
            inner = Piece.ending_at(piece.begin_m, line_over_junction(self.net, link), lane.getWidth())
            yield inner
            yield from self.approaches(before, inner.begin_m, seen)


class Piece(NamedTuple):
    """A part of a stream."""

    begin_m: float  # along the stream
    line: FloatArray  # [n, 2]
    width_m: float

    @classmethod
    def ending_at(cls, along_m: float, line: FloatArray, width_m: float) -> Piece:
        """A part by its end."""
        return cls(along_m - _joined([line]).length, line, width_m)


class Stream:
    """The stream of a link. Positions along it count from the link's stop line."""

    def __init__(self, link: Connection, feeders: Feeders) -> None:
        self.link, self._feeders = link, feeders
        self.width_m = float(link.getFromLane().getWidth())
        self._swept: dict[bool, BaseGeometry] = {}

    @cached_property
    def inner(self) -> shapely.LineString:
        return _joined([line_over_junction(self._feeders.net, self.link)])

    @cached_property
    def inner_wait_m(self) -> float:
        """The place inside the junction where cars on the link wait, as at a left turn: SUMO divides the link's lane
        there. 0 where they wait at the stop line."""
        lanes = inner_lanes(self._feeders.net, self.link)
        return float(_joined([lane_line(lanes[0])]).length) if len(lanes) > 1 else 0.0

    @cached_property
    def onward(self) -> shapely.LineString:
        """The line from the stop line on, to a point beyond the junction."""
        beyond = shapely.LineString(lane_line(self.link.getToLane()))
        cut = substring(beyond, 0.0, _BEYOND_M)
        return _joined([shapely.get_coordinates(self.inner), shapely.get_coordinates(cut)])

    @cached_property
    def nearby(self) -> tuple[shapely.LineString, float]:
        """The line from the start of the last lane before the junction on, and the position along it of its start."""
        approach = lane_line(self.link.getFromLane())
        return _joined([approach, shapely.get_coordinates(self.onward)]), -shapely.LineString(approach).length

    def swept(self, beyond: bool) -> BaseGeometry:
        """The area that cars on the link need inside the junction and, if wanted, shortly beyond it."""
        if beyond not in self._swept:
            self._swept[beyond] = lane_shape(self.onward if beyond else self.inner, min(CORRIDOR_M, self.width_m))
        return self._swept[beyond]

    @cached_property
    def samples(self) -> FloatArray:
        """[N, 7] samples of the stream, with the first columns of `game.junctions.Streams`."""
        pieces = [Piece(0.0, shapely.get_coordinates(self.onward), self.width_m)]
        pieces += self._feeders.approaches(self.link.getFromLane())
        return np.concatenate([samples_on(piece) for piece in pieces])


def _joined(lines: Sequence[FloatArray]) -> shapely.LineString:
    """The line through all points, each once. Lanes inside a junction may be a single point: their length is 0."""
    points, _ = joined_line(lines)
    return shapely.LineString(points if len(points) > 1 else points[[0, 0]])


def samples_on(piece: Piece) -> FloatArray:
    """[N, 7] samples of the last `_BACK_M` before the stop line and of everything behind it."""
    line = _joined([piece.line])
    skipped_m = max(-_BACK_M - piece.begin_m, 0.0)
    length_m = line.length - skipped_m
    if length_m <= 0.0:
        return np.zeros((0, 7))
    count = max(round(length_m / _SPACING_M), 1)
    bounds = skipped_m + np.linspace(0.0, length_m, count + 1)
    ends = shapely.get_coordinates(shapely.line_interpolate_point(line, bounds))
    middle = (bounds[1:] + bounds[:-1]) / 2.0
    points = shapely.get_coordinates(shapely.line_interpolate_point(line, middle))
    heading = np.arctan2(*np.diff(ends, axis=0).T[::-1])
    half_m = np.full(count, 0.5 * length_m / count + _SPARE_M)
    width = np.full(count, 0.5 * piece.width_m)
    return np.stack((*points.T, np.cos(heading), np.sin(heading), width, half_m, piece.begin_m + middle), axis=1)
