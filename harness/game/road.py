"""The road of a game: its rails, and each player's route as a table of stations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from harness.game.arrays import FloatArray, IntArray
from harness.game.geometry import Box, distance_to_nearest_segment
from harness.game.jit import compiled

SPACING_M = 0.5  # between stations of a route
MARGIN_M = 100.0  # straight extension of a route's table before its start and beyond its end
_CELL_M = 20.0
_FAR_AWAY_M = 1e6
_LEAST_STRETCH = 0.25  # bound for points near or beyond a curve's centre, where the nearest station is not unique


@dataclass(frozen=True, kw_only=True)
class Route:
    """A route through the scene, sampled every `SPACING_M` metres from -MARGIN_M to length + MARGIN_M.

    Arrays are [N], per lane [N, L]. Lateral offsets are from the route's line, left positive. Lanes that do not exist
    at a station are NaN.
    """

    x_m: FloatArray
    y_m: FloatArray
    heading_rad: FloatArray
    left_edge_m: FloatArray
    right_edge_m: FloatArray
    speed_limit_mps: FloatArray
    lane_offset_m: FloatArray  # [N, L] of the lane's centre
    lane_end_m: FloatArray  # [N, L] station where the lane stops leading along this route; inf if it never does
    length_m: float
    goal_m: float


class Along(NamedTuple):
    """The route's properties at the players, [G, P]."""

    speed_limit_mps: FloatArray
    lane_offset_m: FloatArray  # distance to the centre of the nearest lane
    lane_end_m: FloatArray  # station where that lane ends; inf if it does not


