"""Adaptive cruise control: how fast to go on the way ahead, and behind whoever leads. Arrays are [N], others [N, K]."""

from __future__ import annotations

import numpy as np

from harness.config.rule_driver import Cruise
from harness.drivers.perception import Encounters, OwnMotion
from harness.game.arrays import BoolArray, FloatArray
from harness.game.observation import AHEAD_M


def in_way(encounters: Encounters, within_s: float) -> BoolArray:
    """Who is ahead, and in one's way or about to come into it within a time at their speed across the road."""
    comes = encounters.clearance_m - within_s * np.maximum(encounters.approach_mps, 0.0)
    return encounters.seen & (encounters.ahead_m > 0.0) & (comes <= 0.0)


def time_gap_law_mps2(gap_m: FloatArray, speed_mps: FloatArray, other_mps: FloatArray, law: Cruise) -> FloatArray:
    """Acceleration that brings the gap to `standstill_m` plus `time_gap_s` of driving (constant time gap law; Rajamani,
    Vehicle Dynamics and Control, 2nd ed., equation 6.18):

        a = (v_other - v + lambda (gap - standstill - h v)) / h
    """
    error = gap_m - law.standstill_m - law.time_gap_s * speed_mps
    return (other_mps - speed_mps + law.gap_gain_per_s * error) / law.time_gap_s


def speed_aimed_at_mps(limit_mps: FloatArray, path_turned_rad: FloatArray, law: Cruise) -> FloatArray:
    """Speed for the limit and for the curves in sight: each is entered at sqrt(a_lateral / curvature), and slowed for
    at half of the strongest braking (v^2 = v_curve^2 + 2 b d)."""
    curvature = np.abs(np.diff(path_turned_rad, axis=1)) / np.diff(AHEAD_M)
    in_curve2 = law.max_lateral_mps2 / np.maximum(curvature, 1e-6)
    now2 = in_curve2 + 2.0 * (0.5 * law.max_braking_mps2) * AHEAD_M[:-1]
    return np.minimum(law.speed_share * limit_mps, np.sqrt(now2.min(axis=1)))


def cruise_mps2(
    view: OwnMotion, encounters: Encounters, limit_mps: FloatArray, before_mps2: FloatArray, law: Cruise, step_s: float
) -> FloatArray:
    """Acceleration that the cruise control asks for, after what it asked for a step before."""
    aimed = speed_aimed_at_mps(limit_mps, view.path_turned_rad, law)
    free = (aimed - view.speed_mps) / law.speed_response_s
    own = np.broadcast_to(view.speed_mps[:, None], encounters.gap_m.shape)
    behind = time_gap_law_mps2(encounters.gap_m, own, encounters.speed_mps, law)
    behind = np.where(in_way(encounters, law.anticipates_s), behind, np.inf).min(axis=1)
    wanted = np.clip(np.minimum(free, behind), -law.max_braking_mps2, law.max_acceleration_mps2)
    change = law.max_jerk_mps3 * step_s
    return np.clip(wanted, before_mps2 - change, before_mps2 + change)
