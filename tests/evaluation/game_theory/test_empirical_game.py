from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from harness.evaluation.game_theory import empirical_game as module
from harness.evaluation.game_theory.empirical_game import SolutionKind, dominated, equilibria, safest_mixture
from harness.evaluation.tables import table_of
from tests.support.game_tables import findings

NASH, SAFEST, LEFT_OUT = (kind.value for kind in (SolutionKind.NASH, SolutionKind.SAFEST, SolutionKind.NOT_PLAYED))


def played(cells, seed=1):
    """A cross-play of (ego, non_ego, persona, failure rate, ego payoff, non-ego payoff)."""
    names = ("ego", "non_ego", "persona", "failure_rate", "ego_payoff", "non_ego_payoff")
    rows = [dict(zip(names, cell, strict=True)) | {"seed": seed, "arm": f"{cell[0]}_vs_{cell[1]}"} for cell in cells]
    counts = {"games": 100, "left_out": 0}
    return table_of("crossplay", [row | counts for row in rows])


PENNIES = [
    ("naive", "speedy", "speedy", 0.4, 1, -1),
    ("naive", "speedy_round2", "speedy", 0.0, -1, 1),
    ("retrained", "speedy", "speedy", 0.0, -1, 1),
    ("retrained", "speedy_round2", "speedy", 0.2, 1, -1),
]


def rows(found, **wanted):
    for name, value in wanted.items():
        found = found[found[name] == value]
    return found.to_dict("records")


def test_nash__of_matching_pennies_is_half_and_half_with_its_payoffs_and_failures():
    found = equilibria(played(PENNIES))
    egos, non_egos = rows(found, solution=NASH, role="ego"), rows(found, solution=NASH, role="non_ego")
    assert [row["player"] for row in (*egos, *non_egos)] == ["naive", "retrained", "speedy", "speedy_round2"]
    assert [row["share"] for row in (*egos, *non_egos)] == pytest.approx([0.5] * 4)
    assert [row["payoff"] for row in (*egos, *non_egos)] == pytest.approx([0] * 4)
    # half of the naive ego's games against each: 0.4/2 and 0; of the retrained: 0 and 0.2/2
    assert [row["failure_rate"] for row in egos] == pytest.approx([0.2, 0.1])
    assert [row["failure_rate"] for row in non_egos] == pytest.approx([0.2, 0.1])
    for row in (*egos, *non_egos):
        assert (row["game"], row["number"]) == ("speedy", 1)
        assert row["regret"] == pytest.approx(0, abs=1e-9)
        assert row["solution_payoff"] == pytest.approx(0, abs=1e-9)
        assert row["solution_failure_rate"] == pytest.approx(0.15)
        assert row["dominated_in_payoff"] == ""


def test_safest__mixes_egos_against_every_non_ego_of_any_persona_or_none():
    cells = [("naive", "sumo", "", 0.02, 1, math.nan), ("retrained", "sumo", "", 0.01, 1, math.nan), *PENNIES]
    found = equilibria(played(cells))
    egos, non_egos = rows(found, game="all", role="ego"), rows(found, game="all", role="non_ego")
    assert [row["share"] for row in egos] == pytest.approx([1 / 3, 2 / 3], abs=1e-6)
    assert [row["failure_rate"] for row in egos] == pytest.approx([0.4, 0.2])  # the worst case of each alone
    assert [row["player"] for row in non_egos] == ["sumo", "speedy", "speedy_round2"]
    assert [row["failure_rate"] for row in non_egos] == pytest.approx([0.04 / 3, 0.4 / 3, 0.4 / 3], abs=1e-6)
    assert all(row["solution_failure_rate"] == pytest.approx(0.4 / 3, abs=1e-6) for row in (*egos, *non_egos))
    assert {row["solution"] for row in (*egos, *non_egos)} == {SAFEST}


def test_dominated__egos_are_named_in_failures_and_payoffs_against_all_and_against_a_persona():
    cells = [
        ("naive", "speedy", "speedy", 0.3, 1, 5),
        ("naive", "distracted", "distracted", 0.2, 5, 5),
        ("robust", "speedy", "speedy", 0.1, 2, 5),
        ("robust", "distracted", "distracted", 0.1, 4, 5),
    ]
    found = equilibria(played(cells))
    (naive, robust) = rows(found, game="all", role="ego")
    assert (naive["dominated_in_failures"], naive["dominated_in_payoff"]) == ("robust", "")
    assert (robust["dominated_in_failures"], robust["dominated_in_payoff"]) == ("", "")
    (naive,) = rows(found, game="speedy", player="naive")
    assert naive["dominated_in_payoff"] == "robust"
    (naive,) = rows(found, game="distracted", player="naive")
    assert (naive["dominated_in_payoff"], naive["dominated_in_failures"]) == ("", "robust")


def test_left_out__a_strategy_with_an_empty_cell_has_a_row_of_its_own():
    cells = [("adas", "speedy", "speedy", 0.9, -5, 9), *PENNIES]
    found = equilibria(played(cells))
    assert [row["player"] for row in rows(found, game="speedy", solution=LEFT_OUT)] == ["adas"]
    assert [row["share"] for row in rows(found, solution=NASH)] == pytest.approx([0.5] * 4)
    # a non-ego without any measured cell is left out itself, not the egos
    unmeasured = [(ego, "speedy_round3", "speedy", math.nan, math.nan, math.nan) for ego in ("naive", "retrained")]
    found = equilibria(played([*PENNIES, *unmeasured]))
    assert [row["player"] for row in rows(found, game="speedy", solution=LEFT_OUT)] == ["speedy_round3"]
    assert [row["share"] for row in rows(found, solution=NASH)] == pytest.approx([0.5] * 4)


def test_left_out__when_every_ego_lacks_a_cell_there_is_no_game():
    found = equilibria(played([PENNIES[0], PENNIES[3]]))
    assert set(found["solution"]) == {LEFT_OUT}
    assert len(rows(found, game="speedy")) == 4
    assert found["share"].isna().all()


def test_none_verified__has_rows_without_numbers(monkeypatch):
    monkeypatch.setattr(module, "solve", lambda *game: [])
    found = rows(equilibria(played(PENNIES)), game="speedy")
    assert [row["solution"] for row in found] == [SolutionKind.NOT_VERIFIED.value] * 4
    for row in found:
        assert pd.isna(row["number"])
        assert all(math.isnan(row[name]) for name in ("share", "payoff", "solution_payoff", "regret", "failure_rate"))


def test_seeds__are_separate_games():
    found = equilibria(pd.concat([played(PENNIES, seed=1), played(PENNIES[:1], seed=2)]))
    assert [row["share"] for row in rows(found, seed=2, solution=NASH)] == [1, 1]
    assert len(rows(found, seed=1, solution=NASH)) == 4


def test_equilibria__shares_of_each_solution_and_role_are_a_distribution():
    found = findings(seeds=(1, 2), games=30).equilibria
    found = found[found["share"].notna()]
    sums = found.groupby(["seed", "game", "solution", "number", "role"], dropna=False)["share"].sum()
    np.testing.assert_allclose(sums.to_numpy(), 1.0)


# --- dominated strategies, and the safest mixture ---

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
