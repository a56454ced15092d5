from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from harness.evaluation.game_theory.empirical_game import dominated, safest_mixture

NAMES = ("naive", "retrained", "robust")

tables = st.tuples(st.integers(1, 5), st.integers(1, 4)).flatmap(
    lambda shape: arrays(np.float64, shape, elements=st.integers(0, 20).map(lambda count: count / 20))
)


@pytest.mark.parametrize(
    ("table", "by"),
    [
        ([[1, 2], [2, 3], [0, 9]], ["retrained", "", ""]),
        # half and half of the first two earns 2 everywhere, more than 1.5; no pure one is better everywhere
        ([[4, 0], [0, 4], [1.5, 1.5]], ["", "", "0.50 naive + 0.50 retrained"]),
        ([[4, 0], [0, 4], [2, 2]], ["", "", ""]),  # a mixture that is only as good
        ([[1, 2], [1, 3], [0, 2]], ["", "", "retrained"]),  # equal somewhere is not strictly better
        ([[5, 5], [5, 5], [5, 5]], ["", "", ""]),
        ([[1, 2]], [""]),
    ],
)
def test_dominated__by_what_is_better_everywhere(table, by):
    assert dominated(np.array(table, dtype=float), NAMES[: len(table)]) == by


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


@pytest.mark.parametrize(
    "table",
    [[[0.3, 0.2], [0.1, 0.0], [0.2, 0.1]], [[0.3, 0.3], [0.3, 0.1], [0.3, 0.2]]],
    ids=["the best everywhere", "the lower mean of equal worst cases"],
)
def test_safest_mixture__of_one_ego(table):
    assert safest_mixture(np.array(table)).tolist() == [0, 1, 0]


@settings(deadline=None, max_examples=100)
@given(tables)
def test_safest_mixture__is_no_worse_than_any_pure_ego(table):
    shares = safest_mixture(table)
    assert (shares >= 0).all()
    assert shares.sum() == pytest.approx(1)
    assert (shares @ table).max() <= table.max(axis=1).min() + 1e-9
