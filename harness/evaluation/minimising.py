"""The smallest change of a failing start after which a game no longer fails, by bisection.

A start is a vector [D] of positions and speeds. The change goes from the failing start towards a start that does not
fail. It is first made as short as possible in this direction. Then each coordinate is set back to its failing value, as
long as the game still does not fail without this part of the change; what is left is bisected again.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from harness.game.arrays import FloatArray

MOST_GAMES = 200
"""After so many games no further round of setting coordinates back begins. One that has begun is ended."""


def minimise(
    fails: Callable[[FloatArray], bool], failing: FloatArray, passing: FloatArray, tolerance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The smallest change found from `failing` towards `passing`, in all coordinates within `tolerance` (all [D]):
    two neighbouring starts, one on each side of the failure.

    `fails` plays a start. Both ends are taken as played.
    """
    played = 0

    def plays_badly(start: FloatArray) -> bool:
        nonlocal played
        played += 1
        return fails(start)

    near_fail, near_pass = _bisected(plays_badly, failing, passing, tolerance)
    kept = True
    while kept and played < MOST_GAMES:
        kept = False
        for axis in np.argsort(-np.abs(near_pass - failing) / tolerance):
            if abs(near_pass[axis] - failing[axis]) <= tolerance[axis]:
                continue
            without = near_pass.copy()
            without[axis] = failing[axis]
            if (np.abs(without - failing) > tolerance).any() and not plays_badly(without):
                near_fail, near_pass = _bisected(plays_badly, failing, without, tolerance)
                kept = True
                break
    return near_fail, near_pass


def _bisected(
    fails: Callable[[FloatArray], bool], failing: FloatArray, passing: FloatArray, tolerance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The neighbouring starts on the line between two, closer to each other than `tolerance` in every coordinate."""
    while (np.abs(passing - failing) > tolerance).any():
        middle = 0.5 * (failing + passing)
        if fails(middle):
            failing = middle
        else:
            passing = middle
    return failing, passing
