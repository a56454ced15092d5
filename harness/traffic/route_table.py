"""From a SUMO route to the game's table of it: its line, and what lies beside the line at every station.

The line follows the lanes that lead to the route's end. Where a route has to change lanes on an edge, its line moves
over gradually; where a net has no lanes inside a junction, a curve takes their place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry
from sumolib.net import Net
from sumolib.net.connection import Connection
from sumolib.net.edge import Edge
from sumolib.net.lane import Lane

from harness.game.arrays import FloatArray
from harness.game.road import MARGIN_M, SPACING_M, Route
from harness.traffic.network import car_lanes, lane_line

_FAR_SIDE_M = 50.0
_ON_POINT_M = 0.1


@dataclass(frozen=True)
class _Piece:
    """A stretch of a route's line: over one of its edges, or over the junction behind it."""

    line: FloatArray  # [n, 2]
    lanes: list[tuple[FloatArray, Lane]]  # lines [m, 2] side by side, and the lane of the route each leads along
    edge: int  # of the route, that these lanes belong to
    speed_mps: float


def route_table(net: Net, area: BaseGeometry, edges: Sequence[Edge], goal: Edge, goal_position_m: float) -> Route:
    """The table of a route along connected edges, over the net's drivable area.

    Raises ValueError where consecutive edges are not connected, or the goal's edge is not on the route.
    """
    if goal not in edges:
        raise ValueError(f"does not pass the goal's edge {goal.getID()!r}")
    pieces = _pieces(net, edges)
    points, starts = _join([piece.line for piece in pieces])
    line = shapely.LineString(points)
    stations = np.arange(-MARGIN_M, line.length + MARGIN_M + SPACING_M, SPACING_M)
    points, headings = _sample(line, stations)
    piece_at = np.clip(np.searchsorted(starts, stations, side="right") - 1, 0, len(pieces) - 1)

    ends = _lane_ends(edges, [starts[2 * k] + _length(pieces[2 * k].line) for k in range(len(edges))])
    most = max(len(piece.lanes) for piece in pieces)
    offsets = np.full((len(stations), most), np.nan)
    lane_ends = np.full((len(stations), most), np.inf)
    for k, piece in enumerate(pieces):
        rows = np.flatnonzero(piece_at == k)
        for column, (beside, lane) in enumerate(piece.lanes):
            offsets[rows, column] = _offsets(points[rows], headings[rows], beside)
            lane_ends[rows, column] = ends[piece.edge][lane.getID()]
    left, right = _edges_beside(area, points, headings)
    inside = (stations >= 0.0) & (stations <= line.length)
    row = 2 * list(edges).index(goal)
    return Route(
        x_m=points[:, 0],
        y_m=points[:, 1],
        heading_rad=headings,
        left_edge_m=_extend(left, inside),
        right_edge_m=_extend(right, inside),
        speed_limit_mps=np.array([pieces[k].speed_mps for k in piece_at]),
        lane_offset_m=offsets,
        lane_end_m=lane_ends,
        length_m=line.length,
        goal_m=starts[row] + goal_position_m / goal.getLength() * _length(pieces[row].line),
    )


# --- the line --------------------------------------------------------------------------------------------------------


def _pieces(net: Net, edges: Sequence[Edge]) -> list[_Piece]:
    """Edge, junction, edge, ..., edge."""
    links = _links(edges)
    entries = [link.getToLane() for link in links]
    exits = [link.getFromLane() for link in links]
    entries.insert(0, exits[0] if exits else car_lanes(edges[0])[-1])
    exits.append(entries[-1])
    pieces = []
    for k, edge in enumerate(edges):
        beside = [(lane_line(lane), lane) for lane in car_lanes(edge)]
        pieces.append(_Piece(_between(entries[k], exits[k]), beside, k, entries[k].getSpeed()))
        if k < len(links):
            line, speed = _over_junction(net, links[k])
            across = [(_over_junction(net, link)[0], link.getToLane()) for link in _car_links(edge, edges[k + 1])]
            pieces.append(_Piece(line, across, k + 1, speed))
    return pieces


def _car_links(edge: Edge, following: Edge) -> list[Connection]:
    ours, theirs = car_lanes(edge), car_lanes(following)
    return [
        link for link in edge.getConnections(following) if link.getFromLane() in ours and link.getToLane() in theirs
    ]


def _links(edges: Sequence[Edge]) -> list[Connection]:
    """The connections a route takes, one between each two edges: the leftmost that lead to its end, with as little
    changing of lanes as greedily going back from the end finds."""
    chosen: list[Connection] = []
    wanted = (car_lanes(edges[-1]) or edges[-1].getLanes())[-1]
    for edge, following in zip(reversed(edges[:-1]), reversed(edges[1:]), strict=True):
        links = _car_links(edge, following)
        if not links:
            raise ValueError(f"has no connection from edge {edge.getID()!r} to {following.getID()!r}")
        best = min(
            links,
            key=lambda link: (abs(link.getToLane().getIndex() - wanted.getIndex()), -link.getFromLane().getIndex()),
        )
        chosen.insert(0, best)
        wanted = best.getFromLane()
    return chosen


