"""The game's table of a SUMO route, its line with the lanes and edges of the road at every station, and where two meet.

The line follows the lanes that lead to the route's end. If a route has to change lanes on an edge, its line moves over
gradually. If a net has no lanes inside a junction, a curve replaces them.
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

from harness.config.road_user import WALKING_MPS
from harness.game.arrays import BoolArray, FloatArray
from harness.game.road import MARGIN_M, SPACING_M, Route
from harness.road.net.lane_route import LaneRoute
from harness.road.net.network import connection_lines, inner_lanes, lane_line
from harness.road.net.own_lanes import own_side
from harness.road.net.surface import length_of

_FAR_SIDE_M = 50.0
_ON_POINT_M = 0.1
_MEETS_M = 1.6  # routes whose lines are closer than half a lane meet
_FEW_POINTS, _AT_ONCE = 400, 100  # of an area that is cut as a whole; stations otherwise


@dataclass(frozen=True, kw_only=True)
class _Piece:
    """A section of a route's line: over one of its edges, or over the junction after it."""

    line: FloatArray  # [n, 2]
    lanes: list[tuple[FloatArray, Lane]]  # lines [m, 2] side by side, with the lane that each belongs to
    edge: int  # index of the route's edge with these lanes
    speed_mps: float
    is_junction: bool = False


@dataclass(frozen=True, kw_only=True)
class JunctionOnRoute:
    """The junction between two edges of a route."""

    link: Connection  # that the route's line follows
    links: list[Connection]  # all that cars may take from the one edge to the other
    begin_m: float  # station of the route's line


@dataclass(frozen=True, kw_only=True)
class Meeting:
    """The first place along the ego's route where another player's route meets it, in metres along both."""

    ego_m: float
    other_m: float


def junctions_on_route(net: Net, route: LaneRoute) -> list[JunctionOnRoute]:
    """The junctions of a route, in order, with the stations of its table."""
    if len(route.edges) < 2:
        return []
    _, starts = route_line(net, route)
    return [
        JunctionOnRoute(link=link, links=route.choices[k], begin_m=starts[2 * k + 1])
        for k, link in enumerate(route.links)
    ]


def route_line(net: Net, route: LaneRoute) -> tuple[FloatArray, list[float]]:
    """[n, 2] the line of a route's table, and the stations of the starts of its edges and of the junctions between.

    Raises ValueError if consecutive edges are not connected.
    """
    points, starts = joined_line(_lines(net, route))
    return points, starts.tolist()


def line_over_junction(net: Net, link: Connection) -> FloatArray:
    """[n, 2] line of a link over its junction."""
    return joined_line(connection_lines(net, link))[0]


def route_table(net: Net, area: BaseGeometry, route: LaneRoute, *, goal: Edge, goal_position_m: float) -> Route:
    """The table of a route, which passes the goal's edge; `area` is the net's drivable area.

    Raises ValueError if consecutive edges are not connected.
    """
    pieces = _pieces(net, route)
    points, starts = joined_line([piece.line for piece in pieces])
    line = shapely.LineString(points)
    stations, inside, points, headings = _sampled(line)
    piece_at = np.clip(np.searchsorted(starts, stations, side="right") - 1, 0, len(pieces) - 1)

    ends = route.lane_ends(
        [start + length_of(piece.line) for start, piece in zip(starts[::2], pieces[::2], strict=True)]
    )
    most = max(len(piece.lanes) for piece in pieces)
    offsets = np.full((len(stations), most), np.nan)
    lane_ends = np.full((len(stations), most), np.inf)
    for k, piece in enumerate(pieces):
        rows = np.flatnonzero(piece_at == k)
        for column, (lane_points, lane) in enumerate(piece.lanes):
            offsets[rows, column] = _offsets(points[rows], headings[rows], lane_points)
            lane_ends[rows, column] = ends[piece.edge][lane.getID()]
    left, right = _road_edges(area, points, headings)
    widths = np.array([max((lane.getWidth() for _, lane in piece.lanes), default=0.0) for piece in pieces])[piece_at]
    on_edge = ~np.array([piece.is_junction for piece in pieces])[piece_at]
    own_left, own_right = own_side(net, points, headings, offsets_m=offsets, width_m=widths, on_edge=on_edge)
    row = 2 * list(route.edges).index(goal)
    return Route(
        x_m=points[:, 0],
        y_m=points[:, 1],
        heading_rad=headings,
        left_edge_m=_extended(left, inside),
        right_edge_m=_extended(right, inside),
        own_left_m=_extended(own_left, inside),
        own_right_m=_extended(own_right, inside),
        speed_limit_mps=np.array([pieces[k].speed_mps for k in piece_at]),
        lane_offset_m=offsets,
        lane_end_m=lane_ends,
        length_m=line.length,
        goal_m=starts[row] + goal_position_m / goal.getLength() * length_of(pieces[row].line),
    )


