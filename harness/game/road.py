"""The road as the game needs it: rails to hit, and each player's route as a table of stations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from harness.game.arrays import FloatArray, IntArray
from harness.game.geometry import Box, distance_to_nearest_segment
from harness.game.jit import compiled

SPACING_M = 0.5  # between stations of a route
MARGIN_M = 100.0  # how far a route's table goes on, straight, before its start and beyond its end
_CELL_M = 20.0
_FAR_AWAY_M = 1e6
_LEAST_STRETCH = 0.25  # nearer to a curve's centre, or beyond it, no station is nearest


@dataclass(frozen=True)
class Route:
    """A way through the scene, tabled every `SPACING_M` metres, from -MARGIN_M to length + MARGIN_M.

    Arrays are [N], per lane [N, L]; lateral offsets are metres to the left of the route's line. A station has as
    many lanes as the road there; the rest of its row is NaN.
    """

    x_m: FloatArray
    y_m: FloatArray
    heading_rad: FloatArray
    left_edge_m: FloatArray
    right_edge_m: FloatArray
    speed_limit_mps: FloatArray
    lane_offset_m: FloatArray  # [N, L] of the lane's centre
    lane_end_m: FloatArray  # [N, L] station where the lane ends for who follows this route; inf if it goes on
    length_m: float
    goal_m: float


class Along(NamedTuple):
    """What a route is like where a player is, [G, P]."""

    speed_limit_mps: FloatArray
    lane_offset_m: FloatArray  # distance to the centre of the nearest lane
    lane_end_m: FloatArray  # station where that lane ends; inf if it goes on


class Routes(NamedTuple):
    """The routes of all players in one table, so that a look-up serves them all: rows of player p begin at
    `first_row[p]`. Columns are as in `Route`."""

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
        """One table of the players' routes."""
        lanes = max(route.lane_offset_m.shape[1] for route in routes)

        def column(name: str) -> FloatArray:
            parts = [getattr(route, name) for route in routes]
            if parts[0].ndim == 2:
                missing = [((0, 0), (0, lanes - part.shape[1])) for part in parts]
                parts = [np.pad(part, pad, constant_values=np.nan) for part, pad in zip(parts, missing, strict=True)]
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
        """[G, P] rows of the table nearest to the players' stations [G, P]."""
        return _rows(station_m, self.first_row, self.last_row)

    def locate(self, x_m: FloatArray, y_m: FloatArray, station_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Stations and lateral offsets (m, left positive) of the players at points [G, P], given where they were."""
        lines = (self.x_m, self.y_m, self.cos, self.sin, self.curvature_per_m)
        return _locate(x_m, y_m, station_m, *lines, self.first_row, self.last_row)

    def along(self, station_m: FloatArray, offset_m: FloatArray) -> Along:
        """What the players' routes are like where they are: at stations and lateral offsets [G, P]."""
        lanes = (self.lane_offset_m, self.lane_end_m)
        return Along(*_along(station_m, offset_m, self.speed_limit_mps, *lanes, self.first_row, self.last_row))

    def find(self, x_m: FloatArray, y_m: FloatArray) -> FloatArray:
        """[G, P] stations in the table nearest to players of whom nothing is known but the points [G, P]."""
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
            away2 = (line_x_m[row] - x_m[g, p]) ** 2 + (line_y_m[row] - y_m[g, p]) ** 2
            if away2 < nearest2:
                nearest, nearest2 = row, away2
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
    """The row of a route nearest to a station (its first where there is no telling: NaN)."""
    onward = (station_m + MARGIN_M) / SPACING_M
    return first_row + int(min(np.rint(onward), last_row - first_row)) if onward > 0.0 else first_row


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
    """Newton's method on the distance to the line: a metre to the inside of a curve is more of its line, a metre to
    the outside less."""
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
    """Distance to the centre of the nearest lane, and the station where it ends, at a row and a lateral offset."""
    nearest, ends = np.inf, np.inf
    for lane in range(lane_offset_m.shape[1]):
        away = abs(lane_offset_m[row, lane] - offset_m)
        if away < nearest:  # never true of NaN: there is no such lane here
            nearest, ends = away, lane_end_m[row, lane]
    return nearest, ends


def _curvature_per_m(heading_rad: FloatArray) -> FloatArray:
    """[N] how fast a route's line turns to the left."""
    return np.gradient(np.unwrap(heading_rad), SPACING_M)


@dataclass(frozen=True)
class Rails:
    """The edges of the drivable area as line segments, found by place."""

    segments: FloatArray  # [S, 2, 2], the last one far away: it fills cells that have fewer
    origin_m: FloatArray  # [2]
    cells: IntArray  # [X, Y, K] rows of `segments` within reach of each cell

    @classmethod
    def of(cls, segments: FloatArray, reach_m: float) -> Rails:
        """Rails from segments [S, 2, 2]; `near` will know all within `reach_m` of a point."""
        segments = np.asarray(segments, dtype=float).reshape(-1, 2, 2)
        padded = np.concatenate((segments, np.full((1, 2, 2), _FAR_AWAY_M)))
        if not len(segments):
            return cls(padded, np.zeros(2), np.zeros((1, 1, 1), dtype=np.int64))
        low = segments.min((0, 1)) - reach_m
        counts = ((segments.max((0, 1)) + reach_m - low) // _CELL_M).astype(int) + 1
        found: dict[tuple[int, ...], list[int]] = {}
        first = ((segments.min(1) - reach_m - low) // _CELL_M).astype(int)
        last = ((segments.max(1) + reach_m - low) // _CELL_M).astype(int) + 1
        for row, (begin, end) in enumerate(zip(first, last, strict=True)):
            for cell in np.ndindex(*(end - begin)):
                found.setdefault((begin[0] + cell[0], begin[1] + cell[1]), []).append(row)
        cells = np.full((*counts, max(map(len, found.values()))), len(segments), dtype=np.int64)
        for place, rows in found.items():
            cells[place][: len(rows)] = rows
        return cls(padded, low, cells)

    def near(self, x_m: FloatArray, y_m: FloatArray) -> IntArray:
        """[G, P, K] rows of `segments` that are within reach of points [G, P]."""
        return _cells_at(x_m, y_m, self.origin_m, self.cells)

    def distance_m(self, cars: Box, limit_m: float) -> FloatArray:
        """[G, P] distance of cars (places [G, P], sizes [P]) to the nearest rail; never over a limit within reach."""
        return _distance_m(cars, self.segments, self.origin_m, self.cells, limit_m)


@compiled
def _distance_m(cars: Box, segments: FloatArray, origin_m: FloatArray, cells: IntArray, limit_m: float) -> FloatArray:
    return distance_to_nearest_segment(cars, segments, _cells_at(cars.x_m, cars.y_m, origin_m, cells), limit_m)


@compiled
def _cells_at(x_m: FloatArray, y_m: FloatArray, origin_m: FloatArray, cells: IntArray) -> IntArray:
    found = np.empty((*x_m.shape, cells.shape[2]), dtype=cells.dtype)
    for g, p in np.ndindex(x_m.shape):
        column = _cell(x_m[g, p] - origin_m[0], cells.shape[0])
        row = _cell(y_m[g, p] - origin_m[1], cells.shape[1])
        found[g, p] = cells[column, row]
    return found


@compiled
def _cell(place_m: float, cells: int) -> int:
    """The cell at a place, or the nearest one (the first one where there is no telling: NaN)."""
    return int(min(place_m / _CELL_M, cells - 1.0)) if place_m > 0.0 else 0


@dataclass(frozen=True)
class Road:
    """What the players drive on: the rails, and a route for each player."""

    rails: Rails
    routes: Routes
