"""Where players start: a range along a lane or a route, or a time of arrival relative to the ego's; in training also
anywhere along their routes.

A scene's starts are a few seconds from its conflict, and a learner that fails early sees little of the rest of its
route. With starts along the whole route, every part of it is practised from the first game on.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import atan2, hypot

import numpy as np

from harness.game.arrays import BoolArray, FloatArray
from harness.game.geometry import Box, box_distance, boxes_of
from harness.game.road import Routes
from harness.game.roles import EGO
from harness.game.seeding import between

_BEFORE_GOAL_M = 10.0
_CLEAR_M, _CLEAR_WIDTH_M = 6.0, 2.6  # of the way before and behind a car that is free of obstacles
_ATTEMPTS = 20
_OFFSET_SD_M, _TURNED_SD_RAD = 0.2, 0.03  # from the centre of the lane, and from its direction


@dataclass(frozen=True)
class OnLine:
    """A start at positions (m) along the player's own line."""

    position_m: tuple[float, float]


@dataclass(frozen=True)
class BesideEgo:
    """A start at positions (m) relative to the ego's, ahead (+) or behind (-)."""

    offset_m: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class ArrivesAfterEgo:
    """A start from which the player arrives at a meeting point at a time (s) after the ego, at constant speeds."""

    after_s: tuple[float, float]
    meeting_m: float  # along the player's line
    ego_meeting_m: float  # along the ego's line


@dataclass(frozen=True, kw_only=True)
class StartRange:
    """The range of a player's start: positions of its front bumper along a line, and speeds."""

    line: FloatArray  # [n, 2] the centre line of a lane, or the line of the player's route
    place: OnLine | BesideEgo | ArrivesAfterEgo
    speed_mps: tuple[float, float]
    scale: float = 1.0  # metres of the line per metre of the lane: SUMO's lane length may differ from its shape

    def position_m(self, share: float, speed_mps: float, ego_m: float, ego_mps: float) -> float:
        """The position at a share, from 0 to 1, of the range, for this speed and the ego's position and speed."""
        match self.place:
            case OnLine(position_m=bounds):
                return between(bounds, share)
            case BesideEgo(offset_m=bounds):
                return between(bounds, share) + ego_m
            case ArrivesAfterEgo(after_s=bounds, meeting_m=meeting_m, ego_meeting_m=ego_meeting_m):
                arrival_s = (ego_meeting_m - ego_m) / ego_mps + between(bounds, share)
                return meeting_m - speed_mps * arrival_s

    def pose(self, position_m: float, length_m: float) -> tuple[float, float, float]:
        """x_m and y_m of the body's centre and heading_rad, for a front bumper at this position along the lane."""
        points, stations = self._points
        position_m *= self.scale
        segment = min(max(bisect_right(stations, position_m) - 1, 0), len(stations) - 2)
        (x, y), (end_x, end_y) = points[segment : segment + 2]
        length = hypot(end_x - x, end_y - y)
        share = (position_m - stations[segment] - 0.5 * length_m) / length
        return x + share * (end_x - x), y + share * (end_y - y), atan2(end_y - y, end_x - x)

    @cached_property
    def _points(self) -> tuple[list[list[float]], list[float]]:
        """The points of the line, and the distance of each along the line."""
        lengths = np.hypot(*np.diff(self.line, axis=0).T)
        return self.line.tolist(), [0.0, *np.cumsum(lengths).tolist()]


def starts_in(places: Sequence[StartRange], shares: FloatArray) -> tuple[list[float], list[float]]:
    """The positions and speeds of players at shares [P, 2], from 0 to 1, of their ranges of positions and of speeds."""
    positions_m, speeds_mps = list[float](), list[float]()
    for place, (share, of_speeds) in zip(places, shares.tolist(), strict=True):
        speeds_mps.append(between(place.speed_mps, of_speeds))
        ego_m = positions_m[EGO] if positions_m else 0.0
        positions_m.append(place.position_m(share, speeds_mps[-1], ego_m, speeds_mps[EGO]))
    return positions_m, speeds_mps


def poses_of(places: Sequence[StartRange], positions_m: Sequence[float], length_m: FloatArray) -> FloatArray:
    """[3, P] x_m, y_m and heading_rad of players of `length_m` [P] whose front bumpers are at these positions."""
    starts = zip(places, positions_m, length_m.tolist(), strict=True)
    return np.array([place.pose(position, length) for place, position, length in starts]).T


def draw_along_route(
    routes: Routes,
    generator: np.random.Generator,
    *,
    length_m: FloatArray,
    max_speed_mps: FloatArray,
    present: BoolArray,
    share: float,
    obstacles: Box,
) -> FloatArray | None:
    """[5, P] x_m, y_m, heading_rad, speed_mps and station_m of the centres of players of `length_m` [P].

    None in 1 - `share` of the games, and if `_ATTEMPTS` draws have no place apart from the `obstacles` [O] for those
    that are `present` [P]. A lane and a station are drawn uniformly, the speed uniformly from 0 to
    the speed limit, or to the player's `max_speed_mps` [P] if that is less.
    """
    if generator.random() >= share:
        return None
    for _ in range(_ATTEMPTS):
        drawn = [_draw(routes, each, (length_m[each], max_speed_mps[each]), generator) for each in range(len(length_m))]
        starts = np.array(drawn).T
        if _clear(starts, length_m, present, obstacles):
            return starts
    return None


def _draw(
    routes: Routes, player: int, car: tuple[float, float], generator: np.random.Generator
) -> tuple[float, float, float, float, float]:
    length_m, max_speed_mps = car
    last_m = max(routes.goal_m[player] - _BEFORE_GOAL_M, 0.5 * length_m)
    station_m = generator.uniform(0.5 * length_m, last_m)
    row = int(routes.rows(np.full((1, len(routes.goal_m)), station_m))[0, player])
    lanes_m = routes.lane_offset_m[row]
    lanes_m = lanes_m[np.isfinite(lanes_m)]
    lane_m = float(generator.choice(lanes_m)) if len(lanes_m) else 0.0
    offset_m = lane_m + generator.normal(0.0, _OFFSET_SD_M)
    heading_rad = routes.heading_rad[row]
    x_m = routes.x_m[row] - offset_m * np.sin(heading_rad)
    y_m = routes.y_m[row] + offset_m * np.cos(heading_rad)
    turned_rad = generator.normal(0.0, _TURNED_SD_RAD)
    speed_mps = generator.uniform(0.0, min(routes.speed_limit_mps[row], max_speed_mps))
    return x_m, y_m, heading_rad + turned_rad, speed_mps, station_m


def _clear(starts: FloatArray, length_m: FloatArray, present: BoolArray, obstacles: Box) -> bool:
    """Whether no obstacle stands on the way just before, beside or behind a player that is present."""
    ways = [
        Box(x_m, y_m, heading_rad, own_m + 2.0 * _CLEAR_M, _CLEAR_WIDTH_M)
        for x_m, y_m, heading_rad, own_m in zip(*starts[:3, present].tolist(), length_m[present].tolist(), strict=True)
    ]
    return all(box_distance(way, box) > 0.0 for way in ways for box in boxes_of(obstacles))