def _between(entry: Lane, leave: Lane) -> FloatArray:
    """[n, 2] the line over an edge that enters it in one lane and leaves it in another, moving over smoothly."""
    if entry is leave:
        return lane_line(entry)
    steps = max(int(np.ceil(entry.getLength())), 2)
    share = np.linspace(0.0, 1.0, steps + 1)
    lines = [shapely.LineString(lane_line(lane)) for lane in (entry, leave)]
    one, two = (shapely.get_coordinates(shapely.line_interpolate_point(line, share, normalized=True)) for line in lines)
    over = (share**2 * (3.0 - 2.0 * share))[:, None]
    return one + over * (two - one)


def _over_junction(net: Net, link: Connection) -> tuple[FloatArray, float]:
    """[n, 2] the line from one lane to the next over the junction between them, and its speed limit."""
    before, after = lane_line(link.getFromLane()), lane_line(link.getToLane())
    inner: list[Lane] = []
    via = link.getViaLaneID()
    while via:
        inner.append(net.getLane(via))
        links = inner[-1].getOutgoing()
        via = next((each.getViaLaneID() for each in links if each.getViaLaneID()), "")
    if inner:
        return _join([lane_line(lane) for lane in inner])[0], inner[0].getSpeed()
    return _curve(before[-2:], after[:2]), link.getToLane().getSpeed()


def _curve(before: FloatArray, after: FloatArray) -> FloatArray:
    """[9, 2] a cubic Bezier curve that goes on from one segment [2, 2] and into another."""
    start, end = before[1], after[0]
    reach = 0.4 * float(np.linalg.norm(end - start))
    out = start + reach * _unit(before[1] - before[0])
    into = end - reach * _unit(after[1] - after[0])
    t = np.linspace(0.0, 1.0, 9)[:, None]
    return (1 - t) ** 3 * start + 3 * (1 - t) ** 2 * t * out + 3 * (1 - t) * t**2 * into + t**3 * end


def _unit(vector: FloatArray) -> FloatArray:
    return vector / max(float(np.linalg.norm(vector)), 1e-9)


def _length(line: FloatArray) -> float:
    return float(np.hypot(*np.diff(line, axis=0).T).sum())


def _join(lines: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """[n, 2] the lines one after another, without repeated points, and the stations [len(lines)] where they start."""
    points = np.concatenate(lines)
    steps = np.hypot(*np.diff(points, axis=0, prepend=points[:1]).T)
    first = np.cumsum([0, *(len(line) for line in lines[:-1])])
    keep = steps > 0.0
    keep[0] = True
    return points[keep], np.cumsum(steps)[first]


def _sample(line: shapely.LineString, stations: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Points [N, 2] and headings [N] of a line at stations, going on straight before its start and after its end."""
    within = np.clip(stations, 0.0, line.length)

    def at(station: FloatArray) -> FloatArray:
        return shapely.get_coordinates(shapely.line_interpolate_point(line, station))

    way = at(np.minimum(within + SPACING_M, line.length)) - at(np.maximum(within - SPACING_M, 0.0))
    headings = np.arctan2(way[:, 1], way[:, 0])
    beyond = stations - within
    return at(within) + beyond[:, None] * np.stack((np.cos(headings), np.sin(headings)), axis=1), headings


# --- what lies beside it ---------------------------------------------------------------------------------------------


def _lane_ends(edges: Sequence[Edge], end_of_edge_m: Sequence[float]) -> list[dict[str, float]]:
    """By edge of the route: where each of its lanes ends for who wants to follow the route; inf where it goes on."""
    ends = [{lane.getID(): np.inf for lane in car_lanes(edges[-1])}]
    for k in reversed(range(len(edges) - 1)):
        links, onward = _car_links(edges[k], edges[k + 1]), ends[0]
        here = {}
        for lane in car_lanes(edges[k]):
            reached = [onward[link.getToLane().getID()] for link in links if link.getFromLane() is lane]
            here[lane.getID()] = max(reached, default=end_of_edge_m[k])
        ends.insert(0, here)
    return ends


def _offsets(points: FloatArray, headings: FloatArray, beside: FloatArray) -> FloatArray:
    """[N] how far to the left of points [N, 2] another line [n, 2] lies."""
    line = shapely.LineString(beside)
    near = shapely.line_interpolate_point(line, shapely.line_locate_point(line, shapely.points(points)))
    dx, dy = (shapely.get_coordinates(near) - points).T
    return dy * np.cos(headings) - dx * np.sin(headings)


def _edges_beside(area: BaseGeometry, points: FloatArray, headings: FloatArray) -> tuple[FloatArray, FloatArray]:
    """[N] how far the drivable area reaches to the left (positive) and right (negative) of each point."""
    shapely.prepare(area)
    left = np.stack((-np.sin(headings), np.cos(headings)), axis=1)
    sides = []
    for sign in (1.0, -1.0):
        rays = shapely.linestrings(np.stack((points, points + sign * _FAR_SIDE_M * left), axis=1))
        parts, row = shapely.get_parts(shapely.intersection(rays, area), return_index=True)
        begins_here = shapely.distance(parts, shapely.points(points)[row]) < _ON_POINT_M
        reach = np.zeros(len(points))
        np.maximum.at(reach, row, np.where(begins_here, shapely.length(parts), 0.0))
        sides.append(sign * reach)
    return sides[0], sides[1]


def _extend(values: FloatArray, inside: FloatArray) -> FloatArray:
    """Before its start and beyond its end a route is as wide as where it begins and ends."""
    rows = np.flatnonzero(inside)
    first, last = rows[0] + 1, rows[-1] - 1
    return values[np.clip(np.arange(len(values)), first, last)]
