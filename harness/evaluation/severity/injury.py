"""How likely a contact of the ego injures somebody seriously (MAIS3+: at least one injury of AIS 3 or more).

The sources publish closing speeds at which the probability is 10 %; their curves are not at hand. The probability grows
with the closing speed. So it is at most 10 % below the points of all sources, at least 10 % above them, and not known
between the points of two sources. A probability is given as these two bounds.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from harness.evaluation.column import SHARE
from harness.evaluation.metrics import Drive, metric
from harness.evaluation.severity.impact import Hit, impact_of

_GIDAS = "Lubbe, Wu and Jeppsson 2022, Safe speeds (Traffic Safety Research, article 23823; GIDAS)"
_TARGET = "TARGET setting for high severity collisions (Traffic Safety Research, article 27552)"
_KMH_PER_MPS = 3.6
_CAR = "passenger"
RISK_AT_THE_POINTS = 0.1
"""The probability that the points stand for."""
POINTS_KMH: Mapping[str, tuple[float, float]] = {"pedestrian": (29.0, 34.0), "bicycle": (44.0, 49.0)} | {
    "motorcycle": (48.0, 49.0)
}
"""Closing speeds with the front of a passenger car, by SUMO's class of the road user that is not a car: the lowest and
the highest point of the two sources."""
CAR_POINTS_KMH: Mapping[str, tuple[float, float]] = {"front": (99.0, 112.0), "rear": (126.0, 126.0)} | dict.fromkeys(
    ("left", "right"), (73.0, 73.0)
)
"""Closing speeds with another passenger car, by the side of one's own car that is hit. Only the second source has the
rear and the near side. Each side counts as the near side, because somebody may sit there."""


class Risk(NamedTuple):
    low: float
    high: float


def risk_of(own: Hit, other: Hit, closing_mps: float) -> Risk | None:
    """The bounds for the road user that is more at risk in a contact; None without a published point: of other classes,
    of contacts of unprotected road users with a side or the rear of a car, or among themselves."""
    cars = [hit for hit in (own, other) if hit.vehicle_class == _CAR]
    if len(cars) == 2:
        risks = [_bounds(CAR_POINTS_KMH[hit.side], closing_mps) for hit in cars]
        return Risk(max(risk.low for risk in risks), max(risk.high for risk in risks))
    unprotected = [hit for hit in (own, other) if hit.vehicle_class in POINTS_KMH]
    if len(cars) == len(unprotected) == 1 and cars[0].side == "front":
        return _bounds(POINTS_KMH[unprotected[0].vehicle_class], closing_mps)
    return None


def _bounds(points_kmh: tuple[float, float], closing_mps: float) -> Risk:
    lowest_kmh, highest_kmh = points_kmh
    closing_kmh = closing_mps * _KMH_PER_MPS
    low = RISK_AT_THE_POINTS if closing_kmh >= highest_kmh else 0.0
    high = RISK_AT_THE_POINTS if closing_kmh <= lowest_kmh else 1.0
    return Risk(low, high)


def _risk_in(drive: Drive) -> Risk | None:
    impact = impact_of(drive.game, drive.player)
    return risk_of(impact.own, impact.other, impact.closing_mps) if impact is not None else None


@metric(
    "game",
    meaning="Lower bound of the probability that the contact of the ego injures seriously (MAIS3+) the pedestrian, "
    "cyclist or motorcyclist, or in the car of the two that is more at risk; by closing speed and, of cars, the side "
    f"that is hit: {RISK_AT_THE_POINTS:g} from the highest published closing speed for this probability on, else 0. "
    "Empty without a contact, and where nothing is published: for other vehicles, and where somebody unprotected meets "
    "a side or the rear of a car.",
    unit=SHARE,
    source=f"{_GIDAS}; {_TARGET}",
)
def mais3_risk_low(drive: Drive) -> float | None:
    risk = _risk_in(drive)
    return risk.low if risk is not None else None


@metric(
    "game",
    meaning="Upper bound of the same probability: "
    f"{RISK_AT_THE_POINTS:g} up to the lowest published closing speed for this probability, else 1.",
    unit=SHARE,
    source=f"{_GIDAS}; {_TARGET}",
)
def mais3_risk_high(drive: Drive) -> float | None:
    risk = _risk_in(drive)
    return risk.high if risk is not None else None
