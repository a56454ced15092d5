from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from harness.evaluation.game_theory.dominance import dominated, safest_mixture

NAMES = ("naive", "retrained", "robust")

tables = st.tuples(st.integers(1, 5), st.integers(1, 4)).flatmap(
    lambda shape: arrays(np.float64, shape, elements=st.integers(0, 20).map(lambda count: count / 20))
)


def test_dominated__by_a_pure_strategy_is_named():
    assert dominated(np.array([[1.0, 2], [2, 3], [0, 9]]), NAMES) == ["retrained", "", ""]


def test_dominated__by_a_mixture_only():
    # half and half of the first two earns 2 everywhere, more than the third's 1.5; no pure one is better everywhere
    assert dominated(np.array([[4.0, 0], [0, 4], [1.5, 1.5]]), NAMES) == ["", "", "0.50 naive + 0.50 retrained"]


def test_dominated__a_mixture_that_is_only_as_good_does_not_dominate():
    assert dominated(np.array([[4.0, 0], [0, 4], [2, 2]]), NAMES) == ["", "", ""]


def test_dominated__equal_somewhere_is_not_strictly_better():
    assert dominated(np.array([[1.0, 2], [1, 3], [0, 2]]), NAMES) == ["", "", "retrained"]


@pytest.mark.parametrize("table", [np.full((3, 2), 5.0), np.array([[1.0, 2.0]])])
def test_dominated__no_strategy_of_a_constant_game(table):
    assert dominated(table, NAMES[: len(table)]) == [""] * len(table)


@settings(deadline=None, max_examples=60)
@given(tables)
def test_dominated__what_dominates_is_better_everywhere(table):
    names = [f"ego{place}" for place in range(len(table))]
    for strategy, by in enumerate(dominated(table, names)):
        for name in names:
            if (table[names.index(name)] > table[strategy]).all():
                assert by in names
        if by in names:
            assert (table[names.index(by)] > table[strategy]).all()


def test_safest_mixture__equalises_the_worst_cases():
    # against (speedy, distracted): a fails in 0.4, 0; b in 0, 0.2. x 0.4 = (1 - x) 0.2 at x = 1/3: worst 2/15
    shares = safest_mixture(np.array([[0.4, 0.0], [0.0, 0.2]]))
    assert shares == pytest.approx([1 / 3, 2 / 3], abs=1e-6)
    assert (shares @ [[0.4, 0.0], [0.0, 0.2]]).max() == pytest.approx(2 / 15, abs=1e-6)


def test_safest_mixture__one_that_is_best_everywhere_is_not_mixed():
    assert safest_mixture(np.array([[0.3, 0.2], [0.1, 0.0], [0.2, 0.1]])).tolist() == [0, 1, 0]


def test_safest_mixture__of_equal_worst_cases_the_lower_mean_is_taken():
    assert safest_mixture(np.array([[0.3, 0.3], [0.3, 0.1], [0.3, 0.2]])).tolist() == [0, 1, 0]


@settings(deadline=None, max_examples=100)
@given(tables)
def test_safest_mixture__is_no_worse_than_any_pure_ego(table):
    shares = safest_mixture(table)
    assert (shares >= 0).all()
    assert shares.sum() == pytest.approx(1)
    assert (shares @ table).max() <= table.max(axis=1).min() + 1e-9
