"""The last part of a training, in which its actions become narrow."""

from __future__ import annotations

import pytest

from harness.config.training import Training
from harness.training.narrowing import Narrowing

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
