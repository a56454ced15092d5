"""Adaptive cruise control: speed on a free road, behind a leader, and before a junction. Arrays are [N], of other road
users [N, K]."""

from __future__ import annotations

import numpy as np

from harness.config.rule_driver import Cruise
from harness.drivers.perception import Encounters, OwnMotion
from harness.game.arrays import BoolArray, FloatArray
from harness.game.road import AHEAD_M
from harness.game.traffic_rules import AMBER_MPS2, ROLLING_MPS

_SLOWING_S = 0.5  # time in which a speed above the target is corrected: a slower response would be late for curves
_BEFORE_LINE_M = 1.0  # place of the front bumper of a car that waits at a stop line
_THROUGH_M = 10.0  # length of the place where two ways meet, plus that of a car
_SPARE_S = 1.0  # time between the own car's leaving that place and the other's arrival


def in_path(encounters: Encounters, within_s: float) -> BoolArray:
    """[N, K] road users ahead that are in the own path, or that enter it within `within_s` at their lateral speed."""
    clearance_then_m = encounters.clearance_m - within_s * np.maximum(encounters.approach_mps, 0.0)
    return encounters.seen & (encounters.ahead_m > 0.0) & (clearance_then_m <= 0.0)


def time_gap_law_mps2(gap_m: FloatArray, speed_mps: FloatArray, other_mps: FloatArray, law: Cruise) -> FloatArray:
    """Acceleration that brings the gap to `standstill_m` plus `time_gap_s` of driving (constant time gap law; Rajamani,
    Vehicle Dynamics and Control, 2nd ed., equation 6.18):

        a = (v_other - v + lambda (gap - standstill - h v)) / h
    """
    error = gap_m - law.standstill_m - law.time_gap_s * speed_mps
    return (other_mps - speed_mps + law.gap_gain_per_s * error) / law.time_gap_s


def target_speed_mps(limit_mps: FloatArray, path_bend_per_m: FloatArray, law: Cruise) -> FloatArray:
    """[N] target speed for the limit and for the curves in sight. A curve is entered at sqrt(a_lateral / curvature);
    the car slows down for it with half of the strongest braking (v^2 = v_curve^2 + 2 b d)."""
    in_curve2 = law.max_lateral_mps2 / np.maximum(np.abs(path_bend_per_m), 1e-6)
    now2 = in_curve2 + 2.0 * (0.5 * law.max_braking_mps2) * AHEAD_M
    return np.minimum(law.speed_share * limit_mps, np.sqrt(now2.min(axis=1)))


def waiting_gap_m(motion: OwnMotion, encounters: Encounters, law: Cruise) -> FloatArray:
    """[N] distance to the place before which the car has to stop; inf without one.

    It stops on red, and on yellow if moderate braking is enough. It waits for a road user with priority that would
    arrive before the own car has driven through the place where the two ways meet.
    """
    moderate2 = 2.0 * AMBER_MPS2 * np.maximum(motion.stop_line_m, 0.0)
    stops = motion.signal_red & (
        motion.speed_mps**2 <= 2.0 * law.max_braking_mps2 * np.maximum(motion.stop_line_m, 0.0)
    )
    stops |= motion.signal_yellow & (motion.speed_mps**2 <= moderate2)
    at_line = np.where(stops, motion.stop_line_m, np.inf)
    through_m = np.maximum(encounters.own_to_conflict_m, 0.0) + _THROUGH_M
    speed = motion.speed_mps[:, None]
    # from s = v t + a t^2 / 2 with the greatest acceleration
    through_s = (np.sqrt(speed**2 + 2.0 * law.max_acceleration_mps2 * through_m) - speed) / law.max_acceleration_mps2
    waits = encounters.seen & encounters.has_priority & (encounters.own_to_conflict_m > 0.0)
    waits &= encounters.other_to_conflict_s < through_s + _SPARE_S
    return np.minimum(at_line, np.where(waits, encounters.own_to_conflict_m, np.inf).min(axis=1))


def cruise_mps2(
    motion: OwnMotion, encounters: Encounters, *, before_mps2: FloatArray, law: Cruise, step_s: float
) -> FloatArray:
    """[N] acceleration that the cruise control requests, given its request of the step before (`before_mps2`)."""
    target = target_speed_mps(motion.speed_limit_mps, motion.path_bend_per_m, law)
    rolling = np.sqrt(ROLLING_MPS**2 + law.max_braking_mps2 * np.maximum(motion.stop_line_m, 0.0))
    target = np.where(motion.stop_sign, np.minimum(target, rolling), target)
    over = target - motion.speed_mps
    free = over / np.where(over < 0.0, min(law.speed_response_s, _SLOWING_S), law.speed_response_s)
    own = np.broadcast_to(motion.speed_mps[:, None], encounters.gap_m.shape)
    behind = time_gap_law_mps2(encounters.gap_m, own, encounters.speed_mps, law)
    behind = np.where(in_path(encounters, law.anticipates_s), behind, np.inf).min(axis=1)
    waiting = waiting_gap_m(motion, encounters, law) + law.standstill_m - _BEFORE_LINE_M
    before_line = time_gap_law_mps2(waiting, motion.speed_mps, np.zeros_like(waiting), law)
    wanted = np.minimum(np.minimum(free, behind), before_line)
    wanted = np.clip(wanted, -law.max_braking_mps2, law.max_acceleration_mps2)
    change = law.max_jerk_mps3 * step_s
    return np.clip(wanted, before_mps2 - change, before_mps2 + change)
