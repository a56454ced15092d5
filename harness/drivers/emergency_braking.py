"""Danger and the braking it requires: emergency braking, and the reference drivers of UN R157.

Each function takes `Encounters` [N, K] and returns two arrays [N, K]: whether each road user is a danger, and the
braking (m/s^2) that it requires. Formulas are cited. Figures 6 and following of R157 are drawings without numbers.
"""

from __future__ import annotations

import numpy as np

from harness.config.rule_driver import CarefulAndCompetent, EmergencyBraking, FuzzySafety, Rss
from harness.drivers.perception import Encounters
from harness.game.arrays import BoolArray, FloatArray
from harness.game.bicycle import GRAVITY_MPS2

_MIN_CLOSING_MPS = 1e-6
_RELEASE_FACTOR = 2.0
"""Braking for a short time to collision ends when the time is longer than its threshold by this factor."""


def time_to_collision_s(gap_m: FloatArray, closing_mps: FloatArray) -> FloatArray:
    """[...] time until the gap closes at this closing speed; 0 where the gap is not positive, inf where it does not
    close."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        time = np.maximum(gap_m, 0.0) / closing_mps
    return np.where(closing_mps > _MIN_CLOSING_MPS, time, np.inf)


def emergency(
    encounters: Encounters, own_mps: FloatArray, braking: BoolArray, law: EmergencyBraking
) -> tuple[BoolArray, FloatArray]:
    """UN R152, 5.2.1: a warning, then full braking, for a road user ahead that will be in the path when the gap closes.
    `braking` [N, 1]: whether braking is under way."""
    time = time_to_collision_s(encounters.gap_m, own_mps - encounters.speed_mps)
    brakes = law.brakes_ttc_s * np.where(braking, _RELEASE_FACTOR, 1.0)
    warns = np.maximum(brakes, law.brakes_ttc_s + law.warns_before_s)
    in_path = encounters.clearance_m - np.minimum(time, warns) * np.maximum(encounters.approach_mps, 0.0) <= 0.0
    danger = _ahead(encounters) & (encounters.gap_m > 0.0) & in_path & (time <= warns)
    return danger, np.where(time <= brakes, law.braking_mps2, law.warning_braking_mps2)


def careful_and_competent(
    encounters: Encounters, own_mps: FloatArray, braking: BoolArray, law: CarefulAndCompetent
) -> tuple[BoolArray, FloatArray]:
    """UN R157, Annex 4, Appendix 3, 3.3: a cut-in is perceived when the centre of the car is farther from the centre of
    its lane than the wandering distance plus its lateral motion during the perception time. It is a danger if the time
    to collision is short. The braking is that of table 1. `braking` [N, 1]: whether braking is under way."""
    lanes_away = np.maximum(np.round(np.abs(encounters.offset_m) / law.lane_width_m), 1.0)
    moved = lanes_away * law.lane_width_m - np.abs(encounters.offset_m)
    cuts_in = (encounters.approach_mps > 0.0) & (moved > law.wander_m + law.perception_s * encounters.approach_mps)
    next_to = np.abs(encounters.offset_m) < 1.5 * law.lane_width_m
    time = time_to_collision_s(encounters.gap_m, own_mps - encounters.speed_mps)
    near = time <= law.ttc_s * np.where(braking, _RELEASE_FACTOR, 1.0)
    danger = _ahead(encounters) & ((next_to & cuts_in) | (encounters.clearance_m <= 0.0)) & near
    wrapped = np.abs(encounters.offset_m) <= law.wrapped_m
    return danger, GRAVITY_MPS2 * np.where(wrapped, law.wrapped_braking_g, law.full_braking_g)


def rss_gap_m(own_mps: FloatArray, other_mps: FloatArray, law: Rss) -> FloatArray:
    """[...] safe longitudinal distance (Shalev-Shwartz et al. 2017, definitions 1 and 2). Behind one that drives the
    same way, at least 0:

    v r + a r^2 / 2 + (v + r a)^2 / (2 b_min) - v_other^2 / (2 b_max)

    Before one that comes towards the own car (negative `other_mps`) both react and brake alike: the sum of the first
    three terms of both, with b_min for b_min,correct.
    """
    oncoming_mps = np.maximum(-other_mps, 0.0)
    ahead = np.maximum(_stopping_m(own_mps, law) - other_mps**2 / (2.0 * law.other_braking_mps2), 0.0)
    towards = _stopping_m(own_mps, law) + _stopping_m(oncoming_mps, law)
    return np.where(oncoming_mps > law.waiting_mps, towards, ahead)


def _stopping_m(speed_mps: FloatArray, law: Rss) -> FloatArray:
    """[...] way until a car stands that accelerates during the reaction time, and then brakes."""
    after = speed_mps + law.reaction_s * law.acceleration_mps2
    return 0.5 * (speed_mps + after) * law.reaction_s + after**2 / (2.0 * law.braking_mps2)


def rss_clearance_m(approach_mps: FloatArray, law: Rss) -> FloatArray:
    """[...] safe lateral distance (definition 6) from a road user with this lateral speed; the own car keeps its lane:

    mu + (2 v + r a) r / 2 + (v + r a)^2 / (2 a)
    """
    speed = np.maximum(approach_mps, 0.0)
    after = speed + law.reaction_s * law.lateral_mps2
    return law.lateral_margin_m + 0.5 * (speed + after) * law.reaction_s + after**2 / (2.0 * law.lateral_mps2)


def rss(encounters: Encounters, own_mps: FloatArray, law: Rss) -> tuple[BoolArray, FloatArray]:
    """A road user ahead is a danger if neither distance to it is safe (definitions 1, 2, 6 and 8). It requires full
    braking. The parameters, and the assumption that the own lane keeping adds no lateral motion, are those of Mattas
    et al. 2022 (Accident Analysis & Prevention 174, 106743).

    A road user that waits where it has to yield is none, up to the lateral margin: where ways cross, the distance is
    safe if the one without priority stops before the crossing (definition 17, case 1). That of a moving one is judged
    as on a road, since it may not obey.
    """
    near = encounters.gap_m < rss_gap_m(own_mps, encounters.speed_mps, law)
    beside = encounters.clearance_m < rss_clearance_m(encounters.approach_mps, law)
    waits = (encounters.yielding_mps < law.waiting_mps) & (encounters.clearance_m > law.lateral_margin_m)
    danger = _ahead(encounters) & near & beside & ~waits
    return danger, np.full(danger.shape, law.full_braking_g * GRAVITY_MPS2)


def proactive(gap_m: FloatArray, own_mps: FloatArray, other_mps: FloatArray, law: FuzzySafety) -> FloatArray:
    """[...] PFS (proactive fuzzy surrogate safety metric) in 0..1 (Mattas et al. 2020, Accident Analysis & Prevention
    148, 105794): 0 if comfortable braking stops the car behind a leader that brakes as hard as it can, 1 if the
    hardest braking does not.

    0 from v r + v^2 / (2 b_comfortable) - v_other^2 / (2 b_other) + 2 margin on;
    1 up to v r + v^2 / (2 b_hardest) - v_other^2 / (2 b_other) + margin; linear between. The way in which the other
    stops counts negative if it comes towards the own car.
    """
    way_of_other = other_mps * np.abs(other_mps) / (2.0 * law.other_braking_mps2)
    common = own_mps * law.reaction_s - way_of_other + law.margin_m
    safe = common + own_mps**2 / (2.0 * law.comfortable_mps2) + law.margin_m
    unsafe = common + own_mps**2 / (2.0 * law.hardest_mps2)
    return _share_of(gap_m, safe, unsafe)


def critical(
    gap_m: FloatArray, *, own_mps: FloatArray, own_mps2: FloatArray, other_mps: FloatArray, law: FuzzySafety
) -> FloatArray:
    """[...] CFS (critical fuzzy surrogate safety metric) in 0..1 (ibid.): 0 if comfortable braking avoids a leader
    that keeps its speed, 1 if the hardest braking does not.

    With the own acceleration a (no braking beyond b_comfortable counts) and v' = v + r a: 0 from
    r ((v + v') / 2 - v_other) + (v' - v_other)^2 / (2 b_comfortable) on, 1 up to the same with b_hardest. If the
    present braking gives v' < v_other: 1 within (v - v_other)^2 / (2 |a|), else 0.
    """
    acceleration = np.maximum(own_mps2, -law.comfortable_mps2)
    closing = own_mps - other_mps
    after = closing + law.reaction_s * acceleration
    meanwhile = 0.5 * law.reaction_s * (closing + after)
    squared = np.maximum(after, 0.0) ** 2
    safe, unsafe = (meanwhile + squared / (2.0 * braking) for braking in (law.comfortable_mps2, law.hardest_mps2))
    graded = _share_of(gap_m, safe, unsafe)
    slowed = gap_m < closing**2 / np.maximum(2.0 * np.abs(own_mps2), 1e-9)
    return np.where(closing <= 0.0, 0.0, np.where(after < 0.0, slowed.astype(float), graded))


def fuzzy(
    encounters: Encounters, own_mps: FloatArray, own_mps2: FloatArray, law: FuzzySafety
) -> tuple[BoolArray, FloatArray]:
    """The fuzzy safety model: a road user that is in the path, or enters it before the own car is past, requires
    braking by PFS (up to comfortable) and CFS (from comfortable to hardest)."""
    closing = own_mps - encounters.speed_mps
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        pass_s = (np.abs(encounters.ahead_m) + encounters.lengths_m) / closing
        enter_s = encounters.clearance_m / encounters.approach_mps
    enters = (encounters.approach_mps > 0.0) & (closing > 0.0) & (enter_s <= pass_s + law.lateral_margin_s)
    relevant = _ahead(encounters) & ((encounters.clearance_m <= 0.0) | enters)
    pfs = proactive(encounters.gap_m, own_mps=own_mps, other_mps=encounters.speed_mps, law=law)
    cfs = critical(encounters.gap_m, own_mps=own_mps, own_mps2=own_mps2, other_mps=encounters.speed_mps, law=law)
    graded = law.comfortable_mps2 + cfs * (law.hardest_mps2 - law.comfortable_mps2)
    braking = np.where(cfs > 0.0, graded, pfs * law.comfortable_mps2)
    return relevant & (braking > 0.0), np.minimum(braking, law.full_braking_g * GRAVITY_MPS2)


def _ahead(encounters: Encounters) -> BoolArray:
    return encounters.seen & (encounters.ahead_m > 0.0)


def _share_of(gap_m: FloatArray, safe_m: FloatArray, unsafe_m: FloatArray) -> FloatArray:
    """[...] 0 from `safe_m` on, 1 up to `unsafe_m`, linear between."""
    width = np.maximum(safe_m - unsafe_m, 1e-9)
    return np.where(gap_m > safe_m, 0.0, np.where(gap_m < unsafe_m, 1.0, np.clip((safe_m - gap_m) / width, 0.0, 1.0)))
