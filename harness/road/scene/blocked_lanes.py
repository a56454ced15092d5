"""Which lanes an obstacle blocks, as far as SUMO's drivers are concerned: they know lanes, not shapes.

An obstacle blocks a lane where it leaves a car in the middle of the lane no room.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import shapely
from shapely.geometry.base import BaseGeometry
from sumolib.net import Net
from sumolib.net.edge import Edge
from sumolib.net.lane import Lane

from harness.game.arrays import FloatArray
from harness.game.geometry import Box
from harness.game.placed_obstacles import Obstacles
from harness.road.net import network
from harness.road.scene.open_obstacles import polygon_of, reach_of

_CAR_M = 1.8  # width of SUMO's cars
_LEAST_M = 0.3  # length of a vehicle


@dataclass(frozen=True, kw_only=True)
class LaneStrip:
    """The middle of a lane, as wide as a car."""

    name: str
    edges: tuple[str, ...]
    """A route on which the lane is."""
    line: FloatArray
    """[n, 2]"""
    length_m: float
    """SUMO's length of the lane."""

    @cached_property
    def area(self) -> BaseGeometry:
        """The strip as a shape."""
        return shapely.LineString(self.line).buffer(0.5 * _CAR_M, cap_style="flat")


@dataclass(frozen=True, kw_only=True)
class Blockage:
    """A part of a lane that an obstacle blocks."""

    obstacle: int
    strip: LaneStrip
    front_m: float
    """Its end, along the lane."""
    length_m: float


def strips_near(net: Net, edges: Sequence[Edge], obstacles: Obstacles) -> tuple[LaneStrip, ...]:
    """The lanes of these edges, and of the ways between them inside junctions, that an obstacle may block."""
    if not obstacles.each:
        return ()
    reach = shapely.union_all([reach_of(each).convex_hull for each in obstacles.each])
    return tuple(strip for strip in _strips(net, edges) if strip.area.intersects(reach))


def blockages(strips: Sequence[LaneStrip], poses: FloatArray, obstacles: Obstacles) -> tuple[Blockage, ...]:
    """The parts of lanes that obstacles at poses [O, 3] block."""
    found = []
    for k, obstacle in enumerate(obstacles.each):
        x_m, y_m, heading_rad = poses[k].tolist()
        box = polygon_of(Box(x_m, y_m, heading_rad, obstacle.length_m, obstacle.width_m))
        for strip in strips:
            shared = strip.area.intersection(box)
            if shared.area > 0.0:
                line = shapely.LineString(strip.line)
                places = [line.project(shapely.Point(point)) for point in shapely.get_coordinates(shared)]
                scale = strip.length_m / line.length
                front_m, back_m = scale * max(places), scale * min(places)
                length_m = max(front_m - back_m, _LEAST_M)
                found.append(Blockage(obstacle=k, strip=strip, front_m=max(front_m, length_m), length_m=length_m))
    return tuple(found)


def _strips(net: Net, edges: Sequence[Edge]) -> Iterator[LaneStrip]:
    kept = set(edges)
    for edge in dict.fromkeys(edges):
        for lane in edge.getLanes():
            if set(lane.getPermissions()) <= {"pedestrian"}:
                continue
            yield _strip(lane, edge.getID())
            for link in lane.getOutgoing():
                if link.getTo() in kept:
                    for inner in network.inner_lanes(net, link):
                        yield _strip(inner, edge.getID(), link.getTo().getID())


def _strip(lane: Lane, *edges: str) -> LaneStrip:
    line = network.lane_line(lane)
    return LaneStrip(name=lane.getID(), edges=edges, line=line, length_m=lane.getLength())
