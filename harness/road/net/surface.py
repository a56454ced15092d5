"""The surface of a road as plain geometry: parts are joined, gaps closed, and levels kept apart.

Two tolerances hold for every net. Slits and holes thinner than `SLIT_M` are closed: no car fits into them, and they are
mostly gaps between lanes and junctions that were drawn apart. A net does not say whether such a strip is paved, and
opposite carriageways that touch have no wall between them either. Lanes that differ by more than `CLEARANCE_M` in
height lie on different levels: no road passes under a bridge that is lower.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from harness.game.arrays import FloatArray

SEAM_M = 0.05  # gaps up to twice this between parts are closed with every join
SLIT_M = 1.0
CLEARANCE_M = 2.5
CAR_LENGTH_M, CAR_WIDTH_M = 4.6, 1.8
_APART_M = 1.2  # between the surface of a level and what remains of another one: wider than a slit
_SLIVER_M = 0.02  # thinner gaps are rounding errors
_SPARE_M = 0.05  # around a car that follows a lane
_STEP_M = 0.5  # between two places of it
_TURN_RAD, _FINE = 0.02, 8  # where it turns by more from place to place, places are so many times finer
_SMOOTH_M = 0.01


@dataclass(frozen=True, kw_only=True)
class Part:
    """A part of the surface, with a line [n, 3] that gives its height."""

    shape: BaseGeometry
    line: FloatArray
    own: bool  # it belongs to the level that is kept where levels overlap


def lane_shape(line: FloatArray | shapely.LineString, width_m: float) -> BaseGeometry:
    """The area of a lane by its centre line, points [n, 2] or a shape."""
    return shapely.LineString(line).buffer(width_m / 2.0, cap_style="flat", join_style="mitre")


def joined(shapes: Sequence[BaseGeometry]) -> BaseGeometry:
    """The union of shapes, with the seams between them closed."""
    grown = shapely.union_all([shape.buffer(SEAM_M, join_style="mitre") for shape in shapes])
    return grown.buffer(-SEAM_M, join_style="mitre").simplify(_SMOOTH_M)


def without_slits(area: BaseGeometry) -> BaseGeometry:
    """The area with slits and holes thinner than `SLIT_M` filled; the area itself if it has none."""
    closed = area.buffer(0.5 * SLIT_M, join_style="mitre").buffer(-0.5 * SLIT_M, join_style="mitre")
    gaps = closed.difference(area).buffer(-_SLIVER_M, join_style="mitre").buffer(_SLIVER_M, join_style="mitre")
    return area if gaps.is_empty else joined([area, gaps])


# --- levels ----------------------------------------------------------------------------------------------------------


def own_level(parts: Sequence[Part]) -> list[Part]:
    """The parts, without those pieces that lie over or under parts of the own level."""
    own = [part for part in parts if part.own]
    heights = np.concatenate([part.line[:, 2] for part in parts]) if parts else np.zeros(1)
    if not own or np.ptp(heights) <= CLEARANCE_M:
        return list(parts)
    tree = shapely.STRtree([part.shape for part in own])
    return [part if part.own else _cut(part, [own[k] for k in tree.query(part.shape)]) for part in parts]


def _cut(part: Part, own: Sequence[Part]) -> Part:
    shape = part.shape
    for other in own:
        common = shapely.intersection(part.shape, other.shape.buffer(_APART_M, join_style="mitre"))
        for piece in shapely.get_parts(common):
            place = shapely.point_on_surface(piece)
            if piece.area > 0.0 and abs(_height_m(part, place) - _height_m(other, place)) > CLEARANCE_M:
                shape = shape.difference(piece.buffer(_SLIVER_M))
    return part if shape is part.shape else replace(part, shape=shape)


def _height_m(part: Part, place: shapely.Point) -> float:
    """The height of a part at the point of its line that is nearest to a place."""
    station_m = shapely.line_locate_point(shapely.LineString(part.line[:, :2]), place)
    return float(np.interp(station_m, stations_of(part.line), part.line[:, 2]))


# --- cars that follow lanes ------------------------------------------------------------------------------------------


def with_swept_paths(area: BaseGeometry, paths: Sequence[FloatArray]) -> BaseGeometry:
    """The area with what a car sweeps that follows lines [n, 2]; the area itself if no such car touches its outline."""
    cars = [_cars(path) for path in paths]
    if not any(map(len, cars)):
        return area
    outline = [shapely.get_coordinates(line) for line in shapely.get_parts(shapely.get_rings(shapely.get_parts(area)))]
    segments = np.concatenate([np.stack((ring[:-1], ring[1:]), axis=1) for ring in outline])
    touching, _ = shapely.STRtree(shapely.linestrings(segments)).query(np.concatenate(cars), predicate="intersects")
    if not len(touching):
        return area
    owner = np.repeat(np.arange(len(paths)), [len(each) for each in cars])
    row = np.concatenate([np.arange(len(each)) for each in cars])
    swept = []
    for k in np.unique(touching):
        path, place = cars[owner[k]], row[k]
        near = path[max(place - 1, 0) : place + 2]
        swept += [shapely.convex_hull(shapely.multipolygons(pair)) for pair in pairwise(near)]
    return without_slits(joined([area, shapely.union_all(swept)])) if swept else area


def _cars(points: FloatArray) -> NDArray[np.object_]:
    """Outlines of cars whose centres lie on a line [n, 2], and that end before its ends."""
    line = shapely.LineString(points)
    margin_m = 0.5 * CAR_LENGTH_M + 1.4 * _SPARE_M  # the ends of some lanes are walls
    if line.length <= 2.0 * margin_m:
        return np.empty(0, dtype=object)
    stations = np.append(np.arange(margin_m, line.length - margin_m, _STEP_M), line.length - margin_m)
    along = _directions(line, stations)
    turns = (along[1:] * along[:-1]).sum(1) < np.cos(_TURN_RAD)
    finer = np.linspace(stations[:-1][turns], stations[1:][turns], _FINE, endpoint=False)
    stations = np.unique(np.concatenate((stations, finer.ravel())))
    along = _directions(line, stations)
    across = np.stack((-along[:, 1], along[:, 0]), axis=1)
    centre = shapely.get_coordinates(shapely.line_interpolate_point(line, stations))
    half_length_m, half_width_m = 0.5 * CAR_LENGTH_M + _SPARE_M, 0.5 * CAR_WIDTH_M + _SPARE_M
    corners = [
        centre + a * half_length_m * along + b * half_width_m * across for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))
    ]
    return np.asarray(shapely.polygons(np.stack(corners, axis=1)), dtype=object).reshape(-1)


def _directions(line: shapely.LineString, stations: FloatArray) -> FloatArray:
    """[N, 2] unit vectors along a line, over `_STEP_M` before and after each station."""
    ahead, behind = (
        shapely.get_coordinates(shapely.line_interpolate_point(line, np.clip(stations + d, 0.0, line.length)))
        for d in (_STEP_M, -_STEP_M)
    )
    return np.asarray((ahead - behind) / np.maximum(np.hypot(*(ahead - behind).T), 1e-9)[:, None])


def curve_between(before: FloatArray, after: FloatArray) -> FloatArray:
    """[9, 2] cubic Bezier curve that continues one segment [2, 2] and joins another one."""
    start, end = before[1], after[0]
    reach = 0.4 * float(np.linalg.norm(end - start))
    out = start + reach * unit(before[1] - before[0])
    into = end - reach * unit(after[1] - after[0])
    t = np.linspace(0.0, 1.0, 9)[:, None]
    return (1 - t) ** 3 * start + 3 * (1 - t) ** 2 * t * out + 3 * (1 - t) * t**2 * into + t**3 * end


# --- lines and vectors -----------------------------------------------------------------------------------------------


def unit(vector: FloatArray) -> FloatArray:
    """A vector of length 1 with this direction; 0 if it has none."""
    return vector / max(float(np.linalg.norm(vector)), 1e-9)


def cross_section(point: FloatArray, along: FloatArray, width_m: float) -> FloatArray:
    """[2, 2] the line of a width across a direction, with its middle at a point, from right to left."""
    direction = unit(along)
    across = 0.5 * width_m * np.array([-direction[1], direction[0]])
    return np.stack((point - across, point + across))


def length_of(line: FloatArray) -> float:
    """The length of a line [n, 2]."""
    return float(np.hypot(*np.diff(line, axis=0).T).sum())


def stations_of(line: FloatArray) -> FloatArray:
    """[n] how far along a line each of its points [n, 2 or 3] is, by x and y."""
    return np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(line[:, :2], axis=0).T))))
