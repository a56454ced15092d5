"""Lane keeping: the steering angle that brings a car onto its path and keeps it there. Arrays are [N]."""

from __future__ import annotations

import numpy as np

from harness.config.rule_driver import LaneKeeping
from harness.drivers.perception import OwnMotion
from harness.game.arrays import FloatArray


def steering_rad(motion: OwnMotion, *, law: LaneKeeping, wheelbase_m: float, step_s: float) -> FloatArray:
    """Steering angle to request (Stanley's law: Hoffmann et al. 2007, Autonomous Automobile Trajectory Tracking,
    with feedforward of the path's curvature, as the observation gives it):

        steering = atan(wheelbase curvature) + heading_gain turned + atan(offset_gain left / (v + softening))

    where `turned` is the direction of the path relative to that in which the middle of the car moves when it follows
    the path, and `left` is the distance of the path to the left of the front axle. In a bend a car on its path points
    outwards by the steady-state yaw of that paper, atan(tan(steering) / 2): without this term it would cut the bend.
    The angle and its rate are limited so that lateral acceleration and lateral jerk stay within UN R79.
    """
    steady_yaw = np.arctan(0.5 * np.tan(motion.road_steering_rad))
    turned, speed = motion.path_turned_rad[:, 0] - steady_yaw, motion.speed_mps
    left = motion.path_left_m + 0.5 * wheelbase_m * np.sin(turned)
    wanted = (
        motion.road_steering_rad
        + law.heading_gain * turned
        + np.arctan(law.offset_gain_per_s * left / (speed + law.softening_mps))
    )
    speed2 = np.maximum(speed, 0.5) ** 2
    largest = np.arctan(wheelbase_m * law.max_lateral_mps2 / speed2)
    rate = wheelbase_m * law.max_lateral_jerk_mps3 * step_s / speed2
    wanted = np.clip(wanted, -largest, largest)
    return np.clip(wanted, motion.steering_rad - rate, motion.steering_rad + rate)
