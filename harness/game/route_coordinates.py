"""Bodies in the coordinates of a player's route: ahead and to the left of the player, in metres."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from harness.game.arrays import FloatArray
from harness.game.geometry import Box
from harness.game.jit import compiled, inlined
from harness.game.road import AHEAD_M, MARGIN_M, SPACING_M, Routes, row_at

# distances ahead of a player at which its route is sampled
PATH_M = np.concatenate(([-20.0, -10.0], AHEAD_M))
_PATH_ROWS = np.rint(PATH_M / SPACING_M).astype(np.int64)


class OnRoute(NamedTuple):
    """The place of one player on its route."""

    station_m: float
    offset_m: float  # from the route's line, left positive
    row: int  # of the table of routes, nearest to the station
    first_row: int  # of the player's route
    last_row: int


class OnPath(NamedTuple):
    """Bodies in route coordinates, [G, P, B]: centres relative to the player's centre, and half extents."""

    ahead_m: FloatArray
    left_m: FloatArray
    half_length_m: FloatArray
    half_width_m: FloatArray


@inlined
def on_route(station_m: float, offset_m: float, player: int, routes: Routes) -> OnRoute:
    """The place of a player on its route."""
    first, last = routes.first_row[player], routes.last_row[player]
    return OnRoute(station_m, offset_m, row_at(station_m, first, last), first, last)


@compiled
def row_ahead(place: OnRoute, k: int) -> int:
    """The row of the route at the distance `PATH_M[k]` from a place, clamped to the route."""
    return min(max(place.row + _PATH_ROWS[k], place.first_row), place.last_row)


@compiled
def point_along_route(place: OnRoute, routes: Routes, x_m: float, y_m: float) -> tuple[float, float, int]:
    """A point relative to a player: ahead and to the left (m), and the row of its frame, the nearest one of the route
    at `PATH_M`."""
    nearest, nearest2 = 0, np.inf
    for k in range(len(_PATH_ROWS)):
        sample = row_ahead(place, k)
        distance2 = (x_m - routes.x_m[sample]) ** 2 + (y_m - routes.y_m[sample]) ** 2
        if distance2 < nearest2:
            nearest, nearest2 = k, distance2
    frame = row_ahead(place, nearest)
    dx, dy = x_m - routes.x_m[frame], y_m - routes.y_m[frame]
    cosine, sine = routes.cos[frame], routes.sin[frame]
    ahead, left = dx * cosine + dy * sine + PATH_M[nearest], dy * cosine - dx * sine
    to_row_m = (place.row - place.first_row) * SPACING_M - MARGIN_M - place.station_m  # rows are rounded stations
    return ahead + to_row_m, left - place.offset_m, frame


@compiled
def half_extents_m(turned_rad: float, length_m: float, width_m: float) -> tuple[float, float]:
    """Half the extents, along and across, of a body at an angle. Neither exceeds half of length plus width."""
    along, across = abs(np.cos(turned_rad)), abs(np.sin(turned_rad))
    return 0.5 * (length_m * along + width_m * across), 0.5 * (length_m * across + width_m * along)


@compiled
def on_path(
    station_m: FloatArray, lateral_offset_m: FloatArray, table: tuple[Any, ...], boxes: tuple[Any, ...]
) -> FloatArray:
    """[4, G, P, B] the columns of `OnPath`, of players [G, P] and boxes [G, B]; `table` are the routes."""
    routes, bodies = Routes(*table), Box(*boxes)
    games, players = station_m.shape
    found = np.empty((4, games, players, bodies.x_m.shape[1]))
    for g, p in np.ndindex(station_m.shape):
        place = on_route(station_m[g, p], lateral_offset_m[g, p], p, routes)
        for b in range(bodies.x_m.shape[1]):
            ahead, left, frame = point_along_route(place, routes, bodies.x_m[g, b], bodies.y_m[g, b])
            turned = bodies.heading_rad[g, b] - routes.heading_rad[frame]
            extents = half_extents_m(turned, bodies.length_m[g, b], bodies.width_m[g, b])
            found[0, g, p, b], found[1, g, p, b] = ahead, left
            found[2, g, p, b], found[3, g, p, b] = extents
    return found
