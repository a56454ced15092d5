"""The columns of severity in `episodes.csv`: type, unit, meaning and source of each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from harness.evaluation.severity import thresholds as at


class Column(NamedTuple):
    """A column of a table."""

    dtype: str
    unit: str
    meaning: str
    """What it is, with its formula; empty cells: what it takes to be measured."""
    source: str
    """Where the definition comes from; empty: our own."""


_CRIME = "commonroad-crime"
_SHELBY = f"Shelby 2011, Delta-V as a measure of traffic conflict severity ({_CRIME}: Delta-v)"
_MINDERHOUD = "Minderhoud and Bovy 2001, Extended time-to-collision measures for road traffic safety assessment"

OF_SEVERITY: Mapping[str, Column] = {
    "closing_speed_mps": Column(
        "float64",
        "m/s",
        "At a contact of the ego with a road user: length of the difference of the two velocities, |v - v_other|.",
        "Brach and Brach 2011, Vehicle accident analysis and reconstruction methods: closing velocity",
    ),
    "ego_delta_v_mps": Column(
        "float64",
        "m/s",
        "Change of the ego's velocity in the contact, if both move on as one: closing_speed_mps * m_other / (m_ego + "
        "m_other). An upper bound for a contact that scrapes. Masses are those of the vehicle classes; an obstacle "
        "does not move.",
        _SHELBY,
    ),
    "other_delta_v_mps": Column(
        "float64",
        "m/s",
        "Change of the other's velocity: closing_speed_mps * m_ego / (m_ego + m_other).",
        _SHELBY,
    ),
    "impact_side": Column(
        "object",
        "",
        "The side of the ego's box that is hit, `front`, `left`, `rear` or `right`: the direction of the normal of the "
        "two surfaces that met, within 45 degrees.",
        "",
    ),
    "min_time_headway_s": Column(
        "float64",
        "s",
        "Least time headway (THW): gap from the ego's front to the road user ahead, along the ego's route, over the "
        "ego's speed. The road user overlaps the ego's width and heads less than 90 degrees off the route.",
        f"ISO 34502 and {_CRIME}: THW, with its lanes replaced by the width of the box",
    ),
    "min_post_encroachment_time_s": Column(
        "float64",
        "s",
        "Least post-encroachment time (PET): from when one of the ego and another road user has left a place until the "
        f"other is there, where their headings differ by 30 degrees or more; measured up to {at.LONGEST_PET_S:g} s, in "
        "steps of the scene.",
        f"Allen, Shin and Cooper 1978 ({_CRIME}: PET); angle and limit: FHWA-HRT-08-051",
    ),
    "needed_braking_mps2": Column(
        "float64",
        "m/s^2",
        "Strongest braking that was needed at any moment: the least constant braking with which the ego's box avoids a "
        f"contact that is at most {at.NEEDED_WITHIN_S:g} s away, the others at constant velocity. The value is the "
        "most that the ego and the road can do, where no braking was enough. Against a road user that would hit the "
        "standing ego none is needed.",
        f"Jansson 2005, Collision avoidance theory ({_CRIME}: a_long,req), for boxes at any angle",
    ),
    "used_braking_mps2": Column(
        "float64",
        "m/s^2",
        "Strongest braking of the ego after braking was needed for the first time; empty if it never was.",
        "",
    ),
    "time_exposed_ttc_s": Column(
        "float64",
        "s",
        f"Time exposed (TET): time at a time to collision of at most {at.CONFLICT_TTC_S:g} s.",
        f"{_MINDERHOUD} ({_CRIME}: TET)",
    ),
    "time_integrated_ttc_s2": Column(
        "float64",
        "s^2",
        f"Time integrated (TIT): the integral over that time of {at.CONFLICT_TTC_S:g} s minus the time to collision.",
        f"{_MINDERHOUD} ({_CRIME}: TIT)",
    ),
    "time_headway_below_1_s": Column(
        "float64",
        "s",
        f"Time at a time headway below {at.SHORT_HEADWAY_S:g} s.",
        "UN Regulation No. 157, 5.2.3.3: the shortest time gap",
    ),
    "near_miss": Column(
        "Int64",
        "",
        "1 if the ego touched no road user and came as close as one of: time to collision at most "
        f"{at.CONFLICT_TTC_S:g} s, PET at most {at.CONFLICT_PET_S:g} s, headway below {at.CONFLICT_HEADWAY_S:g} s.",
        "FHWA-HRT-08-051 (TTC); Peesapati, Hunter and Rodgers 2013 (PET); headway: our own",
    ),
    "severity": Column(
        "float64",
        "",
        "Orders games, the worst with the greatest number. Contact with a road user: 300 plus the greater delta-v. "
        "Contact with a rail: 200 plus the speed. No goal in time: 100 plus closeness. Else closeness, from 0 to 100: "
        "100 / (1 + m), where m is the least of TTC, PET and headway, each over its limit of near_miss; so 50 and more "
        "is a near miss. Where the ego takes no part, the person that drives is judged.",
        "",
    ),
}

SEVERITY_COLUMNS: Mapping[str, str] = {name: column.dtype for name, column in OF_SEVERITY.items()}
"""Each with its pandas dtype."""
