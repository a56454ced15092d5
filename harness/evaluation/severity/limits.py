"""The numbers behind the measures of severity, each with its source."""

from __future__ import annotations

import math
from collections.abc import Mapping

CONFLICT_TTC_S = 1.5
"""A time to collision up to this is a conflict. Surrogate Safety Assessment Model, its default (Gettman, Pu, Sayed and
Shelby 2008, FHWA-HRT-08-051); the same number in Van der Horst 1990, "A time-based analysis of road user behaviour"."""
CONFLICT_PET_S = 1.0
"""A post-encroachment time up to this is a conflict. Peesapati, Hunter and Rodgers 2013 ("Evaluation of
postencroachment time as surrogate for opposing left-turn crashes"): this threshold correlates best with crashes."""
CONFLICT_HEADWAY_S = 0.5
"""A time headway up to this is a conflict, unless the gap opens. Our own: half of the least time gap of UN Regulation
No. 157 (5.2.3.3)."""
SHORT_HEADWAY_S = 1.0
"""UN Regulation No. 157 (5.2.3.3): the shortest time gap at any speed, here as time headway."""
LONGEST_PET_S = 5.0
"""A longer time between two passages is no encounter: the default of the Surrogate Safety Assessment Model."""
CROSSING_RAD = math.radians(30.0)
"""Paths at a smaller angle do not cross: the Surrogate Safety Assessment Model calls such encounters rear-end."""
NEEDED_WITHIN_S = 4.0
"""Braking is needed for a contact that is at most this far away. Van der Horst and Hogema (1993), "Time-to-collision
and collision avoidance systems": 4 s separates drivers in danger from drivers in control."""
LEADER_TURNED_RAD = math.radians(90.0)
"""A road user that heads at a larger angle to the ego is not followed. Our own."""
_PERSON_KG = 70.0
_CAR_KG = 1500.0
MASS_KG: Mapping[str, float] = {
    "pedestrian": _PERSON_KG,
    "wheelchair": 2.0 * _PERSON_KG,
    "scooter": 10.0 + _PERSON_KG,
    "bicycle": 10.0 + _PERSON_KG,
    "moped": 80.0 + _PERSON_KG,
    "motorcycle": 200.0 + _PERSON_KG,
    "passenger": _CAR_KG,
    "delivery": 5000.0,
    "emergency": 5000.0,
    "truck": 4500.0,
    "trailer": 13_000.0,
    "bus": 12_000.0,
    "coach": 25_000.0,
    "tram": 37_900.0,
}
"""kg, by SUMO vehicle class; a class without an entry has the mass of a passenger car. Source: the default masses of
SUMO 1.28 ("Vehicle Type Parameter Defaults"), which are those of the bare vehicle. Two wheels have a rider in addition,
of the mass that SUMO gives a pedestrian. A wheelchair with its user: our own."""


def mass_kg(vehicle_class: str) -> float:
    return MASS_KG.get(vehicle_class, _CAR_KG)
