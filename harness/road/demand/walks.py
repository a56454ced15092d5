"""People on foot: the persons of a route file, whose walks are checked against the net, and the bodies of players.

libsumo 1.28 may die of a segmentation fault with persons in nets with crossings or walking areas. In nets without them
SUMO moves a person over a junction along the connection of its lanes; without a connection, it moves the person from
lane to lane at once, however far they are apart. Persons that are placed end SUMO in nets with crossings, too, and its
cars do not see them beside crossings: a player on foot is a small vehicle with the shape of a pedestrian.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from xml.etree import ElementTree

import numpy as np
import shapely
from sumolib.net import Net
from sumolib.net.edge import Edge
from sumolib.net.lane import Lane

from harness.config.road_user import WALKER_LENGTH_M, WALKER_RUN_MPS, WALKER_WIDTH_M
from harness.config.scene import Scene
from harness.game.arrays import FloatArray
from harness.road.demand.route_file import PLACES, Departure, RouteFile, VehicleType
from harness.road.net.network import car_lanes, lane_line
from harness.road.xml.xml_file import number_of

MOST_JUMP_M = 5.0
"""Our own: around the corner of a block a person may be moved this far at once, on its side of the roads."""
_SHARES = {"base": 0.0, "center": 0.5, "max": 1.0}
_UNSAFE = ("crossing", "walkingarea")
WALKER_TYPE = "harness_pedestrian"
WALKER_ATTRIBUTES = {
    "id": WALKER_TYPE,
    "length": f"{WALKER_LENGTH_M:g}",
    "width": f"{WALKER_WIDTH_M:g}",
    "maxSpeed": f"{WALKER_RUN_MPS:g}",
    "minGap": "0.25",
    "guiShape": "pedestrian",
}
"""The SUMO `<vType>` of a walker. Its class is a car's: the edges of its route need not allow pedestrians."""


def unsafe_net(net: Net) -> tuple[str, str] | None:
    """Message and remedy if persons may crash SUMO in this net."""
    if not any(edge.getFunction() in _UNSAFE for edge in net.getEdges(withInternal=True)):
        return None
    return (
        "persons are not possible in this net: libsumo 1.28 may die of a segmentation fault with persons in nets with "
        "crossings or walking areas (SUMO's issues 17257, 15223)",
        "rebuild the net without crossings and walking areas, or remove the persons; "
        'a player may be on foot, with kind = "pedestrian"',
    )


def with_places_in_metres(person: Departure, net: Net) -> Departure:
    """A person whose places along its first and last edge are numbers, where they are not random."""
    ends = ((person.position, person.edges[0]), (person.arrival[1], person.edges[-1]))
    first, last = (
        f"{_SHARES[place] * net.getEdge(edge).getLength():.2f}" if place in _SHARES and net.hasEdge(edge) else place
        for place, edge in ends
    )
    return replace(person, position=first, arrival=("", last, ""))


def walk_problems(person: Departure, edges: Sequence[Edge]) -> Iterator[tuple[str, str]]:
    """Message and remedy for each reason why SUMO can't move a person along edges."""
    lanes: list[Lane] = []
    for edge in edges:
        allowed = [lane for lane in edge.getLanes() if lane.allows("pedestrian")]
        if not allowed:
            message = f"walks on edge {edge.getID()!r}, none of whose lanes allows pedestrians"
            yield message, "choose other edges, or allow pedestrians on a lane"
            return
        lanes.append(allowed[0])  # on which SUMO's persons walk
    courses = [course for course in (_course(edges, True), _course(edges, False)) if course is not None]
    if not courses:
        yield "consecutive edges of its walk do not meet", "correct the walk's edges"
        return
    jumps = [jump for course in courses for jump in _jumps(lanes, course)]
    longest_m, k = max(jumps, default=(0.0, 0))
    if longest_m > MOST_JUMP_M:
        first, second = edges[k].getID(), edges[k + 1].getID()
        message = (
            f"SUMO moves it {longest_m:.1f} m at once, from edge {first!r} to {second!r}: no connection leads there"
        )
        yield message, "end the walk before, or connect the lanes for pedestrians"
    for name, place, edge in (("departPos", person.position, edges[0]), ("arrivalPos", person.arrival[1], edges[-1])):
        if place not in PLACES and abs(number_of(place)) > edge.getLength():
            yield f"its {name} {place} lies beyond the edge's end", f"give up to {edge.getLength():g} m"


def _course(edges: Sequence[Edge], forwards: bool) -> list[bool] | None:
    """Whether a walk goes along each edge in its direction; None if it can't begin with this direction."""
    course = [forwards]
    for edge, following in pairwise(edges):
        at = edge.getToNode() if course[-1] else edge.getFromNode()
        if at not in (following.getFromNode(), following.getToNode()):
            return None
        course.append(at is following.getFromNode())
    return course


def _jumps(lanes: Sequence[Lane], course: Sequence[bool]) -> Iterator[tuple[float, int]]:
    """For each two consecutive lanes without a connection: how far SUMO moves a person at once, and the index of the
    first."""
    for k, (lane, following) in enumerate(pairwise(lanes)):
        ahead, ahead_then = course[k], course[k + 1]
        first, second = (lane, following) if ahead else (following, lane)
        if ahead == ahead_then and any(link.getToLane() is second for link in first.getOutgoing()):
            continue
        leaves, enters = lane_line(lane)[-1 if ahead else 0], lane_line(following)[0 if ahead_then else -1]
        yield float(np.hypot(*(enters - leaves))), k


# --- the bodies of players -------------------------------------------------------------------------------------------


def with_walkers(routes: RouteFile, document: Scene, net: Net) -> RouteFile:
    """The route file with a vehicle for each pedestrian among the players, on the road that is nearest to its way."""
    walkers = {
        name: np.array(player.way)
        for name, player in zip(document.vehicles, document.players, strict=True)
        if player.way is not None
    }
    if not walkers:
        return routes
    types = ElementTree.fromstring(routes.types_xml)
    ElementTree.SubElement(types, "vType", WALKER_ATTRIBUTES)
    vehicles = {
        name: Departure(
            name=name,
            vehicle_type=WALKER_TYPE,
            edges=(_nearest_road(net, way).getID(),),
            depart_s=0.0,
            lane="best",
        )
        for name, way in walkers.items()
    }
    kind = VehicleType(
        name=WALKER_TYPE,
        length_m=WALKER_LENGTH_M,
        width_m=WALKER_WIDTH_M,
        max_speed_mps=WALKER_RUN_MPS,
        vehicle_class="pedestrian",  # what it is; to SUMO it is a car
    )
    return replace(
        routes,
        types={**routes.types, WALKER_TYPE: kind},
        vehicles={**routes.vehicles, **vehicles},
        types_xml=ElementTree.tostring(types, encoding="unicode"),
    )


def _nearest_road(net: Net, way: FloatArray) -> Edge:
    roads = [edge for edge in net.getEdges(withInternal=False) if car_lanes(edge)]
    line = shapely.LineString(way)
    return min(roads, key=lambda edge: shapely.distance(line, shapely.LineString(lane_line(car_lanes(edge)[0]))))
