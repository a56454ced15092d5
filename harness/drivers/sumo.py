"""SUMO as a driver: the car-following and lane-changing models of the player's vehicle type drive it."""

from __future__ import annotations

from harness.game.arrays import FloatArray, IntArray


class SumoDriver:
    """A law-abiding driver, as SUMO models one.

    >>> import harness
    >>> harness.Seat(harness.SumoDriver()).driver.takes_over
    False
    """

    takes_over = False

    def reset(self, games: IntArray) -> None:
        """Do nothing: SUMO holds the state."""

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """Never called. Raises RuntimeError."""
        raise RuntimeError("SUMO drives this player; it has no actions")
