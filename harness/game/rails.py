"""The rails of a road and the parts of its surface, with grids for spatial look-up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.geometry import Box, distance_to_nearest_segment
from harness.game.jit import compiled

_CELL_M = 20.0  # of the grid of rails
RASTER_M = 0.25  # of a part of the ground
_FAR_AWAY_M = 1e6


@dataclass(frozen=True, kw_only=True)
class Rails:
    """The edges of the drivable area as line segments, with a grid for spatial look-up."""

    segments: FloatArray  # [S, 2, 2]; the last one is far away: that of a row of -1
    origin_m: FloatArray  # [2]
    cells: IntArray  # [X, Y, K] rows of `segments` within reach of each cell, then -1

    @classmethod
    def of(cls, segments: FloatArray, reach_m: float) -> Rails:
        """Rails from segments [S, 2, 2]; `lists` has all segments within `reach_m` of a point."""
        segments = np.asarray(segments, dtype=float).reshape(-1, 2, 2)
        padded = np.concatenate((segments, np.full((1, 2, 2), _FAR_AWAY_M)))
        if not len(segments):
            return cls(segments=padded, origin_m=np.zeros(2), cells=np.full((1, 1, 1), -1))
        low = segments.min((0, 1)) - reach_m
        counts = ((segments.max((0, 1)) + reach_m - low) // _CELL_M).astype(int) + 1
        rows_of: dict[tuple[int, ...], list[int]] = {}
        first = ((segments.min(1) - reach_m - low) // _CELL_M).astype(int)
        last = ((segments.max(1) + reach_m - low) // _CELL_M).astype(int) + 1
        for row, (begin, end) in enumerate(zip(first, last, strict=True)):
            for cell in np.ndindex(*(end - begin)):
                rows_of.setdefault((begin[0] + cell[0], begin[1] + cell[1]), []).append(row)
        cells = np.full((*counts, max(map(len, rows_of.values()))), -1)
        for place, rows in rows_of.items():
            cells[place][: len(rows)] = rows
        return cls(segments=padded, origin_m=low, cells=cells)

    def lists(self, x_m: FloatArray, y_m: FloatArray) -> tuple[IntArray, IntArray]:
        """Lists [L, K] of rows of `segments`, then -1, and the number of the list within reach of points [G, P]."""
        count = self.cells.shape[2]
        return self.cells.reshape(-1, count), _cells_at(x_m, y_m, self.origin_m, self.cells)

    def distance_m(self, cars: Box, limit_m: float) -> FloatArray:
        """[G, P] distance (m) of cars (places [G, P], sizes [P]) to the nearest rail, at most `limit_m`.

        `limit_m` must be within the reach of the rails.
        """
        return distance_to_nearest_segment(cars, self.segments, self.lists(cars.x_m, cars.y_m), limit_m)


@compiled
def _cells_at(x_m: FloatArray, y_m: FloatArray, origin_m: FloatArray, cells: IntArray) -> IntArray:
    found = np.empty(x_m.shape, dtype=np.int64)
    for g, p in np.ndindex(x_m.shape):
        column = _cell(x_m[g, p] - origin_m[0], cells.shape[0])
        line = _cell(y_m[g, p] - origin_m[1], cells.shape[1])
        found[g, p] = column * cells.shape[1] + line
    return found


@compiled
def _cell(place_m: float, cells: int) -> int:
    """The cell at a place, clamped to the grid; the first cell for NaN."""
    return int(min(place_m / _CELL_M, cells - 1.0)) if place_m > 0.0 else 0


@dataclass(frozen=True, kw_only=True)
class Raster:
    """The cells of a part of the ground."""

    origin_m: FloatArray  # [2] corner of the first cell
    cells: BoolArray  # [X, Y] whether the centre of the cell belongs to the part

    def at(self, x_m: FloatArray, y_m: FloatArray) -> FloatArray:
        """[G, P] 1 for points within the part, 0 for others and outside of the grid."""
        u, v = (x_m - self.origin_m[0]) / RASTER_M, (y_m - self.origin_m[1]) / RASTER_M
        inside = (u >= 0.0) & (u < self.cells.shape[0]) & (v >= 0.0) & (v < self.cells.shape[1])
        found: FloatArray = np.zeros(x_m.shape)
        found[inside] = self.cells[u[inside].astype(int), v[inside].astype(int)]
        return found
