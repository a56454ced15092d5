"""A part of the ground as a grid of cells, for look-up of points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from harness.game.arrays import BoolArray, FloatArray
from harness.game.jit import compiled

CELL_M = 0.25


@dataclass(frozen=True, kw_only=True)
class Raster:
    """The cells of a part of the ground."""

    origin_m: FloatArray  # [2] corner of the first cell
    cells: BoolArray  # [X, Y] whether the centre of the cell belongs to the part

    def at(self, x_m: FloatArray, y_m: FloatArray) -> FloatArray:
        """[G, P] 1 for points within the part, 0 for others and outside of the grid."""
        return _at(x_m, y_m, self.origin_m, self.cells)


@compiled
def _at(x_m: FloatArray, y_m: FloatArray, origin_m: FloatArray, cells: BoolArray) -> FloatArray:
    found = np.zeros(x_m.shape)
    for g, p in np.ndindex(x_m.shape):
        u, v = (x_m[g, p] - origin_m[0]) / CELL_M, (y_m[g, p] - origin_m[1]) / CELL_M
        if 0.0 <= u < cells.shape[0] and 0.0 <= v < cells.shape[1] and cells[int(u), int(v)]:
            found[g, p] = 1.0
    return found
