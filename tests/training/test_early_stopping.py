"""The end of a training: early convergence, and actions that become narrow."""

from __future__ import annotations

import math

import numpy as np
import pytest

from harness.config.training import Training
from harness.training.early_stopping import (
    LATEST,
    LEAST,
    MOST_FAILURES,
    TOLERANCE,
    Narrowing,
    has_converged,
    still_fails,
)


def test_has_converged__a_flat_curve_has() -> None:
    assert has_converged([3.0] * LEAST)


def test_has_converged__a_rising_curve_has_not() -> None:
    assert not has_converged(list(range(LEAST)))
    assert not has_converged(list(range(100)))


@pytest.mark.parametrize("segments", range(LEAST))
def test_has_converged__never_before_the_least_number_of_segments(segments: int) -> None:
    assert not has_converged([1.0] * segments)


def test_has_converged__a_curve_with_a_plateau_has() -> None:
    assert has_converged([-10.0, -6.0, -2.0, *[5.0] * (2 * LATEST)])


def test_has_converged__by_no_more_than_the_tolerance_of_the_span() -> None:
    # span 100: the mean of the latest segments is above that of the segments before by just less, and just more, than 1
    assert pytest.approx(0.01) == TOLERANCE
    before = [-100.0, *[0.0] * LATEST]
    assert has_converged([*before, *[0.99] * LATEST])
    assert not has_converged([*before, *[1.02] * LATEST])


def test_has_converged__on_a_noisy_plateau_and_not_on_a_noisy_slope() -> None:
    noise = np.random.default_rng(1).normal(0.0, 0.3, 60)
    rise = np.concatenate((np.linspace(-20.0, 0.0, 20), np.zeros(40)))
    curve = (rise + noise).tolist()
    stopped = next(n for n in range(len(curve)) if has_converged(curve[:n]))
    assert 20 < stopped < 45


def test_has_converged__segments_without_a_finished_game_do_not_count() -> None:
    assert not has_converged([-math.inf] * 40)
    assert not has_converged([-math.inf] * LATEST + [1.0] * LATEST)
    assert has_converged([-math.inf, *[1.0] * LEAST])
    assert not has_converged([*[-math.inf] * 3, *map(float, range(20))])


# --- a flat curve of a player that can't drive ------------------------------------------------------------------------


def test_still_fails__a_player_that_fails_in_nearly_all_games_has_not_converged() -> None:
    """A roundabout's ego that failed in every game had a flat curve, and counted as converged."""
    assert still_fails([100] * LEAST, [100] * LEAST)
    assert not still_fails([100] * LEAST, [6] * LEAST)


def test_still_fails__by_the_share_of_the_latest_segments() -> None:
    games = [1, 1, 1, *[10] * LATEST]
    at_the_bound = round(MOST_FAILURES * 10)
    assert not still_fails(games, [1, 1, 1, *[at_the_bound] * LATEST])
    assert still_fails(games, [0, 0, 0, *[at_the_bound] * (LATEST - 1), at_the_bound + 1])


def test_still_fails__segments_count_by_their_games() -> None:
    assert not still_fails([2, 100], [2, 10])


def test_still_fails__without_games_alone_nothing_can_be_said() -> None:
    assert not still_fails([], [])
    assert not still_fails([0] * LEAST, [0] * LEAST)
    assert not still_fails([5, *[0] * LATEST], [5, *[0] * LATEST])


# --- the last part, in which actions become narrow --------------------------------------------------------------------

SETTINGS = Training(steps=100_000, initial_deviation=0.4, max_deviation=0.4, final_deviation=0.1, narrowing_share=0.2)


@pytest.mark.parametrize(("steps", "bound"), [(0, 0.4), (80_000, 0.4), (90_000, 0.2), (100_000, 0.1), (120_000, 0.1)])
def test_narrowing__ends_with_the_budget(steps: int, bound: float) -> None:
    narrowing = Narrowing.of(SETTINGS, converged_at=None)
    assert (narrowing.start, narrowing.end) == (80_000, 100_000)
    assert narrowing.largest_deviation(steps) == pytest.approx(bound)  # halfway: by a factor of two, then again


def test_narrowing__follows_convergence() -> None:
    narrowing = Narrowing.of(SETTINGS, converged_at=30_000)
    assert (narrowing.start, narrowing.end) == (30_000, 50_000)
    assert narrowing.largest_deviation(40_000) == pytest.approx(0.2)


def test_narrowing__of_no_share_is_none() -> None:
    narrowing = Narrowing.of(SETTINGS.model_copy(update={"narrowing_share": 0.0}), converged_at=None)
    assert narrowing.start == narrowing.end == 100_000
    assert narrowing.largest_deviation(100_000) == 0.4
