"""The lanes of a net as a planner gets them, and those that a route's line follows."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from sumolib.net import Net
from sumolib.net.edge import Edge
from sumolib.net.lane import Lane

from harness.game.cartesian_view import MapLane, MapSignal
from harness.road.net.lane_route import LaneRoute
from harness.road.net.network import edges_near, inner_lanes, lane_line

_CLASSES = ("passenger", "bicycle", "pedestrian")
_INSIDE = ("internal", "connector")  # functions of the edges with a junction's lanes
_OF_WALKERS = ("crossing", "walkingarea")  # areas of a junction that SUMO describes as edges


def lane_map(net: Net, own: Collection[Edge]) -> dict[str, MapLane]:
    """The lanes near the edges `own` of the players' routes, by id."""
    edges = [edge for edge in edges_near(net, own) if edge.getFunction() not in _OF_WALKERS]
    lanes = {lane.getID(): lane for edge in edges for lane in edge.getLanes()}
    return {name: _map_lane(lane, lanes) for name, lane in lanes.items()}


def _map_lane(lane: Lane, known: Collection[str]) -> MapLane:
    links = lane.getOutgoing()
    following = [link.getViaLaneID() or link.getToLane().getID() for link in links]
    left, right = neighbours(lane)
    return MapLane(
        edge=lane.getEdge().getID(),
        line=lane_line(lane),
        length_m=lane.getLength(),
        width_m=lane.getWidth(),
        speed_limit_mps=lane.getSpeed(),
        vehicle_classes=tuple(each for each in _CLASSES if lane.allows(each)),
        in_junction=lane.getEdge().getFunction() in _INSIDE,
        left=left,
        right=right,
        successors=tuple(each for each in dict.fromkeys(following) if each in known),
    )


def neighbours(lane: Lane) -> tuple[str | None, str | None]:
    """The lanes to the left and to the right. Where traffic keeps to the left, SUMO counts from the left side."""
    lanes, k = lane.getEdge().getLanes(), lane.getIndex()
    outer, inner = lanes[k - 1] if k else None, lanes[k + 1] if k + 1 < len(lanes) else None
    sides = [inner, outer] if is_left(lane, inner or lane) or (outer and not is_left(lane, outer)) else [outer, inner]
    left, right = (None if each is None else each.getID() for each in sides)
    return left, right


def is_left(lane: Lane, other: Lane) -> bool:
    """Whether another lane of the edge begins to the left of a lane."""
    points = lane_line(lane)
    along, across = points[1] - points[0], lane_line(other)[0] - points[0]
    return bool(along[0] * across[1] - along[1] * across[0] > 0.0)


def lanes_on_route(net: Net, route: LaneRoute) -> tuple[str, ...]:
    """The lanes that the line of a route follows, with those inside junctions, in order."""
    lanes = [route.entries[0]]
    for link in route.links:
        lanes += [link.getFromLane(), *inner_lanes(net, link), link.getToLane()]
    return tuple(dict.fromkeys(lane.getID() for lane in lanes))


def signals_on_route(net: Net, links: Sequence[tuple[str, int]], stations_m: Sequence[float]) -> tuple[MapSignal, ...]:
    """The signals of these links of traffic lights (id, index), whose stop lines are at these stations of a route."""
    lanes: dict[tuple[str, int], list[str]] = {}
    for edge in net.getEdges(withInternal=False):
        for lane in edge.getLanes():
            for link in lane.getOutgoing():
                lanes.setdefault((link.getTLSID(), link.getTLLinkIndex()), []).append(lane.getID())
    pairs = zip(links, stations_m, strict=True)
    return tuple(MapSignal(station_m=at, lanes=tuple(dict.fromkeys(lanes.get(link, ())))) for link, at in pairs)
