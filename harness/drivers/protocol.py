"""What every driver is."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from harness.game.arrays import FloatArray, IntArray


@runtime_checkable
class Driver(Protocol):
    """Decides a player's actions in many games at once.

    A driver sees only `harness.game.observation`, and draws no random numbers of its own: chance comes to it as
    `noise`, drawn when the game started, so that a game can be played again.
    """

    takes_over: bool
    """False: SUMO's own models drive the player, and `decide` is never asked."""

    def reset(self, games: IntArray) -> None:
        """Games [N] start anew: forget what was remembered of them."""

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """Actions [N, 2] in [-1, 1] (pedals, wheel: see `harness.game.bicycle.requests`) in games [N], from what
        the player sees [N, SIZE] and standard normal noise [N, 2]."""
        ...
