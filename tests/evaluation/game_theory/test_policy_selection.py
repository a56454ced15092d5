"""The choice of a policy after a round: by hand, and its properties."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some
from hypothesis.extra import numpy as arrays

from harness.evaluation.game_theory.policy_selection import CandidateGames, best_candidate, selection_rows
from harness.evaluation.tables import table_of
from harness.game.arrays import FloatArray

NAMES = ["naive", "retrained_anna", "retrained_anna_round4_answer"]


def games(*payoffs: list[float], failed: list[list[int]] | None = None, alone: int = 0) -> CandidateGames:
    """The games of candidates; the first `alone` episodes are without the opponent."""
    earned = np.array(payoffs, dtype=np.float64)
    fails = np.zeros(earned.shape, dtype=bool) if failed is None else np.array(failed, dtype=bool)
    return CandidateGames(payoffs=earned, failed=fails, alone=np.arange(earned.shape[1]) < alone)


def test_selection__agrees_with_the_arithmetic_on_paper() -> None:
    # means 4, 6 and 5; the retrained ego's differences from the answer are 1, 3, -1: mean 1, variance 4
    found = games([4, 4, 4], [6, 8, 4], [5, 5, 5], failed=[[1, 1, 1], [0, 0, 1], [0, 0, 0]], alone=1)
    rows = [{"seed": 1, "round": 4, **row} for row in selection_rows(NAMES, found)]
    naive, retrained, answer = table_of("selections", rows).to_dict("records")
    assert [row["payoff"] for row in (naive, retrained, answer)] == [4, 6, 5]
    assert [row["more_than_answer"] for row in (naive, retrained, answer)] == [-1, 1, 0]
    half = 4.302653 * 2 / np.sqrt(3)  # 97.5 % quantile of t with 2 degrees of freedom
    assert retrained["more_than_answer_low"] == pytest.approx(1 - half, abs=1e-5)
    assert retrained["more_than_answer_high"] == pytest.approx(1 + half, abs=1e-5)
    assert [row["chosen"] for row in (naive, retrained, answer)] == [False, True, False]
    assert retrained["failure_rate"] == pytest.approx(1 / 3)
    assert (answer["episodes"], answer["alone"], answer["left_out"]) == (3, 1, 0)


def test_selection__a_better_answer_is_taken_although_it_fails_more_often() -> None:
    """The payoff decides: it is what the player maximises."""
    assert best_candidate(games([1, 1], [2, 2], [3, 3], failed=[[0, 0], [0, 0], [1, 1]])) == 2


def test_selection__of_equal_ones_the_oldest_goes_on() -> None:
    assert best_candidate(games([1, 3], [2, 2], [3, 1])) == 0
    assert best_candidate(games([0, 3], [2, 2], [3, 1])) == 1


def test_selection__a_game_that_one_could_not_play_counts_for_none() -> None:
    # in the episode that is left out the answer would have won: 100 against 1
    found = games([1, 5, 5], [float("nan"), 4, 4], [100, 4, 3])
    rows = selection_rows(NAMES, found)
    assert [row["payoff"] for row in rows] == [5, 4, 3.5]
    assert {(row["episodes"], row["left_out"]) for row in rows} == {(2, 1)}
    assert rows[0]["chosen"]
    with pytest.raises(ValueError, match="no episode"):
        best_candidate(games([float("nan"), 1], [1, float("nan")]))


@given(
    arrays.arrays(np.float64, some.tuples(some.integers(2, 5), some.integers(1, 8)), elements=some.integers(-20, 20)),
    some.integers(0, 3),
)
def test_selection__is_never_worse_than_any_candidate_and_the_unit_does_not_matter(
    payoffs: FloatArray, power: int
) -> None:
    found = CandidateGames(
        payoffs=payoffs, failed=np.zeros(payoffs.shape, dtype=bool), alone=np.zeros(payoffs.shape[1], dtype=bool)
    )
    means = payoffs.mean(axis=1)
    best = best_candidate(found)
    assert means[best] == means.max()
    assert not (means[:best] == means.max()).any()
    doubled = CandidateGames(payoffs=payoffs * 2.0**power, failed=found.failed, alone=found.alone)
    assert best_candidate(doubled) == best
