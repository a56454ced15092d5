"""SUMO as a driver: the player is left to the car-following and lane-changing models of its vehicle type."""

from __future__ import annotations

from harness.game.arrays import FloatArray, IntArray


class SumoDriver:
    """A law-abiding driver, as SUMO models one."""

    takes_over = False

    def reset(self, games: IntArray) -> None:
        """Nothing to forget: SUMO remembers."""

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """Never asked. Raises RuntimeError."""
        raise RuntimeError("SUMO drives this player; it has no actions")
