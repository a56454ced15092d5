"""The place of the vehicle that follows the ego: behind it, in its lane, on its route."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from math import atan2
from xml.etree import ElementTree

import numpy as np
import shapely
from numpy.typing import NDArray
from sumolib.net.lane import Lane

from harness.errors import UsageError
from harness.game.arrays import FloatArray
from harness.game.follower import FOLLOWER
from harness.game.initial_state import InitialState
from harness.game.roles import EGO
from harness.road.demand.route_file import CAR_SIZE_M, STEADY, Departure, Motion, RouteFile, VehicleType
from harness.road.net import network
from harness.road.scene.scene_files import SceneFiles

FOLLOWER_TYPE = "harness_follower"
HARDEST_BRAKING_MPS2 = 6.0
"""Of the vehicle behind, in the fuzzy safety model of UN R157."""
_ATTRIBUTES = {"id": FOLLOWER_TYPE, "emergencyDecel": str(HARDEST_BRAKING_MPS2), **STEADY}
FOLLOWER_XML = ElementTree.tostring(ElementTree.Element("vType", _ATTRIBUTES), encoding="unicode")
"""SUMO's default driver, who keeps the speed limit and stays in its lane; without SUMO's random numbers, which the
games of an arena share."""
_CAR_LENGTH_M, _CAR_WIDTH_M = CAR_SIZE_M
_ON_LANE_M = 2.0  # an ego that is farther from the middle of every lane is followed by nobody
_AHEAD_M = 0.5


@dataclass(frozen=True, kw_only=True)
class _Stretch:
    """A lane of the ego's route."""

    name: str
    line: FloatArray  # [n, 2]
    length_m: float  # SUMO's
    before: str = ""  # the lane that leads here; empty: none does

    @cached_property
    def shape(self) -> shapely.LineString:
        return shapely.LineString(self.line)

    @cached_property
    def shape_m(self) -> float:
        return float(self.shape.length)


@dataclass(frozen=True, kw_only=True)
class RoadBehind:
    """The lanes on which the ego may be followed, by name, and the edges of its route."""

    edges: tuple[str, ...] = ()
    lanes: dict[str, _Stretch] = field(default_factory=dict)

    @cached_property
    def _shapes(self) -> NDArray[np.object_]:
        return np.array([lane.shape for lane in self.lanes.values()])

    def follower(self, start: InitialState, length_m: float) -> Departure | None:
        """The vehicle that follows an ego of this length from its start; None if nobody does.

        Nobody does where the road behind the ego is too short for both and the gap between them.
        """
        if start.follower is None or not self.lanes:
            return None
        speed_mps = float(start.speed_mps[EGO])
        centre = shapely.points(start.x_m[EGO], start.y_m[EGO])
        distances_m = shapely.distance(self._shapes, centre)
        if distances_m.min() > _ON_LANE_M:
            return None
        lane = list(self.lanes.values())[distances_m.argmin()]
        behind_m = 0.5 * length_m + start.follower.gap_m(speed_mps)
        front_m = float(shapely.line_locate_point(lane.shape, centre)) * (lane.length_m / lane.shape_m) - behind_m
        while front_m < (0.0 if lane.before else _CAR_LENGTH_M):
            if not lane.before:
                return None
            lane = self.lanes[lane.before]
            front_m += lane.length_m
        return Departure(
            name=FOLLOWER,
            vehicle_type=FOLLOWER_TYPE,
            edges=self.edges,
            depart_s=0.0,
            lane=lane.name,
            position=str(front_m),
            speed_factor=1.0,
            follower=start.follower,
            motion=_motion(lane, front_m, speed_mps),
        )


def _motion(lane: _Stretch, front_m: float, speed_mps: float) -> Motion:
    along_m = front_m * lane.shape_m / lane.length_m
    places = (along_m, along_m - _AHEAD_M) if along_m > _AHEAD_M else (along_m + _AHEAD_M, along_m)
    points = shapely.get_coordinates(shapely.line_interpolate_point(lane.shape, places)).tolist()
    (x, y), (x_behind, y_behind) = points
    front_x, front_y = points[places.index(along_m)]
    return Motion(
        x_m=front_x,
        y_m=front_y,
        heading_rad=atan2(y - y_behind, x - x_behind),
        speed_mps=speed_mps,
        length_m=_CAR_LENGTH_M,
        width_m=_CAR_WIDTH_M,
    )


NO_ROAD = RoadBehind()
"""Where nobody follows the ego."""


def road_behind(files: SceneFiles) -> RoadBehind:
    """The road on which the ego may be followed: that of its route. Where a car may not drive on all of it, none is."""
    net = files.net
    edges = [net.getEdge(name) for name in files.routes.vehicles[files.document.vehicles[EGO]].edges]
    if not all(network.car_lanes(edge) for edge in edges):
        return NO_ROAD
    lanes = {lane.getID(): _stretch(lane) for edge in edges for lane in network.car_lanes(edge)}
    for edge, following in pairwise(edges):
        for lane in (each for each in edge.getLanes() if each.getID() in lanes):
            for link in (each for each in lane.getOutgoing() if each.getTo() is following):
                before = lane.getID()
                for inner in network.inner_lanes(net, link):
                    lanes[inner.getID()] = replace(_stretch(inner), before=before)
                    before = inner.getID()
                if link.getToLane().getID() in lanes:
                    reached = lanes[link.getToLane().getID()]
                    lanes[reached.name] = reached if reached.before else replace(reached, before=before)
    return RoadBehind(edges=tuple(edge.getID() for edge in edges), lanes=lanes)


def _stretch(lane: Lane) -> _Stretch:
    return _Stretch(name=lane.getID(), line=network.lane_line(lane), length_m=lane.getLength())


def with_follower_type(routes: RouteFile) -> RouteFile:
    """The route file with the vehicle type of the follower, as traces name it. Raises UsageError if a vehicle of the
    file has the follower's name."""
    if FOLLOWER in routes.names:
        message = "is the name of the vehicle that follows the ego"
        raise UsageError.of(routes.path, FOLLOWER, message, "rename it, or give followed_share = 0 in scene.toml")
    return replace(routes, types={**routes.types, FOLLOWER_TYPE: VehicleType(name=FOLLOWER_TYPE)})
