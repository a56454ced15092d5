"""Vehicles of a warm-up that leave the players and the obstacles of a game room."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from harness.game.arrays import FloatArray
from harness.game.geometry import Box, box_distance
from harness.game.initial_state import InitialState
from harness.road.demand.route_file import Departure, Motion
from harness.road.scene.open_obstacles import boxes_of

CLEAR_M, CLEAR_S, CLEAR_AROUND_M = 10.0, 2.0, 2.0
"""Room at a player's start: no vehicle on its lane nearer than the first or than the way that the one behind drives in
the second, and none nearer than the third anywhere."""
_LANE_M = 3.0


def clear_of_players(departures: Sequence[Departure], start: InitialState, length_m: FloatArray) -> list[Departure]:
    """The departures without vehicles of the warm-up that are too near to a player's start (`CLEAR_M` and the others).

    `length_m` [P] are the players' lengths. Players that take no part count too: arms have the same traffic.
    """
    return [each for each in departures if each.motion is None or not _is_near(each.motion, start, length_m)]


def _is_near(motion: Motion, start: InitialState, length_m: FloatArray) -> bool:
    dx = motion.x_m - 0.5 * motion.length_m * np.cos(motion.heading_rad) - start.x_m
    dy = motion.y_m - 0.5 * motion.length_m * np.sin(motion.heading_rad) - start.y_m
    cos, sin = np.cos(start.heading_rad), np.sin(start.heading_rad)
    ahead, beside = dx * cos + dy * sin, np.abs(dy * cos - dx * sin)
    bodies = 0.5 * (motion.length_m + length_m)
    behind_mps = np.where(ahead > 0.0, start.speed_mps, motion.speed_mps)
    on_lane = (beside < _LANE_M) & (np.abs(ahead) - bodies < np.maximum(CLEAR_M, CLEAR_S * behind_mps))
    return bool((on_lane | (np.hypot(dx, dy) - bodies < CLEAR_AROUND_M)).any())


def clear_of_obstacles(departures: Iterable[Departure], obstacles: Box) -> list[Departure]:
    """The departures without vehicles of a warm-up that are on an obstacle, or would have to brake hard before it."""
    boxes = boxes_of(obstacles)
    return [
        each
        for each in departures
        if each.motion is None or all(box_distance(_way(each.motion), box) > 0.0 for box in boxes)
    ]


def _way(motion: Motion) -> Box:
    """The body of a vehicle and the room before it that it needs."""
    room_m = max(CLEAR_M, CLEAR_S * motion.speed_mps)
    ahead_m = 0.5 * (room_m - motion.length_m)  # a motion is that of the front bumper
    x_m, y_m = motion.x_m + ahead_m * np.cos(motion.heading_rad), motion.y_m + ahead_m * np.sin(motion.heading_rad)
    return Box(float(x_m), float(y_m), motion.heading_rad, motion.length_m + room_m, motion.width_m)
