"""The car of a driver: its limits, and conversions between physical units and the scaled observation and actions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from harness.game import bicycle
from harness.game.arrays import FloatArray
from harness.game.bicycle import Actuators
from harness.game.observation_layout import LAYOUT, in_units
from harness.game.world import World

SPEED, _ROAD_STEERING = LAYOUT.index("speed_mps"), LAYOUT.index("road_steering_rad")


@dataclass(frozen=True, kw_only=True)
class Car:
    """One player's car. A driver is made for a car."""

    step_s: float
    """Time between two decisions."""
    length_m: float
    width_m: float
    actuators: Actuators
    """Of this car alone: its arrays are [1]."""

    @property
    def limits(self) -> dict[str, float]:
        """Limits of the car by name: accelerations, speed, steering, wheelbase, friction of the road."""
        values = self.actuators._asdict()
        return {name: float(np.asarray(value).reshape(-1)[0]) for name, value in values.items()}

    def physical(self, observation: FloatArray) -> FloatArray:
        """[N, SIZE] observation in the units that the names in `harness.game.observation.LAYOUT` end with."""
        return in_units(observation, float(self.actuators.max_steering_rad[0]))

    def actions(self, acceleration_mps2: FloatArray, steering_rad: FloatArray, observation: FloatArray) -> FloatArray:
        """Actions [N, 2] that request an acceleration [N] and a steering angle [N] at the speed in `observation`
        [N, SIZE]. A request beyond the car's limits is clipped."""
        seen = self.physical(observation)
        speed, road_steering = seen[:, SPEED, None], seen[:, _ROAD_STEERING, None]
        requested = (acceleration_mps2[:, None], steering_rad[:, None])
        return bicycle.actions(*requested, speed, road_steering, self.actuators)[:, 0]


def car_of(world: World, player: int) -> Car:
    """A player's car."""
    arrays = {name: value for name, value in world.actuators._asdict().items() if name != "friction"}
    own = world.actuators._replace(**{name: value[player : player + 1] for name, value in arrays.items()})
    return Car(
        step_s=world.step_s,
        length_m=float(world.length_m[player]),
        width_m=float(world.width_m[player]),
        actuators=own,
    )
