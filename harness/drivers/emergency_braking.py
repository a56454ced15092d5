"""When there is danger, and how hard to brake for it: emergency braking, and the reference drivers of UN R157.

Each function takes what is met [N, K] and gives, for each of the others, whether it is a danger, and the braking
(m/s^2) that it calls for. Formulas are cited; R157's own figures 6 and following are drawings without numbers.
"""

from __future__ import annotations

import numpy as np

from harness.config.rule_driver import CarefulAndCompetent, EmergencyBraking, FuzzySafety, Rss
from harness.drivers.perception import Encounters
from harness.game.arrays import BoolArray, FloatArray
from harness.game.bicycle import GRAVITY_MPS2

_STILL_MPS = 1e-6
_LETS_GO_AT = 2.0
"""Who brakes for a short time to collision goes on until it is so many times as long."""


def time_to_collision_s(gap_m: FloatArray, closing_mps: FloatArray) -> FloatArray:
    """[...] time until the gap is closed at this closing speed; 0 where there is none left, inf where nobody closes."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        time = np.maximum(gap_m, 0.0) / closing_mps
    return np.where(closing_mps > _STILL_MPS, time, np.inf)


def emergency(
    met: Encounters, own_mps: FloatArray, braking: BoolArray, law: EmergencyBraking
) -> tuple[BoolArray, FloatArray]:
    """UN R152, 5.2.1: first a warning, then all the braking there is, for who is ahead and will be in the way when the
    gap is closed. `braking`: where it has begun already."""
    time = time_to_collision_s(met.gap_m, own_mps - met.speed_mps)
    brakes = law.brakes_ttc_s * np.where(braking, _LETS_GO_AT, 1.0)
    warns = np.maximum(brakes, law.brakes_ttc_s + law.warns_before_s)
    meets = met.clearance_m - np.minimum(time, warns) * np.maximum(met.approach_mps, 0.0) <= 0.0
    danger = met.seen & (met.ahead_m > 0.0) & (met.gap_m > 0.0) & meets & (time <= warns)
    return danger, np.where(time <= brakes, law.braking_mps2, law.warning_braking_mps2)


def careful_and_competent(
    met: Encounters, own_mps: FloatArray, braking: BoolArray, law: CarefulAndCompetent
) -> tuple[BoolArray, FloatArray]:
    """UN R157, Annex 4, Appendix 3, 3.3: a car has visibly begun to cut in once its centre has left its lane's centre
    by the wandering distance and by what it does in the perception time; it is a danger if the time to collision is
    short. Brakes with table 1's values. `braking`: where it has begun already."""
    lanes_away = np.maximum(np.round(np.abs(met.offset_m) / law.lane_width_m), 1.0)
    moved = lanes_away * law.lane_width_m - np.abs(met.offset_m)
    cuts_in = (met.approach_mps > 0.0) & (moved > law.wander_m + law.perception_s * met.approach_mps)
    next_to = np.abs(met.offset_m) < 1.5 * law.lane_width_m
    time = time_to_collision_s(met.gap_m, own_mps - met.speed_mps)
    near = time <= law.ttc_s * np.where(braking, _LETS_GO_AT, 1.0)
    danger = met.seen & (met.ahead_m > 0.0) & ((next_to & cuts_in) | (met.clearance_m <= 0.0)) & near
    wrapped = np.abs(met.offset_m) <= law.wrapped_m
    return danger, GRAVITY_MPS2 * np.where(wrapped, law.wrapped_braking_g, law.full_braking_g)


def rss_gap_m(own_mps: FloatArray, other_mps: FloatArray, law: Rss) -> FloatArray:
    """[...] safe longitudinal distance (Shalev-Shwartz et al. 2017, definition 1):

    v r + a r^2 / 2 + (v + r a)^2 / (2 b_min) - v_other^2 / (2 b_max), at least 0
    """
    after = own_mps + law.reaction_s * law.acceleration_mps2
    own = 0.5 * (own_mps + after) * law.reaction_s + after**2 / (2.0 * law.braking_mps2)
    return np.maximum(own - other_mps**2 / (2.0 * law.other_braking_mps2), 0.0)


def rss_clearance_m(approach_mps: FloatArray, law: Rss) -> FloatArray:
    """[...] safe lateral distance (definition 6) from one who moves over at this speed, while one keeps to one's lane:

    mu + (2 v + r a) r / 2 + (v + r a)^2 / (2 a)
    """
    speed = np.maximum(approach_mps, 0.0)
    after = speed + law.reaction_s * law.lateral_mps2
    return law.lateral_margin_m + 0.5 * (speed + after) * law.reaction_s + after**2 / (2.0 * law.lateral_mps2)


