"""What players know of each other: where the others would be now if they had moved on as when they were last looked at.

People anticipate: during their reaction time they take others to keep their speed and heading (Treiber, Kesting and
Helbing, Delays, inaccuracies and anticipation in microscopic traffic models, Physica A 360, 2006, section 2.3).
Background traffic and obstacles are known as they are.
"""

from __future__ import annotations

from math import ceil
from typing import Any, TypeAlias

import numpy as np

from harness.game.arrays import FloatArray, IntArray
from harness.game.jit import compiled
from harness.game.state import Bodies, State

Perceived: TypeAlias = FloatArray
"""[4, G, P, B] x_m, y_m, heading_rad and speed_mps of the bodies as each player takes them to be."""

REMEMBERED_S = 6.4
"""What is older than this counts as this old."""


class Memory:
    """The last motion of the players of G games."""

    def __init__(self, games: int, players: int, step_s: float) -> None:
        self._motion = np.zeros((ceil(REMEMBERED_S / step_s), 4, games, players))
        self._now, self._step_s = 0, step_s

    def remember(self, state: State) -> None:
        """Add the motion of the players in this step."""
        self._now = (self._now + 1) % len(self._motion)
        self.begin(state)

    def begin(self, state: State) -> None:
        """Set the motion of this step, of games that begin."""
        self._motion[self._now] = state.x_m, state.y_m, state.heading_rad, state.speed_mps

    def perceived(self, bodies: Bodies, lags: IntArray, games: IntArray) -> Perceived:
        """The bodies of games [N] as players take them to be whose knowledge of each other is so many steps old,
        [N, P]."""
        return _perceived(tuple(bodies), self._motion, (lags, games), (self._now, self._step_s))


def as_they_are(bodies: Bodies, players: int) -> Perceived:
    """The bodies as `players` players without reaction time take them to be."""
    return _as_they_are(tuple(bodies), players)


@compiled
def _as_they_are(columns: tuple[Any, ...], players: int) -> FloatArray:
    bodies = Bodies(*columns)
    perceived = np.empty((4, bodies.present.shape[0], players, bodies.present.shape[1]))
    for g, p in np.ndindex(perceived.shape[1:3]):
        for b in range(bodies.present.shape[1]):
            perceived[0, g, p, b], perceived[1, g, p, b] = bodies.x_m[g, b], bodies.y_m[g, b]
            perceived[2, g, p, b], perceived[3, g, p, b] = bodies.heading_rad[g, b], bodies.speed_mps[g, b]
    return perceived


@compiled
def _perceived(
    columns: tuple[Any, ...], motion: FloatArray, whose: tuple[IntArray, IntArray], when: tuple[int, float]
) -> FloatArray:
    (lags, games), (now, step_s), players = whose, when, motion.shape[3]
    perceived = _as_they_are(columns, players)
    for g, p in np.ndindex(lags.shape):
        lag = min(lags[g, p], len(motion) - 1)
        if lag > 0:
            then = (now - lag) % len(motion)
            for b in range(players):
                if b != p:
                    x_m, y_m = motion[then, 0, games[g], b], motion[then, 1, games[g], b]
                    heading_rad, speed_mps = motion[then, 2, games[g], b], motion[then, 3, games[g], b]
                    moved_m = speed_mps * lag * step_s
                    perceived[0, g, p, b] = x_m + moved_m * np.cos(heading_rad)
                    perceived[1, g, p, b] = y_m + moved_m * np.sin(heading_rad)
                    perceived[2, g, p, b], perceived[3, g, p, b] = heading_rad, speed_mps
    return perceived