def way_table(way: FloatArray, area: BaseGeometry) -> Route:
    """The table of a way [n, 2] over a surface: a single lane along the way, whose limit is a comfortable walk. The
    goal is its end."""
    line = shapely.LineString(way)
    stations, inside, points, headings = _sampled(line)
    left, right = _road_edges(area, points, headings)
    count = len(stations)
    return Route(
        x_m=points[:, 0],
        y_m=points[:, 1],
        heading_rad=headings,
        left_edge_m=_extended(left, inside),
        right_edge_m=_extended(right, inside),
        own_left_m=np.full(count, np.inf),
        own_right_m=np.full(count, -np.inf),
        speed_limit_mps=np.full(count, WALKING_MPS),
        lane_offset_m=np.zeros((count, 1)),
        lane_end_m=np.full((count, 1), np.inf),
        length_m=line.length,
        goal_m=line.length,
    )


# --- the line --------------------------------------------------------------------------------------------------------


def _lines(net: Net, route: LaneRoute) -> list[FloatArray]:
    """The sections [n, 2] of a route's line: over an edge, over its junction, and so on."""
    lines = []
    for entry, link in zip(route.entries, route.links, strict=False):
        lines += [_between(entry, link.getFromLane()), line_over_junction(net, link)]
    return [*lines, lane_line(route.entries[-1])]


def _pieces(net: Net, route: LaneRoute) -> list[_Piece]:
    lines, links = _lines(net, route), route.links
    pieces = []
    for k, edge in enumerate(route.edges):
        lanes = [(lane_line(lane), lane) for lane in route.lanes_of(edge)]
        pieces.append(_Piece(line=lines[2 * k], lanes=lanes, edge=k, speed_mps=route.entries[k].getSpeed()))
        if k < len(links):
            lanes = [(line_over_junction(net, link), link.getToLane()) for link in route.choices[k]]
            speed_mps = [*inner_lanes(net, links[k]), links[k].getToLane()][0].getSpeed()
            over = lines[2 * k + 1]
            pieces.append(_Piece(line=over, lanes=lanes, edge=k + 1, speed_mps=speed_mps, is_junction=True))
    return pieces


def _between(entry: Lane, exit_: Lane) -> FloatArray:
    """[n, 2] line over an edge from its entry lane to its exit lane, with a smooth transition."""
    if entry is exit_:
        return lane_line(entry)
    steps = max(int(np.ceil(entry.getLength())), 2)
    share = np.linspace(0.0, 1.0, steps + 1)
    lines = [shapely.LineString(lane_line(lane)) for lane in (entry, exit_)]
    first, second = (
        shapely.get_coordinates(shapely.line_interpolate_point(line, share, normalized=True)) for line in lines
    )
    blend = (share**2 * (3.0 - 2.0 * share))[:, None]
    return first + blend * (second - first)