def rss(met: Encounters, own_mps: FloatArray, law: Rss) -> tuple[BoolArray, FloatArray]:
    """Danger is where neither distance is safe (definitions 1, 6 and 8), to who is ahead; then all braking. Parameters,
    and that one's own lane keeping adds nothing, as in Mattas et al. 2022 (Accident Analysis & Prevention 174, 106743).
    """
    near = met.gap_m < rss_gap_m(own_mps, met.speed_mps, law)
    danger = met.seen & (met.ahead_m > 0.0) & near & (met.clearance_m < rss_clearance_m(met.approach_mps, law))
    return danger, np.full(danger.shape, law.full_braking_g * GRAVITY_MPS2)


def proactive(gap_m: FloatArray, own_mps: FloatArray, other_mps: FloatArray, law: FuzzySafety) -> FloatArray:
    """[...] PFS in 0..1 (Mattas et al. 2020, Accident Analysis & Prevention 148, 105794): how far one is from being
    able to stop behind who leads, should they brake as hard as they can.

    0 from v r + v^2 / (2 b_comfortable) - v_other^2 / (2 b_other) + 2 margin on;
    1 up to v r + v^2 / (2 b_hardest) - v_other^2 / (2 b_other) + margin; linear between.
    """
    common = own_mps * law.reaction_s - other_mps**2 / (2.0 * law.other_braking_mps2) + law.margin_m
    safe = common + own_mps**2 / (2.0 * law.comfortable_mps2) + law.margin_m
    unsafe = common + own_mps**2 / (2.0 * law.hardest_mps2)
    return _share_of(gap_m, safe, unsafe)


def critical(
    gap_m: FloatArray, own_mps: FloatArray, own_mps2: FloatArray, other_mps: FloatArray, law: FuzzySafety
) -> FloatArray:
    """[...] CFS in 0..1 (ibid.): how far one is from avoiding who leads, should they keep their speed.

    With the own acceleration a (no braking beyond b_comfortable counts) and v' = v + r a: 0 from
    r ((v + v') / 2 - v_other) + (v' - v_other)^2 / (2 b_comfortable) on, 1 up to the same with b_hardest; if one
    brakes already so that v' < v_other, 1 within (v - v_other)^2 / (2 |a|), else 0.
    """
    acceleration = np.maximum(own_mps2, -law.comfortable_mps2)
    closing = own_mps - other_mps
    after = closing + law.reaction_s * acceleration
    meanwhile = 0.5 * law.reaction_s * (closing + after)
    squared = np.maximum(after, 0.0) ** 2
    graded = _share_of(
        gap_m,
        meanwhile + squared / (2.0 * law.comfortable_mps2),
        meanwhile + squared / (2.0 * law.hardest_mps2),
    )
    slowed = gap_m < closing**2 / np.maximum(2.0 * np.abs(own_mps2), 1e-9)
    return np.where(closing <= 0.0, 0.0, np.where(after < 0.0, slowed.astype(float), graded))


def fuzzy(met: Encounters, own_mps: FloatArray, own_mps2: FloatArray, law: FuzzySafety) -> tuple[BoolArray, FloatArray]:
    """The fuzzy safety model: who is in the way, or comes into it before one is past, calls for as much braking as
    PFS (up to comfortable) and CFS (between comfortable and hardest) say."""
    closing = own_mps - met.speed_mps
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        past_s = (np.abs(met.ahead_m) + met.lengths_m) / closing
        comes_s = met.clearance_m / met.approach_mps
    comes = (met.approach_mps > 0.0) & (closing > 0.0) & (comes_s <= past_s + law.lateral_margin_s)
    relevant = met.seen & (met.ahead_m > 0.0) & ((met.clearance_m <= 0.0) | comes)
    pfs = proactive(met.gap_m, own_mps, met.speed_mps, law)
    cfs = critical(met.gap_m, own_mps, own_mps2, met.speed_mps, law)
    graded = law.comfortable_mps2 + cfs * (law.hardest_mps2 - law.comfortable_mps2)
    braking = np.where(cfs > 0.0, graded, pfs * law.comfortable_mps2)
    return relevant & (braking > 0.0), np.minimum(braking, law.full_braking_g * GRAVITY_MPS2)


def _share_of(gap_m: FloatArray, safe_m: FloatArray, unsafe_m: FloatArray) -> FloatArray:
    """[...] 0 from `safe_m` on, 1 up to `unsafe_m`, linear between."""
    width = np.maximum(safe_m - unsafe_m, 1e-9)
    return np.where(gap_m > safe_m, 0.0, np.where(gap_m < unsafe_m, 1.0, np.clip((safe_m - gap_m) / width, 0.0, 1.0)))
