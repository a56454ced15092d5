"""Routes through a candidate, with enough road for a start at speed and a goal behind it, and ways on foot."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from shapely.ops import substring
from sumolib.net import Net
from sumolib.net.connection import Connection
from sumolib.net.edge import Edge
from sumolib.net.lane import Lane
from sumolib.net.node import Node

from harness.game.arrays import FloatArray
from harness.game.road import SPACING_M
from harness.maps.candidates import Candidate, LaneWay, for_cars, onward
from harness.road.net.lane_route import LaneRoute
from harness.road.net.network import lane_line
from harness.road.net.route_table import route_line
from harness.road.net.surface import stations_of

BEYOND_M = 45.0  # of the goal behind the junction
_ROOM_M = 8.0  # behind a goal, at the end of the last edge
_NEAREST_GOAL_M = 12.0
_INTO_M = 10.0  # of the edge of a goal, at least
_MOST_EDGES = 40
_FOLLOWING_S, _AHEAD_M = 15.0, 75.0  # from the farthest start of the player ahead
_BEND_COST, _YIELD_COST, _RING_COST = 2.0, 1.0, 3.0
_SLOWER = 0.9
_FREE_STATES = "MO"
_FARTHEST_M = 12.0  # between the end of a crossing and that of a pavement
_ONTO_M = 1.5  # of the pavement at the end of a way
_SHARPEST_DEG = 105.0
_NO_ROOM = "no room for a goal behind it"


@dataclass(frozen=True, kw_only=True, slots=True)
class PlannedRoute:
    """A player's route, the place of its junction, and its goal."""

    edges: tuple[str, ...]
    points: FloatArray  # [n, 2] of its line, which goes on behind the goal
    goal_m: float  # station
    junction_m: float  # station of the end of the edge before the junction
    goal_edge: str
    goal_position_m: float
    limit_mps: float  # the lowest speed limit of the edges before the junction
    lights: tuple[tuple[float, str], ...]  # station and id of each traffic light up to the goal
    turns_deg: tuple[float, ...]  # at each junction, without sign

    @property
    def line(self) -> FloatArray:
        """[n, 2] points every `SPACING_M` up to the goal."""
        return sampled_to(self.points, self.goal_m)


def planned_route(net: Net, way: LaneWay, before_m: float, rings: Collection[str]) -> PlannedRoute | str:
    """A route over a way with at least `before_m` of road before its junction, if there is as much; the reason if no
    game is offered on it. On the way back, straight roads with priority are preferred."""
    edges = [way.start.getEdge()]
    while sum(edge.getLength() for edge in edges) < before_m and len(edges) < _MOST_EDGES:
        link = _previous(way if len(edges) == 1 else None, edges, rings)
        if link is None:
            break
        edges.insert(0, link.getFrom())
    place = len(edges) - 1
    if way.end.getEdge() is not way.start.getEdge():
        edges.append(way.end.getEdge())
    beyond_m = edges[-1].getLength() if place < len(edges) - 1 else 0.0
    while beyond_m < BEYOND_M + _ROOM_M and len(edges) < _MOST_EDGES:
        following = _next(edges, rings)
        if following is None:
            break
        edges.append(following)
        beyond_m += following.getLength()
    return _with_goal(net, edges, place)


def following_m(limit_mps: float) -> float:
    """The station of the goal on a road without a junction, where one player follows the other."""
    return _FOLLOWING_S * limit_mps + _AHEAD_M


def _with_goal(net: Net, edges: Sequence[Edge], place: int) -> PlannedRoute | str:
    """The route along edges whose junction is behind the one in `place`, with its goal; the reason if there is none."""
    try:
        points, starts = route_line(net, LaneRoute(edges))
    except ValueError:
        return _NO_ROOM
    length_m = float(stations_of(points)[-1])
    ends = [*starts[1::2], length_m]  # of the edges
    has_junction = place + 1 < len(edges)
    begin_m = starts[2 * place + 2] if has_junction else 0.0
    before = edges[: place + 1]
    limit_mps = min(edge.getSpeed() for edge in before)
    wanted_m = min(begin_m + BEYOND_M if has_junction else following_m(limit_mps), length_m - _ROOM_M)
    spots = [(min(max(wanted_m, starts[2 * k] + _INTO_M), end_m), k) for k, end_m in enumerate(ends)]
    last_m = length_m - _ROOM_M
    spots = [(m, k) for m, k in spots if starts[2 * k] + _INTO_M <= m <= last_m and m >= begin_m + _NEAREST_GOAL_M]
    if not spots:
        return _NO_ROOM
    goal_m, k = min(spots, key=lambda spot: abs(spot[0] - wanted_m))
    share = (goal_m - starts[2 * k]) / max(ends[k] - starts[2 * k], 1e-9)
    turns_deg = tuple(_turn_deg(one, other) for one, other in pairwise(edges[: k + 1]))
    if max(turns_deg, default=0.0) > _SHARPEST_DEG:
        return f"turns above {_SHARPEST_DEG:.0f} degrees"
    if not shapely.LineString(sampled_to(points, goal_m)).is_simple:
        return "loops"
    return PlannedRoute(
        edges=tuple(edge.getID() for edge in edges),
        points=points,
        goal_m=goal_m,
        junction_m=ends[place],
        goal_edge=edges[k].getID(),
        goal_position_m=float(np.floor(10.0 * share * edges[k].getLength()) / 10.0),
        limit_mps=limit_mps,
        lights=tuple(
            (end_m, name)
            for end_m, edge in zip(ends, edges[:k], strict=False)
            for name in sorted({link.getTLSID() for link in onward(edge) if link.getTLSID()})
        ),
        turns_deg=turns_deg,
    )


