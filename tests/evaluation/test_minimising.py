"""The smallest change of a failing start, on regions of failure that are known."""

from __future__ import annotations

import numpy as np

from harness.evaluation.minimising import MOST_GAMES, minimise
from harness.game.arrays import FloatArray

TOLERANCE = np.array([0.05, 0.05])


def test_minimise__finds_the_border_in_the_coordinate_that_matters() -> None:
    """The game fails while the first coordinate is below 3: the second one does not change."""

    def fails(start: FloatArray) -> bool:
        return bool(start[0] < 3.0)

    found = minimise(fails, np.array([0.0, 0.0]), np.array([8.0, 5.0]), TOLERANCE)
    assert fails(found.fails)
    assert not fails(found.passes)
    assert 2.95 <= found.fails[0] < 3.0 <= found.passes[0] <= 3.05
    assert abs(found.passes[1]) <= 0.05
    assert found.games < 40


def test_minimise__needs_both_where_both_matter() -> None:
    """The game fails while the sum is below 4, and while one coordinate is below 1."""

    def fails(start: FloatArray) -> bool:
        return bool(start.sum() < 4.0 or start.min() < 1.0)

    found = minimise(fails, np.array([0.0, 0.0]), np.array([4.0, 4.0]), TOLERANCE)
    assert fails(found.fails)
    assert not fails(found.passes)
    assert np.abs(found.passes - found.fails).max() <= 0.05


def test_minimise__ends_where_the_border_is_ragged() -> None:
    """Failures that lie scattered: there is no border, but neighbours of which one fails."""

    def fails(start: FloatArray) -> bool:
        return bool(np.sin(40.0 * start[0]) + np.cos(37.0 * start[1]) > -0.5)

    failing, passing = np.array([0.0, 0.0]), np.array([3.1, 2.3])
    assert fails(failing)
    found = minimise(fails, failing, passing, TOLERANCE)
    assert found.games < MOST_GAMES + 20
    assert np.abs(found.passes - found.fails).max() <= 0.05
