"""The kinds of road users and things that other programs distinguish."""

from __future__ import annotations

from dataclasses import dataclass

VEHICLE, PERSON, THING = "vehicle", "person", "thing"


@dataclass(frozen=True, kw_only=True)
class ExportedKind:
    """A kind of road user or thing. Traces have no heights and masses: those of a kind are typical ones."""

    word: str
    group: str
    """VEHICLE, PERSON or THING."""
    height_m: float
    mass_kg: float
    two_wheeled: bool = False


CAR = ExportedKind(word="car", group=VEHICLE, height_m=1.5, mass_kg=1500.0)
VAN = ExportedKind(word="van", group=VEHICLE, height_m=2.5, mass_kg=3000.0)
TRUCK = ExportedKind(word="truck", group=VEHICLE, height_m=3.5, mass_kg=12000.0)
BUS = ExportedKind(word="bus", group=VEHICLE, height_m=3.2, mass_kg=12000.0)
TRAM = ExportedKind(word="tram", group=VEHICLE, height_m=3.5, mass_kg=30000.0)
MOTORBIKE = ExportedKind(word="motorbike", group=VEHICLE, height_m=1.5, mass_kg=250.0, two_wheeled=True)
BICYCLE = ExportedKind(word="bicycle", group=VEHICLE, height_m=1.7, mass_kg=90.0, two_wheeled=True)
PEDESTRIAN = ExportedKind(word="pedestrian", group=PERSON, height_m=1.75, mass_kg=75.0)
OBSTACLE = ExportedKind(word="obstacle", group=THING, height_m=1.0, mass_kg=100.0)
BUILDING = ExportedKind(word="building", group=THING, height_m=6.0, mass_kg=100000.0)

_BY_SHAPE = {
    "": OBSTACLE,
    "bicycle": BICYCLE,
    "bus": BUS,
    "delivery": VAN,
    "emergency": VAN,
    "firebrigade": TRUCK,
    "moped": MOTORBIKE,
    "motorcycle": MOTORBIKE,
    "pedestrian": PEDESTRIAN,
    "rail": TRAM,
    "scooter": MOTORBIKE,
    "truck": TRUCK,
    "wheelchair": PEDESTRIAN,
}


def kind_of_shape(shape: str) -> ExportedKind:
    """The kind of a body by SUMO's `guiShape`; empty stands for an obstacle that is no vehicle."""
    return _BY_SHAPE.get(shape.partition("/")[0], CAR)