def _turn_deg(before: Edge, behind: Edge) -> float:
    """The angle between the end of an edge and the begin of the next."""
    ends = np.array([lane_line(before.getLane(0))[-2:], lane_line(behind.getLane(0))[:2]])
    (x, y), (next_x, next_y) = ends[:, 1] - ends[:, 0]
    return abs(float(np.degrees(np.arctan2(x * next_y - y * next_x, x * next_x + y * next_y))))


def sampled_to(points: FloatArray, until_m: float) -> FloatArray:
    """[n, 2] points every `SPACING_M` up to a station of the line through `points` [m, 2]."""
    wanted, stations = np.arange(0.0, until_m + 1e-6, SPACING_M), stations_of(points)
    return np.stack([np.interp(wanted, stations, each) for each in points.T], axis=1)


def _previous(way: LaneWay | None, edges: Sequence[Edge], rings: Collection[str]) -> Connection | None:
    """The connection over which a route comes to its first edge: straight, with priority, not along a roundabout."""
    first = edges[0]
    links = for_cars(link for incoming in first.getIncoming().values() for link in incoming)
    if way is not None and any(link.getToLane() is way.start for link in links):
        links = [link for link in links if link.getToLane() is way.start]
    links = [link for link in links if link.getFrom() not in edges]
    return min(links, key=lambda link: _cost(link, link.getFrom(), rings), default=None)


def _next(edges: Sequence[Edge], rings: Collection[str]) -> Edge | None:
    links = [link for link in onward(edges[-1]) if link.getTo() not in edges]
    best = min(links, key=lambda link: _cost(link, link.getTo(), rings), default=None)
    return best.getTo() if best is not None else None


def _cost(link: Connection, edge: Edge, rings: Collection[str]) -> tuple[float, str]:
    bend = {"s": 0.0, "L": 0.5, "R": 0.5}.get(link.getDirection(), 1.0)
    must_yield = link.getState() not in _FREE_STATES or bool(link.getTLSID())
    other = link.getTo() if edge is link.getFrom() else link.getFrom()
    slow = edge.getSpeed() < _SLOWER * other.getSpeed()
    cost = _BEND_COST * bend + _YIELD_COST * must_yield + 0.5 * slow + _RING_COST * (edge.getID() in rings)
    return cost, edge.getID()


def way_over(candidate: Candidate, before_m: float) -> FloatArray | None:
    """[n, 2] a way that comes from the side nearer to the ego's approach, with up to `before_m` of pavement before the
    road; None where a side has no pavement."""
    assert candidate.footway is not None, "only zebra crossings have a footway"
    ego_end = lane_line(candidate.first.start)[-1]
    near, far = sorted(candidate.footway, key=lambda point: float(np.hypot(*(point - ego_end))))
    nodes = {candidate.first.start.getEdge().getToNode(), candidate.first.end.getEdge().getFromNode()}
    lanes = _pavements(nodes)
    come, go = _nearest(lanes, near, before_m), _nearest(lanes, far, _ONTO_M)
    if come is None or go is None:
        return None
    points = np.concatenate((come[::-1], [near], [far], go))
    apart = np.hypot(*np.diff(points, axis=0).T) > 0.05
    return points[np.concatenate(([True], apart))]


def _pavements(nodes: Collection[Node]) -> list[Lane]:
    """The lanes for people on foot alone beside the edges of junctions."""
    around = {edge for node in nodes for edge in (*node.getIncoming(), *node.getOutgoing()) if not edge.isSpecial()}
    lanes = [lane for edge in sorted(around, key=lambda edge: str(edge.getID())) for lane in edge.getLanes()]
    return [lane for lane in lanes if lane.allows("pedestrian") and not lane.allows("passenger")]


def _nearest(lanes: list[Lane], point: FloatArray, length_m: float) -> FloatArray | None:
    """[n, 2] the pavement that begins or ends nearest to a point, from there on for up to a length."""
    lines = [line for lane in lanes for line in (lane_line(lane), lane_line(lane)[::-1])]
    line = min(lines, key=lambda line: float(np.hypot(*(line[0] - point))), default=None)
    if line is None or float(np.hypot(*(line[0] - point))) > _FARTHEST_M:
        return None
    return shapely.get_coordinates(substring(shapely.LineString(line), 0.5, 0.5 + length_m))
