"""The road of a game: its rails, and each player's route as a table of stations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from harness.game.arrays import FloatArray, IntArray
from harness.game.jit import compiled
from harness.game.rails import Rails, Raster

SPACING_M = 0.5  # between stations of a route
MARGIN_M = 100.0  # straight extension of a route's table before its start and beyond its end
_BEND_M = 4.0  # a driver steers by the mean curvature of this length: the lines of a net have corners
_TIGHTEST = 1.0  # product of curvature and wheelbase: beyond the lock of any car
PREVIEW_S = 0.05  # time ahead of the bend for which a driver steers: half a step
AHEAD_M = np.array([0.0, 5.0, 10.0, 20.0, 30.0, 50.0])  # distances ahead of a player at which it sees the road
_LAST_SECTION_M = 30.0
COMFORTABLE_MPS2 = 2.0  # braking before a curve or a stop that was seen in time
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
    own_left_m: FloatArray  # offset of the left mark between own and oncoming lanes; inf without oncoming lanes there
    own_right_m: FloatArray  # the same on the right side, where traffic keeps to the left; -inf without
    speed_limit_mps: FloatArray
    lane_offset_m: FloatArray  # [N, L] of the lane's centre
    lane_end_m: FloatArray  # [N, L] station where the lane stops leading along this route; inf if it never does
    length_m: float
    goal_m: float


class Along(NamedTuple):
    """The route at the players, [G, P]."""

    speed_limit_mps: FloatArray
    approach_mps: FloatArray  # speed at which comfortable braking keeps to the limits ahead
    lane_offset_m: FloatArray  # distance to the centre of the nearest lane
    lane_end_m: FloatArray  # distance to the end of that lane; inf if it does not end
    goal_m: FloatArray  # distance to the goal; 0 or less after it
    wrong_way: FloatArray  # 1 for a centre among oncoming lanes, else 0
    road_steering_rad: FloatArray  # the steering angle that follows the route


_ALONG = len(Along._fields)


class Routes(NamedTuple):
    """The routes of all players in one table, with the columns of `Route`.

    The rows of player p are `first_row[p]` to `last_row[p]`.
    """

    x_m: FloatArray
    y_m: FloatArray
    cos: FloatArray
    sin: FloatArray
    curvature_per_m: FloatArray
    heading_rad: FloatArray
    bend_per_m: FloatArray  # curvature, smoothed over `_BEND_M`
    bend_ahead_per_m: FloatArray  # [N, K] the tightest in each section between `AHEAD_M`, and from the last for 30 m
    left_edge_m: FloatArray
    right_edge_m: FloatArray
    own_left_m: FloatArray
    own_right_m: FloatArray
    speed_limit_mps: FloatArray
    approach_mps: FloatArray  # speed at which comfortable braking keeps to the limits ahead
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
        columns |= {
            "cos": np.cos(columns["heading_rad"]),
            "sin": np.sin(columns["heading_rad"]),
            "curvature_per_m": np.concatenate(
                [np.gradient(np.unwrap(route.heading_rad), SPACING_M) for route in routes]
            ),
            "bend_ahead_per_m": np.concatenate([_bend_ahead_per_m(route.heading_rad) for route in routes]),
            "approach_mps": np.concatenate([_approach_mps(route.speed_limit_mps) for route in routes]),
            "bend_per_m": np.concatenate([_bend_per_m(route.heading_rad) for route in routes]),
        }
        rows = np.array([len(route.x_m) for route in routes])
        first = np.cumsum(rows) - rows
        return cls(
            **_side_by_side(columns),
            first_row=first,
            last_row=first + rows - 1,
            goal_m=np.array([route.goal_m for route in routes]),
        )

    def rows(self, station_m: FloatArray) -> IntArray:
        """[G, P] rows of the table nearest to stations [G, P]."""
        after = np.fmax(np.rint((station_m + MARGIN_M) / SPACING_M), 0.0)  # 0 for NaN
        return self.first_row + np.minimum(after, self.last_row - self.first_row).astype(np.int64)

    def locate(self, x_m: FloatArray, y_m: FloatArray, station_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Stations and lateral offsets (m, left positive) [G, P] of points [G, P], given their previous stations."""
        stations, offsets = _locate(x_m, y_m, station_m, tuple(self))
        return stations, offsets


@compiled
def row_at(station_m: float, first_row: int, last_row: int) -> int:
    """The row of a route nearest to a station; the first row for NaN."""
    rows = (station_m + MARGIN_M) / SPACING_M
    return first_row + int(min(np.rint(rows), last_row - first_row)) if rows > 0.0 else first_row


@compiled
def steering_of_bend_rad(bend_per_m: float, wheelbase_m: float) -> float:
    """The steering angle (rad) with which a car drives a bend: the inverse of `bicycle.curvature_per_m`."""
    turn = min(max(bend_per_m * wheelbase_m, -_TIGHTEST), _TIGHTEST)
    return np.arctan(turn / np.sqrt(1.0 - 0.25 * turn**2))


@compiled
def _locate(x_m: FloatArray, y_m: FloatArray, station_m: FloatArray, table: tuple[Any, ...]) -> FloatArray:
    """[2, G, P] stations and lateral offsets, by Newton's method on the distance to the line.

    A metre of travel on the inside of a curve is more than a metre of the line, on the outside less.
    """
    routes, places = Routes(*table), np.empty((2, *station_m.shape))
    for g, p in np.ndindex(x_m.shape):
        station, offset = station_m[g, p], 0.0
        for _ in range(3):
            row = row_at(station, routes.first_row[p], routes.last_row[p])
            dx, dy = x_m[g, p] - routes.x_m[row], y_m[g, p] - routes.y_m[row]
            cosine, sine = routes.cos[row], routes.sin[row]
            offset = dy * cosine - dx * sine
            stretch = max(1.0 - routes.curvature_per_m[row] * offset, _LEAST_STRETCH)
            along = (dx * cosine + dy * sine) / stretch
            station = (row - routes.first_row[p]) * SPACING_M - MARGIN_M + along
        places[0, g, p], places[1, g, p] = station, offset
    return places


