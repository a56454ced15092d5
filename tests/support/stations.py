"""Stations of points on the routes of players."""

from __future__ import annotations

import numpy as np

from harness.game.arrays import FloatArray
from harness.game.road import MARGIN_M, SPACING_M, Routes


def nearest_station_m(routes: Routes, x_m: FloatArray, y_m: FloatArray) -> FloatArray:
    """[G, P] stations in the table nearest to points [G, P], by a search of the whole route of each player."""
    stations = np.empty(x_m.shape)
    for p, (first, last) in enumerate(zip(routes.first_row, routes.last_row, strict=True)):
        rows = slice(first, last + 1)
        away_m = np.hypot(routes.x_m[rows] - x_m[:, p, None], routes.y_m[rows] - y_m[:, p, None])
        stations[:, p] = away_m.argmin(axis=1) * SPACING_M - MARGIN_M
    return stations
