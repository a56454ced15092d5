"""Masses of road users by their SUMO vehicle class, for the change of velocity in a contact.

Source: the default masses of SUMO 1.28 ("Vehicle Type Parameter Defaults"), which are those of the bare vehicle. Two
wheels have a rider in addition, of the mass that SUMO gives a pedestrian.
"""

from __future__ import annotations

from collections.abc import Mapping

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
"""kg; a class without an entry has the mass of a passenger car. A wheelchair with its user: our own."""


def mass_kg(vehicle_class: str) -> float:
    """The mass of a road user of a class."""
    return MASS_KG.get(vehicle_class, _CAR_KG)
