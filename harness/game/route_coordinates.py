"""Bodies in the coordinates of a player's route: ahead and to the left of the player, in metres."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from harness.game.arrays import FloatArray
from harness.game.jit import compiled
from harness.game.road import AHEAD_M, MARGIN_M, SPACING_M, Routes, row_at

# distances ahead of a player at which its route is sampled
PATH_M = np.concatenate(([-20.0, -10.0], AHEAD_M))
_PATH_ROWS = np.rint(PATH_M / SPACING_M).astype(np.int64)


class OnPath(NamedTuple):
    """Bodies in route coordinates, [G, P, B]: centres relative to the player's centre, and half extents."""

    ahead_m: FloatArray
    left_m: FloatArray
    half_length_m: FloatArray
    half_width_m: FloatArray


@compiled
def row_ahead(row: int, k: int, first_row: int, last_row: int) -> int:
    """The row of a route at the distance `PATH_M[k]` from another row, clamped to the route."""
    return min(max(row + _PATH_ROWS[k], first_row), last_row)


@compiled
def along_route(
    row: int,
    station_m: float,
    offset_m: float,
    player: int,
    routes: Routes,
    x_m: float,
    y_m: float,
    heading_rad: float,
    length_m: float,
    width_m: float,
) -> tuple[float, float, float, float]:
    """A body in route coordinates relative to a player (m): centre ahead and to the left, half length, half width.
    The frame is the nearest one of the route at `PATH_M`."""
    ahead, left, frame = place_along_route(row, station_m, offset_m, player, routes, x_m, y_m)
    return ahead, left, *half_extents_m(heading_rad - routes.heading_rad[frame], length_m, width_m)


@compiled
def place_along_route(
    row: int, station_m: float, offset_m: float, player: int, routes: Routes, x_m: float, y_m: float
) -> tuple[float, float, int]:
    """A point in route coordinates relative to a player: ahead and to the left (m), and the row of its frame."""
    first, last = routes.first_row[player], routes.last_row[player]
    nearest, nearest2 = 0, np.inf
    for k in range(len(_PATH_ROWS)):
        sample = row_ahead(row, k, first, last)
        distance2 = (x_m - routes.x_m[sample]) ** 2 + (y_m - routes.y_m[sample]) ** 2
        if distance2 < nearest2:
            nearest, nearest2 = k, distance2
    frame = row_ahead(row, nearest, first, last)
    dx, dy = x_m - routes.x_m[frame], y_m - routes.y_m[frame]
    cosine, sine = routes.cos[frame], routes.sin[frame]
    ahead, left = dx * cosine + dy * sine + PATH_M[nearest], dy * cosine - dx * sine
    to_row_m = (row - first) * SPACING_M - MARGIN_M - station_m  # rows are rounded stations
    return ahead + to_row_m, left - offset_m, frame


@compiled
def half_extents_m(turned_rad: float, length_m: float, width_m: float) -> tuple[float, float]:
    """Half the extents, along and across, of a body at an angle. Neither exceeds half of length plus width."""
    along, across = abs(np.cos(turned_rad)), abs(np.sin(turned_rad))
    return 0.5 * (length_m * along + width_m * across), 0.5 * (length_m * across + width_m * along)


@compiled
def on_path(
    station_m: FloatArray,
    lateral_offset_m: FloatArray,
    table: tuple[Any, ...],
    x_m: FloatArray,
    y_m: FloatArray,
    heading_rad: FloatArray,
    length_m: FloatArray,
    width_m: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """The columns of `OnPath`, of players [G, P] and bodies [G, B]; `table` are the routes."""
    routes = Routes(*table)
    shape = (station_m.shape[0], station_m.shape[1], x_m.shape[1])
    ahead, left, half_length, half_width = np.empty(shape), np.empty(shape), np.empty(shape), np.empty(shape)
    for g, p in np.ndindex(station_m.shape):
        station, offset = station_m[g, p], lateral_offset_m[g, p]
        row = row_at(station, routes.first_row[p], routes.last_row[p])
        for b in range(x_m.shape[1]):
            box = (x_m[g, b], y_m[g, b], heading_rad[g, b], length_m[g, b], width_m[g, b])
            extent = along_route(row, station, offset, p, routes, *box)
            ahead[g, p, b], left[g, p, b], half_length[g, p, b], half_width[g, p, b] = extent
    return ahead, left, half_length, half_width
