"""Fuzzy functions, compared with zero-order Sugeno inference by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.game.payoff import FuzzyFunction, FuzzySet

# speed over the limit as a share of it: legal up to 0, thrilling between 0.05 and 0.3, frightening beyond 0.5
LEGAL = FuzzySet(name="legal", inputs=(0.0, 0.1), memberships=(1.0, 0.0), value=0.0)
THRILLING = FuzzySet(name="thrilling", inputs=(0.0, 0.1, 0.3, 0.5), memberships=(0.0, 1.0, 1.0, 0.0), value=2.0)
FRIGHTENING = FuzzySet(name="frightening", inputs=(0.3, 0.5), memberships=(0.0, 1.0), value=-4.0)
SPEEDY = FuzzyFunction("speed_over_limit", (LEGAL, THRILLING, FRIGHTENING))


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (-0.3, 0.0),  # fully legal
        (0.025, 0.5),  # 0.75 legal, 0.25 thrilling: (0.75 * 0 + 0.25 * 2) / 1
        (0.2, 2.0),  # fully thrilling
        (0.35, 0.5),  # 0.75 thrilling, 0.25 frightening: 0.75 * 2 - 0.25 * 4
        (0.7, -4.0),  # fully frightening
    ],
)
def test_function__is_the_average_of_the_sets_weighted_by_membership(value: float, expected: float) -> None:
    assert SPEEDY(np.array([value])) == pytest.approx([expected])


def test_function__memberships_need_not_sum_to_1() -> None:
    # 0.8 of the one set (value 1) and 0.8 of the other (value 3): (0.8 + 2.4) / 1.6 = 2, not 3.2
    both = FuzzyFunction(
        "q",
        (
            FuzzySet(name="a", inputs=(0.0,), memberships=(0.8,), value=1.0),
            FuzzySet(name="b", inputs=(0.0,), memberships=(0.8,), value=3.0),
        ),
    )
    assert both(np.array([5.0])) == pytest.approx([2.0])


def test_function__is_0_where_the_input_belongs_to_no_set() -> None:
    hill = FuzzyFunction("q", (FuzzySet(name="hill", inputs=(1.0, 2.0, 3.0), memberships=(0.0, 1.0, 0.0), value=5.0),))
    assert hill(np.array([0.0, 0.5, 2.0, 3.0, 8.0])).tolist() == [0.0, 0.0, 5.0, 0.0, 0.0]


@given(st.floats(-2.0, 2.0))
def test_function__stays_between_the_least_and_the_greatest_value(value: float) -> None:
    assert -4.0 - 1e-9 <= SPEEDY(np.array([value]))[0] <= 2.0 + 1e-9
