"""The drivable area of a SUMO net, and its rails.

The drivable area is the union of the areas of all lanes that cars may use and of the junctions between them. Its
outline, without the openings where roads enter and leave the scene, is the rails.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np
import shapely
import sumolib
from shapely.geometry.base import BaseGeometry
from shapely.ops import substring
from sumolib.net import Net
from sumolib.net.connection import Connection
from sumolib.net.edge import Edge
from sumolib.net.lane import Lane
from sumolib.net.node import Node

from harness.config.toml_reading import nearest
from harness.errors import UsageError
from harness.game.arrays import FloatArray
from harness.game.quantities import REACH_M
from harness.game.rails import Rails
from harness.road.net import surface
from harness.road.net.surface import Part

KEPT_M = 300.0  # beside the players' routes
_OPENING_M = 0.3  # reach of an opening along the outline
_BEYOND_M = 10.0  # of the lanes before and after a junction that a car follows
_CAR = "passenger"
_MOTOR = (  # vehicle classes on roads; a paved shoulder is a lane for emergency vehicles
    *("passenger", "emergency", "private", "authority", "army", "vip", "hov", "taxi", "bus", "coach", "delivery"),
    *("truck", "trailer", "motorcycle", "moped", "evehicle"),
)
_RADIUS_M = 10.0  # of a player, at least, from its centre to its corners
_BACK = -0.9  # cosine of the angle between the directions of two opposite edges
TURNAROUNDS = (Connection.LINKDIR_TURN, Connection.LINKDIR_TURN_LEFTHAND)


def read_net(path: Path) -> Net:
    """Read a `.net.xml` that is well-formed XML. Raises UsageError if SUMO's reader fails, or no lane is for cars."""
    try:
        net = sumolib.net.readNet(str(path), withInternal=True)
    except Exception as error:  # sumolib does not document its errors
        raise UsageError.of(path, "", f"is not a SUMO net: {error!r}", "build it with netconvert or netedit") from error
    if not any(car_lanes(edge) for edge in net.getEdges(withInternal=False)):
        lanes = [lane for edge in net.getEdges(withInternal=False) for lane in edge.getLanes()]
        classes = sorted({each for lane in lanes for each in lane.getPermissions()})
        message = f"has no lane that cars may use: its lanes are for {', '.join(classes) or 'no vehicle'}"
        raise UsageError.of(path, "", message, f"allow vehicle class {_CAR!r} on the lanes of the road")
    return net


def car_lanes(edge: Edge) -> list[Lane]:
    """The edge's lanes that cars may use, in SUMO's order."""
    return [lane for lane in edge.getLanes() if lane.allows(_CAR)]


def paved_lanes(edge: Edge) -> list[Lane]:
    """The edge's lanes that a car can physically use: those of motor vehicles, hard shoulders, and painted bicycle
    lanes beside them. Pavements and lanes beyond a pavement are none."""
    lanes = edge.getLanes()
    paved = {k for k, lane in enumerate(lanes) if any(lane.allows(each) for each in _MOTOR)}
    for order in (range(len(lanes)), range(len(lanes) - 1, -1, -1)):
        beside = False
        for k in order:
            beside = k in paved or (beside and lanes[k].allows("bicycle") and not lanes[k].allows("pedestrian"))
            paved |= {k} if beside else set()
    return [lanes[k] for k in sorted(paved)]


def lane_line(lane: Lane) -> FloatArray:
    """[n, 2] points of the lane's centre line."""
    return np.array([point[:2] for point in lane.getShape()], dtype=float)


