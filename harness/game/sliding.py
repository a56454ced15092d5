"""Motion of a player on wheels that has crashed: it slides, braked by friction, in the direction in which it went.

At a rail it slides along the road, with the part of its speed in this direction. Its heading does not change.
"""

from __future__ import annotations

import numpy as np

from harness.game.arrays import BoolArray, FloatArray
from harness.game.bicycle import GRAVITY_MPS2
from harness.game.road import Routes
from harness.game.state import State


def slide(state: State, sliding: BoolArray, course_rad: FloatArray, step_s: float) -> None:
    """Move the players marked in `sliding` [G, P] by one step, in place: along courses [G, P], braked by friction."""
    grip_mps2 = state.friction[:, None] * GRAVITY_MPS2
    speed_mps = np.where(sliding, np.maximum(state.speed_mps - grip_mps2 * step_s, 0.0), state.speed_mps)
    moved_m = np.where(sliding, speed_mps * step_s, 0.0)
    state.x_m = state.x_m + moved_m * np.cos(course_rad)
    state.y_m = state.y_m + moved_m * np.sin(course_rad)
    state.acceleration_mps2 = np.where(sliding, (speed_mps - state.speed_mps) / step_s, state.acceleration_mps2)
    state.speed_mps = speed_mps


def along_rail(state: State, at_rail: BoolArray, course_rad: FloatArray, routes: Routes) -> FloatArray:
    """[G, P] courses on which the players marked in `at_rail` go along the road; of their speed, in place, the part in
    this direction is left. Courses of others are unchanged."""
    road_rad = routes.heading_rad[routes.rows(state.station_m)]
    turned_rad = course_rad - road_rad
    state.speed_mps = np.where(at_rail, state.speed_mps * np.abs(np.cos(turned_rad)), state.speed_mps)
    return np.where(at_rail, np.where(np.cos(turned_rad) >= 0.0, road_rad, road_rad + np.pi), course_rad)
