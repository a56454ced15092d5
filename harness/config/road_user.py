"""The kinds of road user that a player may be, and the limits of each that a scene need not give."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from pydantic import Field

from harness.config.toml_reading import Document

Kind = Literal["car", "truck", "motorcycle", "bicycle", "e_scooter", "pedestrian"]
CYCLING = ("bicycle", "e_scooter")
"""The kinds that use lanes for bicycles."""

WALKER_LENGTH_M = WALKER_WIDTH_M = 0.5
WALKER_RUN_MPS = 4.0
"""Top speed of a walker."""
WALKING_MPS = 1.36
"""Comfortable speed of a walker: the mean of 288 people on crossings (Randles et al., SAE 2010-01-0070)."""


class Actuators(Document):
    """Limits of a player that its vehicle type in the route file does not have. The defaults depend on `kind`; those
    given here are a car's."""

    max_acceleration_mps2: float = Field(3.0, gt=0.0, le=15.0)
    """Acceleration at full throttle."""
    max_braking_mps2: float = Field(8.0, gt=0.0, le=15.0)
    """Deceleration at full brake."""
    max_steering_rad: float = Field(0.6, gt=0.0, le=1.2)
    """Road wheel angle at full lock."""
    max_steering_rate_radps: float = Field(0.8, gt=0.0, le=10.0)
    """Greatest rate of the road wheel angle."""
    wheelbase_m: float = Field(2.7, gt=0.5, le=12.0)
    """Distance between the axles."""
    max_lateral_mps2: float = Field(15.0, gt=0.0, le=15.0)
    """Lateral acceleration at the greatest lean of a two-wheeler. At the default, grip alone limits it."""
    throttle_lag_s: float = Field(0.5, ge=0.0, le=2.0)
    """Time constant with which the acceleration follows the throttle."""
    brake_lag_s: float = Field(0.2, ge=0.0, le=2.0)
    """Time constant with which the deceleration follows the brake."""
    steering_lag_s: float = Field(0.11, ge=0.0, le=2.0)
    """Time constant with which the road wheel angle follows the hands."""
    max_jerk_mps3: float = Field(12.65, gt=0.0, le=100.0)
    """Greatest change of the acceleration along the heading per second."""

    def with_defaults_of(self, kind: Kind) -> Actuators:
        """These limits; those that the document does not give are the kind's."""
        given = {name: getattr(self, name) for name in self.model_fields_set}
        return DEFAULTS[kind].model_copy(update=given)


_BICYCLE = Actuators(
    max_acceleration_mps2=1.2,
    max_braking_mps2=3.1,
    max_steering_rad=0.8,
    max_steering_rate_radps=0.6,
    wheelbase_m=1.05,
    max_lateral_mps2=3.6,
)
DEFAULTS: Mapping[str, Actuators] = {
    "car": Actuators(),
    "truck": Actuators(max_acceleration_mps2=1.3, max_braking_mps2=6.0, max_steering_rate_radps=0.5, wheelbase_m=4.5),
    "motorcycle": Actuators(
        max_acceleration_mps2=5.0, wheelbase_m=1.4, max_steering_rate_radps=2.0, max_lateral_mps2=6.9
    ),
    "bicycle": _BICYCLE,
    "e_scooter": _BICYCLE.model_copy(update={"wheelbase_m": 0.9}),
    "pedestrian": Actuators(
        max_acceleration_mps2=2.3,
        max_braking_mps2=2.3,
        max_steering_rad=1.2,
        max_steering_rate_radps=10.0,
        wheelbase_m=0.6,
        max_lateral_mps2=3.0,
        throttle_lag_s=0.0,
        brake_lag_s=0.0,
        steering_lag_s=0.0,
    ),
}
"""The limits of each kind.

Truck: SUMO 1.28's defaults of vClass `truck` for acceleration. Motorcycle: a lean of 35 degrees. Bicycle: braking at a
friction of 0.32 and a lean of 20 degrees (AASHTO, Guide for the Development of Bicycle Facilities, 2012); acceleration
is SUMO 1.28's default of vClass `bicycle`. Pedestrian: acceleration from a stand is 0.14 g on average, with a standard
deviation of 0.09 g (Randles et al., SAE 2010-01-0070): the limit is the sum of the two. The others are chosen here.
Steering rate of bicycles and e-scooters: at 5 m/s the rider leans from upright to the limit in about 0.25 s. With
2 rad/s, an exploring learner leaves its lane within 4 s, and no policy was learned.

Throttle: 0.5 s is usual for the lag of a car's acceleration (Rajamani, Vehicle Dynamics and Control, 2nd ed.,
chapter 6). Steering: 0.11 s is the neuromuscular lag of usual models of drivers (e.g. Chinese Journal of Mechanical
Engineering 33, 2020, article 61, table 1). Jerk: the careful and competent driver of UN R157 reaches 0.774 g within
0.6 s. The lag of the brake is chosen here. People on foot change their speed at once.
"""
