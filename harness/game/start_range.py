"""Where a player starts: a range along a lane or a route, or a time of arrival relative to the ego's."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from functools import cached_property
from math import atan2, hypot

import numpy as np

from harness.game.arrays import FloatArray
from harness.game.seeding import between


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
