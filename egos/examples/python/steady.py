"""A driver as a Python package: it follows its lane and holds a speed."""

from __future__ import annotations

import numpy as np

from harness.drivers.car import Car
from harness.game.observation_layout import LAYOUT

SPEED, TURNED, LEFT = (LAYOUT.index(name) for name in ("speed_mps", "path_turned_rad@5m", "path_left_m"))


class Steady:
    """Drives `car` at `speed_mps`."""

    takes_over = True

    def __init__(self, car: Car, speed_mps: float = 10.0) -> None:
        self._car, self._speed_mps = car, speed_mps

    def reset(self, games: np.ndarray) -> None:
        """Do nothing: the driver has no state."""

    def decide(self, games: np.ndarray, observation: np.ndarray, noise: np.ndarray) -> np.ndarray:
        """Actions [N, 2] in games [N], from their observations [N, SIZE]."""
        values = self._car.physical(observation)  # in metres, seconds and radians
        speed = values[:, SPEED]
        steering_rad = 0.5 * values[:, TURNED] + 0.5 * np.arctan2(values[:, LEFT], 4.0 + speed)
        acceleration_mps2 = np.clip(self._speed_mps - speed, -3.0, 2.0)
        return self._car.actions(acceleration_mps2, steering_rad, observation)
