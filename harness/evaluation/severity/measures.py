"""How severe a recorded game is: the contact of the judged player, and how close it came without one."""

from __future__ import annotations

from functools import lru_cache, partial

import numpy as np

from harness.evaluation.column import MAYBE, TEXT
from harness.evaluation.metrics import Drive, finite, metric
from harness.evaluation.severity import closeness, contact
from harness.evaluation.severity import limits as at
from harness.evaluation.severity.closeness import bodies_of, headways, least_pet_s, least_share
from harness.evaluation.severity.impact import impact_of
from harness.game.arrays import FloatArray
from harness.game.bicycle import GRAVITY_MPS2
from harness.game.outcome import Outcome

CONTACT, RAIL, TIMEOUT = 300.0, 200.0, 100.0
"""What `severity` adds up from, in games with such an end."""
_MOST_MPS = 99.0
_CRIME = "commonroad-crime"
_SHELBY = f"Shelby 2011, Delta-V as a measure of traffic conflict severity ({_CRIME}: Delta-v)"
_MINDERHOUD = "Minderhoud and Bovy 2001, Extended time-to-collision measures for road traffic safety assessment"


@metric(
    "game",
    meaning="At a contact of the ego with a road user: length of the difference of the two velocities, |v - v_other|.",
    source="Brach and Brach 2011, Vehicle accident analysis and reconstruction methods: closing velocity",
)
def closing_speed_mps(drive: Drive) -> float | None:
    impact = impact_of(drive.game, drive.player)
    return impact.closing_mps if impact is not None else None


@metric(
    "game",
    meaning="Change of the ego's velocity in the contact, if both move on as one: closing_speed_mps * m_other / (m_ego "
    "+ m_other). An upper bound for a contact that scrapes. Masses are those of the vehicle classes; an obstacle does "
    "not move.",
    source=_SHELBY,
)
def ego_delta_v_mps(drive: Drive) -> float | None:
    impact = impact_of(drive.game, drive.player)
    return impact.own.delta_v_mps if impact is not None else None


@metric(
    "game",
    meaning="Change of the other's velocity: closing_speed_mps * m_ego / (m_ego + m_other).",
    source=_SHELBY,
)
def other_delta_v_mps(drive: Drive) -> float | None:
    impact = impact_of(drive.game, drive.player)
    return impact.other.delta_v_mps if impact is not None else None


@metric(
    "game",
    dtype=TEXT,
    meaning="The side of the ego's box that is hit, `front`, `left`, `rear` or `right`: the direction of the normal of "
    "the two surfaces that met, within 45 degrees.",
)
def impact_side(drive: Drive) -> str | None:
    impact = impact_of(drive.game, drive.player)
    return impact.own.side if impact is not None else None


# --- how close it came -----------------------------------------------------------------------------------------------


@lru_cache(maxsize=1)
def needed_mps2(drive: Drive) -> FloatArray:
    """[N] the braking that is needed in each step of the drive."""
    game, player = drive.game, drive.player
    friction = float(game.quantities.state.friction[0])
    most = min(float(game.world.actuators.max_braking_mps2[player]), friction * GRAVITY_MPS2)
    bodies, among = bodies_of(game, player)
    return contact.needed_braking_mps2(bodies.boxes, bodies.speed_mps, among, player, most, at.NEEDED_WITHIN_S)


@metric(
    "game",
    meaning="Least time headway (THW): gap from the ego's front to the road user ahead, along the ego's route, over "
    "the ego's speed. The road user overlaps the ego's width and heads less than 90 degrees off the ego's heading.",
    source=f"ISO 34502 and {_CRIME}: THW, with its lanes replaced by the width of the box",
)
def min_time_headway_s(drive: Drive) -> float | None:
    return finite(headways(drive.game, drive.player).time_s, np.min)


@metric(
    "game",
    meaning="Least post-encroachment time (PET): from when one of the ego and another road user has left a place until "
    "the other is there, where their headings differ by 30 degrees or more; measured up to "
    f"{at.LONGEST_PET_S:g} s, in steps of the scene.",
    source=f"Allen, Shin and Cooper 1978 ({_CRIME}: PET); angle and limit: FHWA-HRT-08-051",
)
def min_post_encroachment_time_s(drive: Drive) -> float | None:
    return finite(np.array([least_pet_s(drive.game, drive.player)]), np.min)


