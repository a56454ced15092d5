"""A driver as a Python package: steers along its lane and holds a speed."""

from __future__ import annotations

import numpy as np

from harness.drivers.car import Car
from harness.game.observation import LAYOUT

SPEED, TURNED, LEFT = (LAYOUT.index(name) for name in ("speed_mps", "path_turned_rad@5m", "path_left_m"))


class Steady:
    """Drives `car` at `speed_mps`."""

    takes_over = True

    def __init__(self, car: Car, speed_mps: float = 10.0) -> None:
        self._car, self._speed_mps = car, speed_mps

    def reset(self, games: np.ndarray) -> None:
        """Nothing to forget."""

    def decide(self, games: np.ndarray, observation: np.ndarray, noise: np.ndarray) -> np.ndarray:
        """Actions [N, 2] in games [N] from what is seen in them [N, SIZE]."""
        seen = self._car.seen(observation)  # in metres, seconds and radians
        speed = seen[:, SPEED]
        steering_rad = 0.5 * seen[:, TURNED] + 0.5 * np.arctan2(seen[:, LEFT], 4.0 + speed)
        acceleration_mps2 = np.clip(self._speed_mps - speed, -3.0, 2.0)
        return self._car.asked(acceleration_mps2, steering_rad, observation)
