"""The smallest change of a failing start, on regions of failure that are known."""

from __future__ import annotations

from collections.abc import Callable
from unittest.mock import Mock

import numpy as np
import pytest

from harness.evaluation.minimising import MOST_GAMES, minimise
from harness.game.arrays import FloatArray

TOLERANCE = np.array([0.05, 0.05])


def small_sum(start: FloatArray) -> bool:
    """Both coordinates matter: the sum is below 4, or one coordinate below 1."""
    return bool(start.sum() < 4.0 or start.min() < 1.0)


def scattered(start: FloatArray) -> bool:
    """Failures lie scattered: there is no border, but neighbours of which one fails."""
    return bool(np.sin(40.0 * start[0]) + np.cos(37.0 * start[1]) > -0.5)


@pytest.mark.parametrize(("fails", "passing"), [(small_sum, [4.0, 4.0]), (scattered, [3.1, 2.3])])
def test_minimise__ends_with_neighbours_of_which_one_fails(
    fails: Callable[[FloatArray], bool], passing: list[float]
) -> None:
    fails = Mock(wraps=fails)
    near_fail, near_pass = minimise(fails, np.array([0.0, 0.0]), np.array(passing), TOLERANCE)
    assert fails.call_count < MOST_GAMES + 20
    assert fails(near_fail)
    assert not fails(near_pass)
    assert np.abs(near_pass - near_fail).max() <= 0.05


def test_minimise__finds_the_border_in_the_coordinate_that_matters() -> None:
    """The game fails while the first coordinate is below 3: the second one does not change."""

    fails = Mock(side_effect=lambda start: bool(start[0] < 3.0))
    near_fail, near_pass = minimise(fails, np.array([0.0, 0.0]), np.array([8.0, 5.0]), TOLERANCE)
    assert 2.95 <= near_fail[0] < 3.0 <= near_pass[0] <= 3.05
    assert abs(near_pass[1]) <= 0.05
    assert fails.call_count < 40