@metric(
    "game",
    meaning="Strongest braking that was needed at any moment: the least constant braking with which the ego's box "
    f"avoids a contact that is at most {at.NEEDED_WITHIN_S:g} s away, the others at constant velocity. The value is "
    "the most that the ego and the road can do, where no braking was enough. Against a road user that would hit the "
    "standing ego none is needed.",
    source=f"Jansson 2005, Collision avoidance theory ({_CRIME}: a_long,req), for boxes at any angle",
)
def needed_braking_mps2(drive: Drive) -> float | None:
    return finite(needed_mps2(drive), np.max)


@metric(
    "game",
    meaning="Strongest braking of the ego after braking was needed for the first time; empty if it never was.",
)
def used_braking_mps2(drive: Drive) -> float | None:
    since = np.flatnonzero(needed_mps2(drive) > 0.0)
    return max(0.0, float((-drive.acceleration_mps2)[since[0] :].max())) if len(since) else None


@metric(
    "game",
    meaning=f"Time exposed (TET): time at a time to collision of at most {at.CONFLICT_TTC_S:g} s.",
    source=f"{_MINDERHOUD} ({_CRIME}: TET)",
)
def time_exposed_ttc_s(drive: Drive) -> float:
    return float(np.count_nonzero(drive.of("time_to_collision_s") <= at.CONFLICT_TTC_S)) * drive.step_s


@metric(
    "game",
    meaning=f"Time integrated (TIT): the integral over that time of {at.CONFLICT_TTC_S:g} s minus the time to "
    "collision.",
    source=f"{_MINDERHOUD} ({_CRIME}: TIT)",
)
def time_integrated_ttc_s2(drive: Drive) -> float:
    ttc_s = drive.of("time_to_collision_s")
    return float((at.CONFLICT_TTC_S - ttc_s[ttc_s <= at.CONFLICT_TTC_S]).sum()) * drive.step_s


@metric(
    "game",
    meaning=f"Time at a time headway below {at.SHORT_HEADWAY_S:g} s.",
    source="UN Regulation No. 157, 5.2.3.3: the shortest time gap",
)
def time_headway_below_1_s(drive: Drive) -> float:
    return float(np.count_nonzero(headways(drive.game, drive.player).time_s < at.SHORT_HEADWAY_S)) * drive.step_s


@metric(
    "game",
    dtype=MAYBE,
    meaning="1 if the ego touched no road user and came too close by at least one of the next three criteria.",
)
def near_miss(drive: Drive) -> int:
    return int(any(_comes_too_close(each, drive) for each in closeness.CRITERIA))


def _comes_too_close(criterion: closeness.Criterion, drive: Drive) -> int:
    return int(drive.outcome is not Outcome.COLLISION and criterion.is_met(drive.game, drive.player))


for _criterion in closeness.CRITERIA:
    metric(
        "game",
        name=f"near_miss_{_criterion.name}",
        dtype=MAYBE,
        meaning=f"1 if the ego touched no road user and came as close as a {_criterion.bound}{_criterion.behind}.",
        source=_criterion.source,
    )(partial(_comes_too_close, _criterion))


@metric(
    "judged",
    meaning="Orders games, the worst with the greatest number. Contact with a road user: 300 plus the greater delta-v. "
    "Contact with a rail: 200 plus the speed. No goal in time: 100 plus closeness. Else closeness, from 0 to 100: 100 "
    "/ (1 + m), where m is the least of TTC, PET and headway, each over its limit of near_miss; so 50 and more is a "
    "near miss. Where the ego takes no part, the person that drives is judged.",
)
def severity(drive: Drive) -> float:
    if drive.outcome is Outcome.COLLISION:
        impact = impact_of(drive.game, drive.player)
        return CONTACT + min(impact.delta_v_mps if impact is not None else 0.0, _MOST_MPS)
    if drive.outcome is Outcome.RAIL:
        speeds_mps = drive.of("speed_mps")
        return RAIL + (min(float(speeds_mps[-1]), _MOST_MPS) if len(speeds_mps) else 0.0)
    timeout = TIMEOUT if drive.outcome is Outcome.TIMEOUT else 0.0
    return 100.0 / (1.0 + least_share(drive.game, drive.player)) + timeout
