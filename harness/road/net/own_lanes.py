"""The lanes of an edge that a kind of road user travels on, and the marks between own and oncoming lanes."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import shapely
from sumolib.net import Net
from sumolib.net.edge import Edge
from sumolib.net.lane import Lane

from harness.config.road_user import CYCLING, Kind
from harness.game.arrays import BoolArray, FloatArray
from harness.road.net.network import car_lanes, lane_line

LanesOf: TypeAlias = Callable[[Edge], list[Lane]]


def lanes_for(kind: Kind) -> LanesOf:
    """The lanes of an edge for a kind, in SUMO's order."""
    return bicycle_lanes if kind in CYCLING else car_lanes


def bicycle_lanes(edge: Edge) -> list[Lane]:
    """The edge's lanes for bicycles alone; without any, the rightmost lane that admits them: it may be a pavement."""
    admit = [lane for lane in edge.getLanes() if lane.allows("bicycle")]
    alone = [lane for lane in admit if not lane.allows("passenger") and not lane.allows("pedestrian")]
    return alone or admit[:1]


_BESIDE_M = 1.0  # a lane that is this far beyond the own lanes is next to them
_OPPOSITE = -0.7  # cosine of the angle between two directions


def own_side(
    net: Net,
    points: FloatArray,
    headings_rad: FloatArray,
    *,
    offsets_m: FloatArray,
    width_m: FloatArray,
    on_edge: BoolArray,
) -> tuple[FloatArray, FloatArray]:
    """[N] lateral offsets, left and right, of the marks between own and oncoming lanes; inf and -inf without.

    points [N, 2] and headings [N] are those of a route's line, offsets_m [N, L] those of its lanes of width_m [N].
    Inside a junction, where `on_edge` [N] is false, there is no such mark.
    """
    segments, directions, half_widths = _car_lane_segments(net)
    tree = shapely.STRtree(shapely.buffer(segments, half_widths, cap_style="flat"))
    sides = []
    for sign, outermost in ((1.0, np.fmax.reduce(offsets_m, axis=1)), (-1.0, np.fmin.reduce(offsets_m, axis=1))):
        mark = outermost + sign * 0.5 * width_m
        beside = mark + sign * _BESIDE_M
        across = np.stack((-np.sin(headings_rad), np.cos(headings_rad)), axis=1)
        places = shapely.points(points + np.nan_to_num(beside)[:, None] * across)
        row, segment = tree.query(places, predicate="intersects")
        along = np.stack((np.cos(headings_rad), np.sin(headings_rad)), axis=1)
        opposite = (along[row] * directions[segment]).sum(1) < _OPPOSITE
        oncoming = np.zeros(len(points), dtype=bool)
        oncoming[row[opposite]] = True
        sides.append(np.where(oncoming & on_edge & np.isfinite(mark), mark, sign * np.inf))
    return sides[0], sides[1]


def _car_lane_segments(net: Net) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The segments of the centre lines of all car lanes of edges [S], their directions [S, 2], and half widths [S]."""
    lines, directions, half_widths = [], [], []
    for edge in net.getEdges(withInternal=False):
        for lane in car_lanes(edge):
            points = lane_line(lane)
            steps = np.diff(points, axis=0)
            lengths = np.hypot(*steps.T)
            kept = lengths > 0.0
            lines.append(np.stack((points[:-1], points[1:]), axis=1)[kept])
            directions.append(steps[kept] / lengths[kept, None])
            half_widths.append(np.full(int(kept.sum()), 0.5 * lane.getWidth()))
    return shapely.linestrings(np.concatenate(lines)), np.concatenate(directions), np.concatenate(half_widths)
