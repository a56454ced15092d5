"""The car that a driver drives: what it can do, and what its driver may ask of it in metres, seconds and radians."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from harness.game.arrays import FloatArray
from harness.game.bicycle import Actuators, actions
from harness.game.observation import LAYOUT, in_units
from harness.game.quantities import World

SPEED = LAYOUT.index("speed_mps")


@dataclass(frozen=True)
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
        """What the car can do, by name: accelerations, speed, steering, wheelbase, friction of the road."""
        given = self.actuators._asdict()
        return {name: float(np.asarray(value).reshape(-1)[0]) for name, value in given.items()}

    def seen(self, observation: FloatArray) -> FloatArray:
        """[N, SIZE] what the driver sees, in the units that the names in `harness.game.observation.LAYOUT` say."""
        return in_units(observation, float(self.actuators.max_steering_rad[0]))

    def asked(self, acceleration_mps2: FloatArray, steering_rad: FloatArray, observation: FloatArray) -> FloatArray:
        """Actions [N, 2] that ask this of the car, [N] each, in games where the driver sees this [N, SIZE]."""
        speed = self.seen(observation)[:, SPEED, None]
        return actions(acceleration_mps2[:, None], steering_rad[:, None], speed, self.actuators)[:, 0]


def car_of(world: World, player: int) -> Car:
    """A player's car."""
    arrays = {name: value for name, value in world.actuators._asdict().items() if name != "friction"}
    own = world.actuators._replace(**{name: value[player : player + 1] for name, value in arrays.items()})
    return Car(world.step_s, float(world.length_m[player]), float(world.width_m[player]), own)
