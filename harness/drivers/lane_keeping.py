"""Lane keeping: the wheel that brings a car onto its path and keeps it there. Arrays are [N]."""

from __future__ import annotations

import numpy as np

from harness.config.rule_driver import LaneKeeping
from harness.drivers.perception import OwnMotion
from harness.game.arrays import FloatArray
from harness.game.observation import AHEAD_M


def steering_rad(view: OwnMotion, law: LaneKeeping, wheelbase_m: float, step_s: float) -> FloatArray:
    """Steering angle to ask for (Stanley's law: Hoffmann et al. 2007, Autonomous Automobile Trajectory Tracking,
    with the path's curvature fed forward):

        steering = atan(wheelbase curvature) + heading_gain turned + atan(offset_gain left / (v + softening))

    where `left` is how far to the left of the front axle the path is, kept to the lateral acceleration and jerk that
    UN R79 allows.
    """
    turned, speed = view.path_turned_rad[:, 0], view.speed_mps
    left = view.path_left_m + 0.5 * wheelbase_m * np.sin(turned)
    curvature = (view.path_turned_rad[:, 1] - turned) / (AHEAD_M[1] - AHEAD_M[0])
    wanted = (
        np.arctan(wheelbase_m * curvature)
        + law.heading_gain * turned
        + np.arctan(law.offset_gain_per_s * left / (speed + law.softening_mps))
    )
    speed2 = np.maximum(speed, 0.5) ** 2
    most = np.arctan(wheelbase_m * law.max_lateral_mps2 / speed2)
    rate = wheelbase_m * law.max_lateral_jerk_mps3 * step_s / speed2
    wanted = np.clip(wanted, -most, most)
    return np.clip(wanted, view.steering_rad - rate, view.steering_rad + rate)
