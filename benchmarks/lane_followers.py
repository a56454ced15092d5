"""Cars that follow each lane and each connection of a net: on which of them do they touch a rail?

Such a contact is a phantom rail: SUMO's own vehicles drive there. The lines come from the net alone, not from the
harness's tables of routes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import shapely
import shapely.ops
from numpy.typing import NDArray
from sumolib.net import Net
from sumolib.net.connection import Connection
from sumolib.net.lane import Lane

from harness.game.arrays import FloatArray

LENGTH_M, WIDTH_M = 4.6, 1.8
_STEP_M = 0.5
_ROOM_M = 0.1  # between a car and the end of a lane: some lanes begin or end at a wall
_BEYOND_M = 10.0  # of the lanes before and after a junction
_TURNAROUNDS = (Connection.LINKDIR_TURN, Connection.LINKDIR_TURN_LEFTHAND)


def touches(net: Net, rails: Sequence[FloatArray], most: int | None = None) -> tuple[int, list[str]]:
    """The number of lanes and connections for cars, and the names of those on which a car touches the rails [n, 2].

    `most` limits the number; those that are tried are spread evenly over the net.
    """
    paths = list(followed_paths(net))
    paths = paths[:: max(1, len(paths) // most)] if most else paths
    segments = [np.stack((line[:-1], line[1:]), axis=1) for line in rails]
    tree = shapely.STRtree(shapely.linestrings(np.concatenate([np.zeros((0, 2, 2)), *segments])))
    cars = [_cars(line) for _, line in paths]
    touching, _ = tree.query(np.concatenate(cars), predicate="intersects")
    owner = np.repeat(np.arange(len(paths)), [len(each) for each in cars])
    return len(paths), [paths[k][0] for k in np.unique(owner[touching])]


def followed_paths(net: Net) -> Iterator[tuple[str, FloatArray]]:
    """Name and line [n, 2] of each lane for cars, and of each connection with parts of its lanes.

    Turnarounds are left out: no car can follow their arcs, which are about as wide as a lane.
    """
    for edge in net.getEdges(withInternal=False):
        for lane in edge.getLanes():
            if not lane.allows("passenger"):
                continue
            yield lane.getID(), _line(lane)
            for link in lane.getOutgoing():
                if link.getDirection() not in _TURNAROUNDS and link.getToLane().allows("passenger"):
                    yield f"{lane.getID()} -> {link.getToLane().getID()}", _through(net, link)


def _through(net: Net, link: Connection) -> FloatArray:
    lines, via = [_line(link.getFromLane())], link.getViaLaneID()
    before = shapely.LineString(lines[0])
    lines[0] = _part(before, max(before.length - _BEYOND_M, 0.0), before.length)
    while via:
        inner = net.getLane(via)
        lines.append(_line(inner))
        via = next((each.getViaLaneID() for each in inner.getOutgoing() if each.getViaLaneID()), "")
    after = shapely.LineString(_line(link.getToLane()))
    middle = [] if len(lines) > 1 else [_curve(lines[0][-2:], _line(link.getToLane())[:2])]
    return np.concatenate([*lines, *middle, _part(after, 0.0, min(_BEYOND_M, after.length))])


def _curve(before: FloatArray, after: FloatArray) -> FloatArray:
    """[9, 2] cubic curve in place of the lane that a net without internal lanes does not have."""
    start, end = before[1], after[0]
    reach = 0.4 * np.hypot(*(end - start))
    out, into = start + reach * _unit(before), end - reach * _unit(after)
    t = np.linspace(0.0, 1.0, 9)[:, None]
    return (1 - t) ** 3 * start + 3 * (1 - t) ** 2 * t * out + 3 * (1 - t) * t**2 * into + t**3 * end


def _unit(segment: FloatArray) -> FloatArray:
    step = segment[1] - segment[0]
    return step / max(float(np.hypot(*step)), 1e-9)


def _part(line: shapely.LineString, begin_m: float, end_m: float) -> FloatArray:
    return shapely.get_coordinates(shapely.ops.substring(line, begin_m, end_m))


def _line(lane: Lane) -> FloatArray:
    return np.array([point[:2] for point in lane.getShape()], dtype=float)


def _cars(points: FloatArray) -> NDArray[np.object_]:
    """Outlines of cars whose centres lie on a line [n, 2] and that reach beyond none of its ends."""
    line = shapely.LineString(points)
    margin_m = 0.5 * LENGTH_M + _ROOM_M
    stations = np.arange(margin_m, line.length - margin_m, _STEP_M)
    ahead, behind, centre = (
        shapely.get_coordinates(shapely.line_interpolate_point(line, np.clip(stations + d, 0.0, line.length)))
        for d in (_STEP_M, -_STEP_M, 0.0)
    )
    along = (ahead - behind) / np.maximum(np.hypot(*(ahead - behind).T), 1e-9)[:, None]
    across = np.stack((-along[:, 1], along[:, 0]), axis=1)
    sides = [(1, 1), (-1, 1), (-1, -1), (1, -1)]
    corners = [centre + 0.5 * LENGTH_M * a * along + 0.5 * WIDTH_M * b * across for a, b in sides]
    return np.asarray(shapely.polygons(np.stack(corners, axis=1)), dtype=object).reshape(-1)