def drivable_area(net: Net, own: Collection[Edge] = ()) -> BaseGeometry:
    """The area that cars can drive on, with hard shoulders, in network coordinates.

    With the edges `own` of the players' routes, the area ends `KEPT_M` beside them. Where roads lie over one another,
    it is flat: it has the level of `own`, and roads of other levels are cut off beside them. Where two of `own` lie
    over one another, and without `own`, the levels are one area.
    """
    edges = edges_near(net, own)
    level, is_cut = _own_level(net, edges, own)
    area = surface.without_slits(surface.joined([part.shape for part in level if not part.shape.is_empty]))
    followed = [edge for edge in edges if edge in set(own)] if is_cut else edges
    return surface.with_swept_paths(area, list(_followed_lines(net, followed)))


def passes_other_levels(net: Net, own: Collection[Edge]) -> bool:
    """Whether other roads pass over or under the edges `own` of the players' routes."""
    return _own_level(net, edges_near(net, own), own)[1]


def _own_level(net: Net, edges: Sequence[Edge], own: Collection[Edge]) -> tuple[list[Part], bool]:
    """The parts of edges on the level of `own`, and whether parts of other levels were cut off."""
    nodes = set(nodes_of(own))
    parts = [*_lane_parts(net, edges, set(own), nodes), *_junction_parts(edges, nodes)]
    level = surface.own_level(parts)
    return level, any(part is not kept for part, kept in zip(parts, level, strict=True))


def junctions_near(net: Net, own: Collection[Edge]) -> frozenset[str] | None:
    """The junctions of the edges within `KEPT_M` of the edges `own`; None if they are all junctions of the net."""
    nodes = set(nodes_of(edges_near(net, own)))
    everything = nodes_of(net.getEdges(withInternal=False))
    return None if nodes.issuperset(everything) else frozenset(node.getID() for node in nodes)


def nodes_of(edges: Iterable[Edge]) -> list[Node]:
    """The junctions at both ends of edges, each once."""
    return list(dict.fromkeys(node for edge in edges for node in (edge.getFromNode(), edge.getToNode())))


def edges_near(net: Net, own: Collection[Edge]) -> list[Edge]:
    """The edges within `KEPT_M` of the edges `own`; without any, all edges."""
    if not own:
        return list(net.getEdges())
    lines = {edge: [shapely.LineString(lane_line(lane)) for lane in edge.getLanes()] for edge in net.getEdges()}
    around = shapely.union_all([line for edge in own for line in lines[edge]])
    shapely.prepare(around)
    return [edge for edge in net.getEdges() if shapely.dwithin(around, lines[edge], KEPT_M).any()]


def _lane_parts(net: Net, edges: Iterable[Edge], own: Collection[Edge], own_nodes: Collection[Node]) -> Iterator[Part]:
    """The parts of the edges' lanes, and of connections that have no lane inside their junction."""
    outside = _turnarounds_outside(net)
    for edge in edges:
        is_own = edge in own or (edge.isSpecial() and edge.getFromNode() in own_nodes)
        for lane in paved_lanes(edge):
            line = lane_line(lane)
            if lane.getID() not in outside and np.ptp(line, axis=0).any():
                shape = surface.lane_shape(line, lane.getWidth())
                yield Part(shape=shape, line=np.array(lane.getShape3D(), dtype=float), own=is_own)
            if not edge.isSpecial():
                yield from _curved_parts(lane, is_own)


def _curved_parts(lane: Lane, is_own: bool) -> Iterator[Part]:
    """The parts of a lane's connections that have no lane inside the junction."""
    for link in lane.getOutgoing():
        if not link.getViaLaneID() and is_for_cars(link):
            after = link.getToLane()
            curve = surface.curve_between(lane_line(lane)[-2:], lane_line(after)[:2])
            if np.ptp(curve, axis=0).any():
                shape = surface.lane_shape(curve, min(lane.getWidth(), after.getWidth()))
                heights_m = np.linspace(lane.getShape3D()[-1][2], after.getShape3D()[0][2], len(curve))
                yield Part(shape=shape, line=np.column_stack((curve, heights_m)), own=is_own)


