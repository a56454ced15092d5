"""The protocol of every driver."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from harness.game.arrays import FloatArray, IntArray


@runtime_checkable
class Driver(Protocol):
    """Decides a player's actions in many games at once.

    A driver sees only `harness.game.observation`. It draws no random numbers of its own: randomness is passed to it as
    `noise`, which is drawn when the game is reset, so that a game can be replayed.

    >>> import numpy as np
    >>> class HalfThrottle:
    ...     takes_over = True
    ...     def reset(self, games): pass
    ...     def decide(self, games, observation, noise): return np.tile([0.5, 0.0], (len(games), 1))
    >>> driver: Driver = HalfThrottle()
    >>> driver.decide(np.arange(2), np.zeros((2, 98)), np.zeros((2, 2))).tolist()
    [[0.5, 0.0], [0.5, 0.0]]
    """

    takes_over: bool
    """False: SUMO's own models drive the player, and `decide` is never called."""

    def reset(self, games: IntArray) -> None:
        """Reset games [N]: discard their state."""

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """Actions [N, 2] in [-1, 1] (pedals, wheel: see `harness.game.bicycle.requests`) in games [N], from the
        player's observations [N, SIZE] and standard normal noise [N, 2]."""
        ...
