"""The protocol of every driver."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, cast, runtime_checkable

from harness.game.arrays import FloatArray, IntArray
from harness.game.cartesian_view import CartesianView


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


class Planner(Driver, Protocol):
    """A driver that gets, beside its observation, the road and what it sees in Cartesian coordinates."""

    history_s: float
    """The length of the history in its views."""

    def see(self, games: IntArray, views: Sequence[CartesianView]) -> None:
        """The views [N] for the next decision, which is in games [N]."""


def planner_of(driver: Driver | None) -> Planner | None:
    """The planner that a driver is, or that it holds as `wrapped`; None if there is none."""
    within = driver
    # in every step: isinstance of a protocol takes 40 microseconds
    while within is not None and not (hasattr(within, "see") and hasattr(within, "history_s")):
        within = getattr(within, "wrapped", None)
    return cast(Planner | None, within)