class Routes(NamedTuple):
    """The routes of all players in one table, with the columns of `Route`.

    The rows of player p are `first_row[p]` to `last_row[p]`.
    """

    x_m: FloatArray
    y_m: FloatArray
    heading_rad: FloatArray
    cos: FloatArray
    sin: FloatArray
    curvature_per_m: FloatArray
    left_edge_m: FloatArray
    right_edge_m: FloatArray
    speed_limit_mps: FloatArray
    lane_offset_m: FloatArray
    lane_end_m: FloatArray
    first_row: IntArray  # [P]
    last_row: IntArray  # [P]
    goal_m: FloatArray  # [P]

    @classmethod
    def of(cls, routes: Sequence[Route]) -> Routes:
        """The table of the players' routes, in the order of the players."""
        lanes = max(route.lane_offset_m.shape[1] for route in routes)

        def column(name: str) -> FloatArray:
            parts = [getattr(route, name) for route in routes]
            if parts[0].ndim == 2:
                padding = [((0, 0), (0, lanes - part.shape[1])) for part in parts]
                parts = [np.pad(part, pad, constant_values=np.nan) for part, pad in zip(parts, padding, strict=True)]
            return np.concatenate(parts)

        columns = {each.name: column(each.name) for each in fields(Route) if each.name not in ("length_m", "goal_m")}
        rows = np.array([len(route.x_m) for route in routes])
        first = np.cumsum(rows) - rows
        return cls(
            **columns,
            cos=np.cos(columns["heading_rad"]),
            sin=np.sin(columns["heading_rad"]),
            curvature_per_m=np.concatenate([_curvature_per_m(route.heading_rad) for route in routes]),
            first_row=first,
            last_row=first + rows - 1,
            goal_m=np.array([route.goal_m for route in routes]),
        )

    def rows(self, station_m: FloatArray) -> IntArray:
        """[G, P] rows of the table nearest to stations [G, P]."""
        return _rows(station_m, self.first_row, self.last_row)

    def locate(self, x_m: FloatArray, y_m: FloatArray, station_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Stations and lateral offsets (m, left positive) [G, P] of points [G, P], given their previous stations."""
        lines = (self.x_m, self.y_m, self.cos, self.sin, self.curvature_per_m)
        return _locate(x_m, y_m, station_m, *lines, self.first_row, self.last_row)

    def along(self, station_m: FloatArray, offset_m: FloatArray) -> Along:
        """The routes' properties at stations and lateral offsets [G, P]."""
        lanes = (self.lane_offset_m, self.lane_end_m)
        return Along(*_along(station_m, offset_m, self.speed_limit_mps, *lanes, self.first_row, self.last_row))

    def find(self, x_m: FloatArray, y_m: FloatArray) -> FloatArray:
        """[G, P] stations in the table nearest to points [G, P], by a search of the whole route."""
        return _find(x_m, y_m, self.x_m, self.y_m, self.first_row, self.last_row)


@compiled
def _find(
    x_m: FloatArray,
    y_m: FloatArray,
    line_x_m: FloatArray,
    line_y_m: FloatArray,
    first_row: IntArray,
    last_row: IntArray,
) -> FloatArray:
    stations = np.empty(x_m.shape)
    for g, p in np.ndindex(x_m.shape):
        nearest, nearest2 = first_row[p], np.inf
        for row in range(first_row[p], last_row[p] + 1):
            distance2 = (line_x_m[row] - x_m[g, p]) ** 2 + (line_y_m[row] - y_m[g, p]) ** 2
            if distance2 < nearest2:
                nearest, nearest2 = row, distance2
        stations[g, p] = (nearest - first_row[p]) * SPACING_M - MARGIN_M
    return stations


@compiled
def _rows(station_m: FloatArray, first_row: IntArray, last_row: IntArray) -> IntArray:
    rows = np.empty(station_m.shape, dtype=np.int64)
    for g, p in np.ndindex(station_m.shape):
        rows[g, p] = row_at(station_m[g, p], first_row[p], last_row[p])
    return rows


@compiled
def row_at(station_m: float, first_row: int, last_row: int) -> int:
    """The row of a route nearest to a station; the first row for NaN."""
    rows = (station_m + MARGIN_M) / SPACING_M
    return first_row + int(min(np.rint(rows), last_row - first_row)) if rows > 0.0 else first_row


@compiled
def _locate(
    x_m: FloatArray,
    y_m: FloatArray,
    station_m: FloatArray,
    line_x_m: FloatArray,
    line_y_m: FloatArray,
    line_cos: FloatArray,
    line_sin: FloatArray,
    curvature_per_m: FloatArray,
    first_row: IntArray,
    last_row: IntArray,
) -> tuple[FloatArray, FloatArray]:
    """Newton's method on the distance to the line.

    A metre of travel on the inside of a curve is more than a metre of the line, on the outside less.
    """
    stations, offsets = station_m.copy(), np.empty_like(station_m)
    for g, p in np.ndindex(x_m.shape):
        for _ in range(3):
            row = row_at(stations[g, p], first_row[p], last_row[p])
            dx, dy = x_m[g, p] - line_x_m[row], y_m[g, p] - line_y_m[row]
            offset = dy * line_cos[row] - dx * line_sin[row]
            stretch = max(1.0 - curvature_per_m[row] * offset, _LEAST_STRETCH)
            along = (dx * line_cos[row] + dy * line_sin[row]) / stretch
            stations[g, p] = (row - first_row[p]) * SPACING_M - MARGIN_M + along
            offsets[g, p] = offset
    return stations, offsets


@compiled
def _along(
    station_m: FloatArray,
    offset_m: FloatArray,
    speed_limit_mps: FloatArray,
    lane_offset_m: FloatArray,
    lane_end_m: FloatArray,
    first_row: IntArray,
    last_row: IntArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    limit, nearest, ends = np.empty(offset_m.shape), np.empty(offset_m.shape), np.empty(offset_m.shape)
    for g, p in np.ndindex(offset_m.shape):
        row = row_at(station_m[g, p], first_row[p], last_row[p])
        limit[g, p] = speed_limit_mps[row]
        nearest[g, p], ends[g, p] = lane_at(row, offset_m[g, p], lane_offset_m, lane_end_m)
    return limit, nearest, ends


@compiled
def lane_at(row: int, offset_m: float, lane_offset_m: FloatArray, lane_end_m: FloatArray) -> tuple[float, float]:
    """Distance (m) to the centre of the nearest lane, and the station where that lane ends."""
    nearest, ends = np.inf, np.inf
    for lane in range(lane_offset_m.shape[1]):
        distance = abs(lane_offset_m[row, lane] - offset_m)
        if distance < nearest:  # false for NaN: a lane that does not exist here
            nearest, ends = distance, lane_end_m[row, lane]
    return nearest, ends


def _curvature_per_m(heading_rad: FloatArray) -> FloatArray:
    """[N] curvature of a route's line, left positive."""
    return np.gradient(np.unwrap(heading_rad), SPACING_M)


@dataclass(frozen=True, kw_only=True)
class Rails:
    """The edges of the drivable area as line segments, with a grid for spatial look-up."""

    segments: FloatArray  # [S, 2, 2]; the last one is far away and pads the cells
    origin_m: FloatArray  # [2]
    cells: IntArray  # [X, Y, K] rows of `segments` within reach of each cell

    @classmethod
    def of(cls, segments: FloatArray, reach_m: float) -> Rails:
        """Rails from segments [S, 2, 2]; `near` finds all segments within `reach_m` of a point."""
        segments = np.asarray(segments, dtype=float).reshape(-1, 2, 2)
        padded = np.concatenate((segments, np.full((1, 2, 2), _FAR_AWAY_M)))
        if not len(segments):
            return cls(segments=padded, origin_m=np.zeros(2), cells=np.zeros((1, 1, 1), dtype=np.int64))
        low = segments.min((0, 1)) - reach_m
        counts = ((segments.max((0, 1)) + reach_m - low) // _CELL_M).astype(int) + 1
        rows_of: dict[tuple[int, ...], list[int]] = {}
        first = ((segments.min(1) - reach_m - low) // _CELL_M).astype(int)
        last = ((segments.max(1) + reach_m - low) // _CELL_M).astype(int) + 1
        for row, (begin, end) in enumerate(zip(first, last, strict=True)):
            for cell in np.ndindex(*(end - begin)):
                rows_of.setdefault((begin[0] + cell[0], begin[1] + cell[1]), []).append(row)
        cells = np.full((*counts, max(map(len, rows_of.values()))), len(segments), dtype=np.int64)
        for place, rows in rows_of.items():
            cells[place][: len(rows)] = rows
        return cls(segments=padded, origin_m=low, cells=cells)

    def near(self, x_m: FloatArray, y_m: FloatArray) -> IntArray:
        """[G, P, K] rows of `segments` within reach of points [G, P]."""
        return _cells_at(x_m, y_m, self.origin_m, self.cells)

    def distance_m(self, cars: Box, limit_m: float) -> FloatArray:
        """[G, P] distance (m) of cars (places [G, P], sizes [P]) to the nearest rail, at most `limit_m`.

        `limit_m` must be within the reach of the rails.
        """
        return _distance_m(cars, self.segments, self.origin_m, self.cells, limit_m)


@compiled
def _distance_m(cars: Box, segments: FloatArray, origin_m: FloatArray, cells: IntArray, limit_m: float) -> FloatArray:
    return distance_to_nearest_segment(cars, segments, _cells_at(cars.x_m, cars.y_m, origin_m, cells), limit_m)


@compiled
def _cells_at(x_m: FloatArray, y_m: FloatArray, origin_m: FloatArray, cells: IntArray) -> IntArray:
    rows = np.empty((*x_m.shape, cells.shape[2]), dtype=cells.dtype)
    for g, p in np.ndindex(x_m.shape):
        column = _cell(x_m[g, p] - origin_m[0], cells.shape[0])
        line = _cell(y_m[g, p] - origin_m[1], cells.shape[1])
        rows[g, p] = cells[column, line]
    return rows


@compiled
def _cell(place_m: float, cells: int) -> int:
    """The cell at a place, clamped to the grid; the first cell for NaN."""
    return int(min(place_m / _CELL_M, cells - 1.0)) if place_m > 0.0 else 0


@dataclass(frozen=True)
class Road:
    """The rails, and a route for each player."""

    rails: Rails
    routes: Routes
