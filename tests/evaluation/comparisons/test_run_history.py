"""Runs in their order: rates, and the games that are fixed, new or came back."""

from __future__ import annotations

import pytest

from harness.evaluation.comparisons.run_history import ChangedGame, changed_games, failure_rates
from tests.support.game_tables import arm, table

ARM = "naive_vs_speedy"


def run(*failed, first_episode=0):
    return table(arm(ARM, ego_failed=failed, first_episode=first_episode))


def change(kind, episode):
    return ChangedGame(change=kind, arm=ARM, seed=1, episode=episode)


def test_rates__have_counts_and_the_exact_interval_without_games_that_errored():
    rates = failure_rates(table(arm(ARM, ego_failed=[1, 0, 0, None]), arm("naive_vs_sumo", ego_failed=[0] * 10)))
    first, second = rates[ARM, 1], rates["naive_vs_sumo", 1]
    assert (first.failures, first.games) == (1, 3)
    assert (second.failures, second.low) == (0, 0.0)
    assert second.high == pytest.approx(1 - 0.025 ** (1 / 10))  # Clopper-Pearson without a failure


def test_changes__a_failure_is_fixed_and_new_or_came_back():
    runs = [run(1, 1, 0, 0), run(0, 1, 0, 1), run(1, 0, 1, 1)]
    assert changed_games(runs, ["a"] * 3) == [
        [change("fixed", 0), change("new", 3)],
        [change("came back", 0), change("fixed", 1), change("new", 2)],
    ]


def test_changes__are_of_games_that_both_runs_have_with_the_same_starts():
    runs = [run(1, None, 0), run(0, 1, first_episode=0), run(0, 1)]
    assert changed_games(runs, ["a", "a", "b"]) == [[change("fixed", 0)], []]  # game 1 could not be played before


def test_changes__other_starts_between_are_no_part_of_the_history():
    runs = [run(1, 0), run(1, 1), run(0, 0), run(1, 1)]
    (_, second, third) = changed_games(runs, ["a", "b", "a", "a"])
    assert second == []
    assert third == [change("came back", 0), change("new", 1)]  # game 1 of the second run is another game
