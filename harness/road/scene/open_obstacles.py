"""The obstacles of a scene, checked against its net and its roads, and the lanes that they block.

SUMO's drivers know lanes, not shapes. An obstacle blocks a lane where it leaves a car in its middle no room.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import product
from math import radians
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry
from sumolib.net import Net
from sumolib.net.edge import Edge
from sumolib.net.lane import Lane

from harness.config import obstacle as written
from harness.config.scene import Scene
from harness.errors import Problem, UsageError, collect
from harness.game.arrays import FloatArray
from harness.game.geometry import Box
from harness.game.placed_obstacles import AtPoint, Obstacles, OnLane, PlacedObstacle
from harness.game.road import Route
from harness.game.sight import TALL_WIDTH_M, Hiding
from harness.game.state import NOTICED_M
from harness.road.demand.departures import background_departures
from harness.road.demand.route_file import RouteFile, VehicleType
from harness.road.net import network, right_of_way_table, surface
from harness.road.scene.scene_files import SceneFiles

_BENT_M = 0.5  # a closed lane is straight: its lane may leave the middle of the box by this much
_SHARES = (0.0, 0.5, 1.0)
_CAR_M = 1.8  # width of SUMO's cars
_LEAST_M = 0.3  # length of a vehicle


def open_obstacles(files: SceneFiles, area: BaseGeometry, ways: Sequence[Route]) -> Obstacles:
    """The obstacles of a scene. Raises UsageError with every problem found.

    `area` is the net's drivable area, `ways` are the players' routes.
    """
    file, routes = files.file, files.routes
    problems: list[Problem] = []
    lines = shapely.union_all([shapely.LineString(np.stack((way.x_m, way.y_m), axis=1)) for way in ways])
    found: list[PlacedObstacle] = []
    outlines: list[FloatArray] = []
    for number, each in enumerate(files.document.obstacle, start=1):
        name = f"obstacle_{number}"
        if each.outline is not None:
            outlines.append(np.array(each.outline, dtype=float))
            collect(problems, partial(_check_building, file, name, outlines[-1], area=area, ways=lines))
        elif (obstacle := collect(problems, partial(_obstacle, file, name, each, files.net))) is not None:
            found.append(obstacle)
            collect(problems, partial(_check_is_near, file, name, reach_of(obstacle), lines))
    for name in sorted({each.name for each in found} & routes.names):
        problems.append(Problem(str(routes.path), name, "is the name of an obstacle of the scene", "rename it"))
    if problems:
        raise UsageError(problems)
    return Obstacles(each=tuple(found), outlines=tuple(outlines))


def polygon_of(box: Box) -> shapely.Polygon:
    along = 0.5 * box.length_m * np.array([np.cos(box.heading_rad), np.sin(box.heading_rad)])
    across = 0.5 * box.width_m * np.array([-np.sin(box.heading_rad), np.cos(box.heading_rad)])
    centre = np.array([box.x_m, box.y_m])
    return shapely.Polygon([centre + u * along + v * across for u, v in ((1, 1), (-1, 1), (-1, -1), (1, -1))])


def reach_of(obstacle: PlacedObstacle) -> BaseGeometry:
    """About the area in which an obstacle may stand."""
    poses = [obstacle.place.pose(shares) for shares in product(_SHARES, _SHARES, _SHARES)]
    boxes = [Box(x, y, heading, obstacle.length_m, obstacle.width_m) for x, y, heading in poses]
    return shapely.union_all([polygon_of(box) for box in boxes])


def _obstacle(file: Path, name: str, document: written.Obstacle, net: Net) -> PlacedObstacle:
    length_m, width_m = written.USUAL_SIZE_M.get(document.kind, (0.0, 0.0))
    length_m, width_m = document.length_m or length_m, document.width_m or width_m
    place: OnLane | AtPoint
    if document.lane is not None:
        lane = network.find_lane(net, file, f"{name}.lane", document.lane)
        if document.kind == "closed_lane":
            width_m = lane.getWidth()
        place = _on_lane(file, name, document, lane=lane, length_m=length_m)
    else:
        assert document.x_m is not None, "the document says that it has one of the two"
        assert document.y_m is not None, "x_m, y_m and heading_deg are given together"
        assert document.heading_deg is not None, "x_m, y_m and heading_deg are given together"
        low_deg, high_deg = document.heading_deg
        place = AtPoint(x_m=document.x_m, y_m=document.y_m, heading_rad=(radians(low_deg), radians(high_deg)))
    return PlacedObstacle(
        name=name, kind=document.kind, length_m=length_m, width_m=width_m, hides=document.is_hiding, place=place
    )


def _on_lane(file: Path, name: str, document: written.Obstacle, *, lane: Lane, length_m: float) -> OnLane:
    assert document.position_m is not None, "lane and position_m are given together"
    low_m, high_m = document.position_m
    closed = document.kind == "closed_lane"
    inside_m = 0.5 * length_m if closed else 0.0
    if low_m < inside_m or high_m > lane.getLength() - inside_m:
        message = f"reaches from {low_m - inside_m:g} to {high_m + inside_m:g} m, off lane {lane.getID()!r}"
        remedy = f"keep it between {inside_m:g} and {lane.getLength() - inside_m:g} m"
        raise UsageError.of(file, f"{name}.position_m", f"{message} of {lane.getLength():g} m", remedy)
    line = network.lane_line(lane)
    scale = surface.length_of(line) / lane.getLength()
    place = OnLane(
        line=line,
        position_m=document.position_m,
        offset_m=document.offset_m,
        turned_rad=document.turned_rad,
        scale=scale,
    )
    if closed:
        _check_straight(file, name, place, length_m)
    return place


def _check_straight(file: Path, name: str, place: OnLane, length_m: float) -> None:
    lane = shapely.LineString(place.line)
    for share in _SHARES:
        x, y, heading = place.pose((share, 0.5, 0.5))
        reach = np.array([0.5 * length_m * np.cos(heading), 0.5 * length_m * np.sin(heading)])
        axis = shapely.LineString(np.array([x, y]) + np.array([-1.0, 1.0])[:, None] * reach)
        bent_m = max(lane.distance(shapely.Point(point)) for point in axis.segmentize(1.0).coords)
        if bent_m > _BENT_M:
            message = f"its lane bends away from a straight box of {length_m:g} m by {bent_m:.1f} m"
            raise UsageError.of(file, f"{name}.length_m", message, "close it with several shorter ones")


def _check_building(file: Path, name: str, outline: FloatArray, *, area: BaseGeometry, ways: BaseGeometry) -> None:
    shape = shapely.Polygon(outline) if len(outline) > 2 else shapely.LineString(outline)
    if not shape.is_valid:
        message = "its walls cross one another"
        raise UsageError.of(file, f"{name}.outline", message, "give its corners in order, each once")
    if shape.intersects(area):
        message = "stands on the road, where contact with it would go unnoticed"
        raise UsageError.of(file, f"{name}.outline", message, "move it off the road, or make it a wall")
    _check_is_near(file, name, shape, ways)


def _check_is_near(file: Path, name: str, shape: BaseGeometry, ways: BaseGeometry) -> None:
    distance_m = shape.distance(ways)
    if distance_m > NOTICED_M:
        message = f"stands {distance_m:.0f} m from the nearest route of a player, and has no effect"
        raise UsageError.of(file, name, message, "correct its place, or leave it out")


def with_types(routes: RouteFile, obstacles: Obstacles) -> RouteFile:
    """The route file with a vehicle type for each obstacle, as traces name them."""
    sizes = {
        each.vehicle_type: VehicleType(name=each.vehicle_type, length_m=each.length_m, width_m=each.width_m)
        for each in obstacles.each
    }
    return replace(routes, types={**routes.types, **sizes}) if sizes else routes


def hiding_in(obstacles: Obstacles, routes: RouteFile, document: Scene) -> Hiding:
    """What hides road users in a scene. A vehicle type counts if a vehicle of the route file may have it."""
    players = [routes.vehicles[name] for name in document.vehicles]
    departures = [*players, *background_departures(routes, {each.name for each in players})]
    tall = any(routes.types[each.vehicle_type].width_m >= TALL_WIDTH_M for each in departures)
    return Hiding(obstacles=obstacles.hides, walls=obstacles.walls, vehicles=tall)


# --- blocked lanes ---------------------------------------------------------------------------------------------------


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
                scale = strip.length_m / line.length
                back_m, front_m = (scale * each for each in right_of_way_table.extent_of(line, shared))
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