def _junction_parts(edges: Sequence[Edge], own_nodes: Collection[Node]) -> Iterator[Part]:
    """The areas of the junctions at edges, without the pavements inside them."""
    pavements: dict[Node, list[BaseGeometry]] = {}
    for edge in edges:
        if edge.getFunction() == "walkingarea" and len(edge.getLane(0).getShape()) > 2:
            shape = shapely.Polygon(lane_line(edge.getLane(0))).buffer(0)
            pavements.setdefault(edge.getFromNode(), []).append(shape)
    for node in nodes_of(edges):
        if len(node.getShape()) > 2:
            shape = shapely.Polygon([point[:2] for point in node.getShape()]).buffer(0)
            if node in pavements:
                shape = shape.difference(shapely.union_all(pavements[node]))
            yield Part(shape=shape, line=np.array(node.getShape3D(), dtype=float), own=node in own_nodes)


def _followed_lines(net: Net, edges: Sequence[Edge]) -> Iterator[FloatArray]:
    """The lines [n, 2] that cars follow: each lane, and each connection with parts of the lanes before and after it.

    Turnarounds are left out: no car can follow their arcs, which are about as wide as a lane.
    """
    kept = {edge for edge in edges if not edge.isSpecial()}
    for lane in (lane for edge in edges if edge in kept for lane in car_lanes(edge)):
        yield lane_line(lane)
        for link in lane.getOutgoing():
            if is_for_cars(link) and link.getTo() in kept:
                before, after = _stretch(net, lane, ahead=False), _stretch(net, link.getToLane(), ahead=True)
                yield np.concatenate((before, *connection_lines(net, link), after))


def _stretch(net: Net, lane: Lane, *, ahead: bool) -> FloatArray:
    """[n, 2] line of some metres from the lane's start on, or up to its end, over several lanes if it is short."""
    lines, length_m = [lane_line(lane)], lane.getLength()
    while length_m < _BEYOND_M:
        links = [link for link in (lane.getOutgoing() if ahead else _incoming(lane)) if is_for_cars(link)]
        if not links:
            break
        lane = links[0].getToLane() if ahead else links[0].getFromLane()
        more = connection_lines(net, links[0])
        lines = [*lines, *more, lane_line(lane)] if ahead else [lane_line(lane), *more, *lines]
        length_m += max(lane.getLength(), 1.0)
    line = shapely.LineString(np.concatenate(lines))
    reach_m = min(_BEYOND_M, line.length)
    part = substring(line, 0.0, reach_m) if ahead else substring(line, line.length - reach_m, line.length)
    return shapely.get_coordinates(part)


def _incoming(lane: Lane) -> list[Connection]:
    incoming = lane.getEdge().getIncoming().items()
    return [link for edge, links in incoming if not edge.isSpecial() for link in links if link.getToLane() is lane]


def inner_lanes(net: Net, link: Connection) -> list[Lane]:
    """The lanes of a connection inside its junction, in order; a net may have none there."""
    lanes: list[Lane] = []
    via = link.getViaLaneID()
    while via:
        lanes.append(net.getLane(via))
        via = next((each.getViaLaneID() for each in lanes[-1].getOutgoing() if each.getViaLaneID()), "")
    return lanes


def connection_lines(net: Net, link: Connection) -> list[FloatArray]:
    """The lines [n, 2] of a connection inside its junction. A curve replaces the lane that a net may not have there."""
    lines = [lane_line(lane) for lane in inner_lanes(net, link)]
    return lines or [surface.curve_between(lane_line(link.getFromLane())[-2:], lane_line(link.getToLane())[:2])]