@compiled
def along(
    players: tuple[FloatArray, FloatArray, FloatArray],
    limit_share: FloatArray,
    wheels: tuple[FloatArray, FloatArray],
    table: tuple[Any, ...],
) -> FloatArray:
    """[7, G, P] the columns of `Along`, of players with stations, lateral offsets and speeds [G, P], and factors on the
    speed limits [G]; `wheels` are their wheelbases and lags of the steering [P], `table` are the routes.

    A car follows the road by the bend at its rear axle, which has no slip, in `PREVIEW_S` after the lag of its
    steering. With the bend at the centre, it would leave a quarter circle by two metres.
    """
    wheelbase_m, steering_lag_s = wheels
    routes, (station_m, offset_m, speed_mps) = Routes(*table), players
    found = np.empty((_ALONG, *station_m.shape))
    for g, p in np.ndindex(station_m.shape):
        station, offset, first, last = station_m[g, p], offset_m[g, p], routes.first_row[p], routes.last_row[p]
        row = row_at(station, first, last)
        lane_offset, lane_end = _lane_at(row, offset, routes.lane_offset_m, routes.lane_end_m)
        beside = offset > routes.own_left_m[row] or offset < routes.own_right_m[row]
        ahead_m = (PREVIEW_S + steering_lag_s[p]) * speed_mps[g, p] - 0.5 * wheelbase_m[p]
        rear_axle = row_at(station + ahead_m, first, last)
        columns = (
            routes.speed_limit_mps[row] * limit_share[g],
            routes.approach_mps[row] * limit_share[g],
            lane_offset,
            np.maximum(lane_end - station, 0.0),
            routes.goal_m[p] - station,
            1.0 if beside else 0.0,
            steering_of_bend_rad(routes.bend_per_m[rear_axle], wheelbase_m[p]),
        )
        for k, value in enumerate(columns):
            found[k, g, p] = value
    return found


@compiled
def _lane_at(row: int, offset_m: float, lane_offset_m: FloatArray, lane_end_m: FloatArray) -> tuple[float, float]:
    """Distance (m) to the centre of the nearest lane, and the station where that lane ends."""
    nearest, ends = np.inf, np.inf
    for lane in range(lane_offset_m.shape[1]):
        distance = abs(lane_offset_m[row, lane] - offset_m)
        if distance < nearest:  # false for NaN: a lane that does not exist here
            nearest, ends = distance, lane_end_m[row, lane]
    return nearest, ends


def _side_by_side(columns: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """The columns as views of one array, in which the values of a station are neighbours: reading several of them loads
    few lines of memory."""
    ordered = {name: columns[name] for name in Routes._fields if name in columns}
    table = np.concatenate([column.reshape(len(column), -1) for column in ordered.values()], axis=1)
    widths = [column.size // len(column) for column in ordered.values()]
    parts = np.split(table, np.cumsum(widths)[:-1], axis=1)
    return {name: part[:, 0] if columns[name].ndim == 1 else part for name, part in zip(ordered, parts, strict=True)}


def _bend_per_m(heading_rad: FloatArray) -> FloatArray:
    """[N] mean curvature of a route's line around each station, left positive."""
    turned = np.unwrap(heading_rad)
    rows = np.arange(len(turned))
    reach = round(0.5 * _BEND_M / SPACING_M)
    before, after = np.maximum(rows - reach, 0), np.minimum(rows + reach, len(turned) - 1)
    bend: FloatArray = (turned[after] - turned[before]) / ((after - before) * SPACING_M)
    return bend


def _bend_ahead_per_m(heading_rad: FloatArray) -> FloatArray:
    """[N, K] the curvature of greatest size in each section of the road ahead."""
    bend = _bend_per_m(heading_rad)
    sections = np.rint(np.append(AHEAD_M, AHEAD_M[-1] + _LAST_SECTION_M) / SPACING_M).astype(int)
    columns = []
    for first, end in pairwise(sections.tolist()):
        padded = np.pad(bend, (0, end), mode="edge")
        windows = np.lib.stride_tricks.sliding_window_view(padded[first:], end - first)[: len(bend)]
        tightest = np.abs(windows).argmax(1)
        columns.append(windows[np.arange(len(bend)), tightest])
    return np.stack(columns, axis=1)


def _approach_mps(speed_limit_mps: FloatArray) -> FloatArray:
    """[N] greatest speed at each station from which braking at `COMFORTABLE_MPS2` keeps to the limits ahead."""
    gained2 = 2.0 * COMFORTABLE_MPS2 * SPACING_M * np.arange(len(speed_limit_mps))
    reach2 = np.minimum.accumulate((speed_limit_mps**2 + gained2)[::-1])[::-1] - gained2
    approach: FloatArray = np.sqrt(np.maximum(reach2, 0.0))
    return approach


@dataclass(frozen=True)
class Road:
    """The rails, and a route for each player."""

    rails: Rails
    routes: Routes
    walkers_rails: Rails | None = None
    """The edges of the surface for players on foot; None if no player is."""
    carriageway: Raster | None = None
    """The part of that surface for vehicles, around the ways of players on foot."""