def joined_line(lines: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """[n, 2] the lines joined, without repeated points, and the stations [len(lines)] of their starts."""
    points = np.concatenate(lines)
    steps = np.hypot(*np.diff(points, axis=0, prepend=points[:1]).T)
    first = np.cumsum([0, *(len(line) for line in lines[:-1])])
    keep = steps > 0.0
    keep[0] = True
    return points[keep], np.cumsum(steps)[first]


def _sampled(line: shapely.LineString) -> tuple[FloatArray, BoolArray, FloatArray, FloatArray]:
    """The stations [N] of a route's table, whether they are on its line, and the points [N, 2] and headings [N] there.
    The line is extended straight at both ends."""
    stations = np.arange(-MARGIN_M, line.length + MARGIN_M + SPACING_M, SPACING_M)
    within = np.clip(stations, 0.0, line.length)

    def at(station: FloatArray) -> FloatArray:
        return shapely.get_coordinates(shapely.line_interpolate_point(line, station))

    chord = at(np.minimum(within + SPACING_M, line.length)) - at(np.maximum(within - SPACING_M, 0.0))
    headings = np.arctan2(chord[:, 1], chord[:, 0])
    beyond = stations - within
    points = at(within) + beyond[:, None] * np.stack((np.cos(headings), np.sin(headings)), axis=1)
    return stations, within == stations, points, headings


# --- lanes and road edges --------------------------------------------------------------------------------------------


def _offsets(points: FloatArray, headings: FloatArray, lane_points: FloatArray) -> FloatArray:
    """[N] lateral offsets of a line [n, 2] from points [N, 2] with headings [N], left positive."""
    line = shapely.LineString(lane_points if len(lane_points) > 1 else np.repeat(lane_points, 2, axis=0))
    nearest = shapely.line_interpolate_point(line, shapely.line_locate_point(line, shapely.points(points)))
    dx, dy = (shapely.get_coordinates(nearest) - points).T
    return dy * np.cos(headings) - dx * np.sin(headings)


def _road_edges(area: BaseGeometry, points: FloatArray, headings: FloatArray) -> tuple[FloatArray, FloatArray]:
    """[N] lateral offsets of the drivable area's left (positive) and right (negative) edges from each point."""
    if shapely.get_num_coordinates(area) <= _FEW_POINTS:
        return _edges_of(area, points, headings)
    sides = []
    for first in range(0, len(points), _AT_ONCE):  # a ray is slow to cut with a large area
        rows = slice(first, first + _AT_ONCE)
        low, high = points[rows].min(0) - _FAR_SIDE_M - 1.0, points[rows].max(0) + _FAR_SIDE_M + 1.0
        sides.append(_edges_of(shapely.intersection(area, shapely.box(*low, *high)), points[rows], headings[rows]))
    left, right = zip(*sides, strict=True)
    return np.concatenate(left), np.concatenate(right)


def _edges_of(area: BaseGeometry, points: FloatArray, headings: FloatArray) -> tuple[FloatArray, FloatArray]:
    shapely.prepare(area)
    left = np.stack((-np.sin(headings), np.cos(headings)), axis=1)
    sides = []
    for sign in (1.0, -1.0):
        rays = shapely.linestrings(np.stack((points, points + sign * _FAR_SIDE_M * left), axis=1))
        parts, row = shapely.get_parts(shapely.intersection(rays, area), return_index=True)
        starts_at_point = shapely.distance(parts, shapely.points(points)[row]) < _ON_POINT_M
        reach = np.zeros(len(points))
        np.maximum.at(reach, row, np.where(starts_at_point, shapely.length(parts), 0.0))
        sides.append(sign * reach)
    return sides[0], sides[1]


def _extended(values: FloatArray, inside: BoolArray) -> FloatArray:
    """[N] values whose entries before the start and beyond the end of the route repeat those at its start and end."""
    rows = np.flatnonzero(inside)
    first, last = rows[0] + 1, rows[-1] - 1
    return values[np.clip(np.arange(len(values)), first, last)]


# --- where two routes meet -------------------------------------------------------------------------------------------


def meeting(ego: Route, other: Route) -> Meeting | None:
    """The first place where the routes, up to their goals, meet; None if they do not."""
    ego_points, other_points = (route_points(route)[: round(route.goal_m / SPACING_M) + 1] for route in (ego, other))
    return meeting_of_lines(ego_points, other_points)


def meeting_of_lines(ego_points: FloatArray, other_points: FloatArray) -> Meeting | None:
    """The first place where two lines, of points [n, 2] every `SPACING_M`, meet; None if they do not."""
    from scipy.spatial import KDTree  # loads SciPy's sparse matrices: only for commands that open a scene

    distances, rows = KDTree(other_points).query(ego_points, distance_upper_bound=_MEETS_M)
    near = np.flatnonzero(distances < _MEETS_M)
    if not len(near):
        return None
    first = near[0]
    last = first + int(np.argmin(np.append(distances[first:] < _MEETS_M, False)))
    closest = first + int(np.flatnonzero(distances[first:last] <= distances[first:last].min() + 0.1)[0])
    return Meeting(ego_m=float(closest * SPACING_M), other_m=float(rows[closest] * SPACING_M))


def route_points(route: Route) -> FloatArray:
    """[n, 2] the line of a route, every `SPACING_M` from its station 0."""
    return without_extensions(route.x_m, route.y_m)


def without_extensions(x_m: FloatArray, y_m: FloatArray) -> FloatArray:
    """[n, 2] the points of a route's table without the straight extensions before and after its line."""
    first = round(MARGIN_M / SPACING_M)
    return np.stack((x_m[first:-first], y_m[first:-first]), axis=1)
