"""The end of a training: early convergence, and actions that become narrow."""

from __future__ import annotations

import math

import numpy as np
import pytest

from harness.config.training import Training
from harness.training.early_stopping import LATEST, LEAST, MOST_FAILURES, Narrowing, failing_roads, has_converged

ZEROS, ONES = [0.0] * LATEST, [1.0] * LATEST
NO_GAME = -math.inf


@pytest.mark.parametrize(
    ("curve", "has"),
    [
        ([3.0] * LEAST, True),
        (list(range(LEAST)), False),
        (list(range(100)), False),
        ([1.0] * (LEAST - 1), False),
        ([-10.0, -6.0, -2.0, *[5.0] * LEAST], True),
        ([-100.0, *ZEROS, *[0.99] * LATEST], True),  # the latest mean is above the one before by 1 % of the span
        ([-100.0, *ZEROS, *[1.02] * LATEST], False),
        ([NO_GAME] * 40, False),
        ([NO_GAME] * LATEST + ONES, False),
        ([NO_GAME, *ONES, *ONES], True),
        ([*[NO_GAME] * 3, *map(float, range(20))], False),
    ],
)
def test_has_converged__when_the_curve_is_flat_over_the_latest_segments(curve: list[float], has: bool) -> None:
    assert has_converged(curve) == has


def test_has_converged__on_a_noisy_plateau_and_not_on_a_noisy_slope() -> None:
    noise = np.random.default_rng(1).normal(0.0, 0.3, 60)
    rise = np.concatenate((np.linspace(-20.0, 0.0, 20), np.zeros(40)))
    curve = (rise + noise).tolist()
    stopped = next(n for n in range(len(curve)) if has_converged(curve[:n]))
    assert 20 < stopped < 45


AT_THE_BOUND = round(MOST_FAILURES * 10)


@pytest.mark.parametrize(
    ("games", "failures", "fails"),
    [
        ([100] * LEAST, [100] * LEAST, True),
        ([100] * LEAST, [6] * LEAST, False),
        ([1, *[10] * LATEST], [1, *[AT_THE_BOUND] * LATEST], False),
        ([1, *[10] * LATEST], [0, *[AT_THE_BOUND] * (LATEST - 1), AT_THE_BOUND + 1], True),
        ([2, 100], [2, 10], False),  # segments count by their games
        ([], [], False),
        ([5, *[0] * LATEST], [5, *[0] * LATEST], False),  # without games alone nothing can be said
    ],
)
def test_failing_roads__by_the_share_of_the_latest_segments(games: list[int], failures: list[int], fails: bool) -> None:
    of_road = [[{"merge": count} for count in counts] for counts in (games, failures)]
    assert failing_roads(*of_road) == (["merge"] if fails else [])


def test_failing_roads__one_road_of_several_is_enough() -> None:
    games = [{"merge": 90, "roundabout": 10}] * LATEST
    failures = [{"roundabout": 9}] * LATEST
    assert failing_roads(games, failures) == ["roundabout"]


# --- the last part, in which actions become narrow --------------------------------------------------------------------

SETTINGS = Training(steps=100_000, initial_deviation=0.4, max_deviation=0.4, final_deviation=0.1)


@pytest.mark.parametrize(
    ("share", "converged_at", "start", "end", "bounds"),
    [
        # halfway: by a factor of two, then again
        (0.2, None, 80_000, 100_000, {0: 0.4, 80_000: 0.4, 90_000: 0.2, 100_000: 0.1, 120_000: 0.1}),
        (0.2, 30_000, 30_000, 50_000, {40_000: 0.2}),
        (0.0, None, 100_000, 100_000, {100_000: 0.4}),
    ],
)
def test_narrowing__ends_with_the_budget_or_follows_convergence(
    share: float, converged_at: int | None, start: int, end: int, bounds: dict[int, float]
) -> None:
    narrowing = Narrowing.of(SETTINGS.model_copy(update={"narrowing_share": share}), converged_at=converged_at)
    assert (narrowing.start, narrowing.end) == (start, end)
    assert {steps: narrowing.largest_deviation(steps) for steps in bounds} == pytest.approx(bounds)
