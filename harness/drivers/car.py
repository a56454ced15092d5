"""The car of a driver: its limits, and conversions between physical units and the scaled observation and actions."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from harness.errors import DriverError
from harness.game import bicycle
from harness.game.arrays import FloatArray
from harness.game.bicycle import ActuatorLimits
from harness.game.observation_layout import OWN, in_units
from harness.game.world import World

_LARGEST_MPS2, _LARGEST_RAD, _LARGEST_SCALED = 100.0, 2.0 * math.pi, 100.0
"""Requests beyond these are not those of a driver: tyres transmit about 10 m/s², and wheels turn by less than 1 rad.
Quantities are exchanged, or a unit is wrong. Scaled actions are -1 to 1, and a network without bounds may exceed
them."""


@dataclass(frozen=True, kw_only=True)
class Car:
    """One player's car. A driver is made for a car."""

    step_s: float
    """Time between two decisions."""
    length_m: float
    width_m: float
    actuators: ActuatorLimits
    """Of this car alone: its arrays are [1]."""

    @property
    def limits(self) -> dict[str, float]:
        """Limits of the car by name: accelerations, speed, steering, wheelbase, friction of the road."""
        values = self.actuators._asdict()
        return {name: float(np.asarray(value).reshape(-1)[0]) for name, value in values.items()}

    def physical(self, observation: FloatArray) -> FloatArray:
        """[N, SIZE] observation in the units that the names in `harness.game.observation_layout.LAYOUT` end with."""
        return in_units(observation, float(self.actuators.max_steering_rad[0]))

    def actions(self, acceleration_mps2: FloatArray, steering_rad: FloatArray, observation: FloatArray) -> FloatArray:
        """Actions [N, 2] that request an acceleration [N] and a steering angle [N] at the speed in `observation`
        [N, SIZE]. A request beyond the car's limits is clipped. Raises DriverError if a unit or a
        quantity must be wrong."""
        _check_plausible(acceleration_mps2, _LARGEST_MPS2, "an acceleration", "m/s²")
        _check_plausible(steering_rad, _LARGEST_RAD, "a road wheel angle", "rad")
        seen = self.physical(observation)
        speed, road_steering = seen[:, OWN.speed_mps, None], seen[:, OWN.road_steering_rad, None]
        requested, road = (acceleration_mps2[:, None], steering_rad[:, None]), road_steering
        return bicycle.actions(*requested, speed_mps=speed, road_steering_rad=road, actuators=self.actuators)[:, 0]

    def answered(self, answer: FloatArray, observation: FloatArray, *, si: bool) -> FloatArray:
        """Actions [N, 2] by the answer [N, 2] of a driver: accelerations and steering angles (`si`), or pedals and
        wheel, which are clipped to -1 to 1. Raises DriverError as `actions`."""
        if si:
            return self.actions(answer[:, 0], answer[:, 1], observation)
        _check_plausible(answer, _LARGEST_SCALED, "pedals or a wheel", "(-1 to 1 is possible)")
        return np.clip(answer, -1.0, 1.0)


def car_of(world: World, player: int) -> Car:
    arrays = {name: value for name, value in world.actuators._asdict().items() if name != "friction"}
    own = world.actuators._replace(**{name: value[player : player + 1] for name, value in arrays.items()})
    return Car(
        step_s=world.step_s,
        length_m=float(world.length_m[player]),
        width_m=float(world.width_m[player]),
        actuators=own,
    )


def _check_plausible(requested: FloatArray, largest: float, quantity: str, unit: str) -> None:
    """Raise DriverError if a request of a driver [N], of `quantity` in `unit`, is beyond ±`largest`."""
    worst = float(np.max(np.abs(requested), initial=0.0))
    if largest < worst < math.inf:
        what = f"it decided {quantity} of {worst:.4g} {unit}"
        raise DriverError(f"{what}, which is beyond ±{largest:.4g}: is the unit right?")