def rail_lines(net: Net, area: BaseGeometry, own: Collection[Edge] = ()) -> list[FloatArray]:
    """The rails as polylines [n, 2]: the outline of the net's drivable area, found with the same `own`, without the
    openings where roads leave the scene or the area."""
    kept = set(edges_near(net, own))
    nodes = set(nodes_of(kept))
    openings = [
        shapely.LineString(_end_of(lane, at_end)).buffer(_OPENING_M, cap_style="square")
        for edge in net.getEdges(withInternal=False)
        for at_end, node in ((False, edge.getFromNode()), (True, edge.getToNode()))
        if (_is_fringe(edge, at_end) if edge in kept else node in nodes)
        for lane in paved_lanes(edge)
    ]
    outline = area.boundary
    rails = shapely.difference(outline, shapely.union_all(openings)) if openings else outline
    merged = shapely.line_merge(rails) if rails.geom_type == "MultiLineString" else rails
    return [np.asarray(line.coords) for line in shapely.get_parts(merged) if len(line.coords) > 1]


def rails(lines: Sequence[FloatArray], radius_m: float = _RADIUS_M) -> Rails:
    """Rails of polylines [n, 2]. Look-ups find all segments that a player may notice whose corners are at most
    `radius_m` from its centre."""
    segments = [np.stack((line[:-1], line[1:]), axis=1) for line in lines]
    reach_m = REACH_M + max(radius_m, _RADIUS_M)
    return Rails.of(np.concatenate(segments) if segments else np.zeros((0, 2, 2)), reach_m)


def find_edge(net: Net, path: Path, key: str, name: str) -> Edge:
    """The edge with this name. Raises UsageError with the most similar name if there is none."""
    if not net.hasEdge(name) or net.getEdge(name).isSpecial():
        names = [edge.getID() for edge in net.getEdges(withInternal=False)]
        raise UsageError.of(path, key, f"the net has no edge {name!r}", nearest(name, names))
    return net.getEdge(name)


def find_lane(net: Net, path: Path, key: str, name: str) -> Lane:
    """The lane with this name. Raises UsageError with the most similar name if there is none."""
    names = [lane.getID() for edge in net.getEdges(withInternal=False) for lane in edge.getLanes()]
    if name not in names:
        raise UsageError.of(path, key, f"the net has no lane {name!r}", nearest(name, names))
    return net.getLane(name)


def _is_fringe(edge: Edge, at_end: bool) -> bool:
    """Whether the scene ends at this end of the edge: only the opposite edge is connected there."""
    others = edge.getToNode().getOutgoing() if at_end else edge.getFromNode().getIncoming()
    pairs = [(edge, other) if at_end else (other, edge) for other in others if not other.isSpecial()]
    return all(_is_opposite(*pair) for pair in pairs)


def _is_opposite(edge: Edge, other: Edge) -> bool:
    """Whether the other edge leads back from the edge's end, and is connected to it through turnarounds only."""
    if any(link.getDirection() not in TURNAROUNDS for link in edge.getConnections(other)):
        return False
    if other.getToNode() is edge.getFromNode():
        return True
    arriving, leaving = lane_line(edge.getLane(0)), lane_line(other.getLane(0))
    into, out = arriving[-1] - arriving[-2], leaving[1] - leaving[0]
    return float(into @ out) < _BACK * float(np.hypot(*into) * np.hypot(*out))


def _turnarounds_outside(net: Net) -> set[str]:
    """SUMO's turnaround lanes at roads that leave the scene. They extend beyond the end of the road."""
    return {
        link.getViaLaneID()
        for edge in net.getEdges(withInternal=False)
        if _is_fringe(edge, at_end=True)
        for links in edge.getOutgoing().values()
        for link in links
    }


def _end_of(lane: Lane, at_end: bool) -> FloatArray:
    line = lane_line(lane)
    end, inner = (line[-1], line[-2]) if at_end else (line[0], line[1])
    return surface.cross_section(end, end - inner, lane.getWidth())


def is_for_cars(link: Connection) -> bool:
    """Whether cars may use a connection that is no turnaround."""
    lanes = (link.getFromLane(), link.getToLane())
    return link.getDirection() not in TURNAROUNDS and all(lane.allows(_CAR) for lane in lanes)
