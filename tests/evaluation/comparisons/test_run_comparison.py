"""Two runs compared game by game."""

from __future__ import annotations

import numpy as np
import pytest

from harness.evaluation.comparisons.run_comparison import ChangedGame, changed_games, differences_of, failure_rates
from harness.reports.comparison_page import BETTER, EQUAL, NOT_SHOWN, UNKNOWN, WORSE, compared_rows, headline
from harness.reports.differences import NO_RELEVANT_DIFFERENCE
from tests.support.game_tables import arm, table


def failing(count, speed=13.0):
    return table(arm("naive_vs_speedy", ego_failed=[1] * count + [0] * (100 - count), speed=speed))


def verdicts(before, after, same_scene=True):
    rows = compared_rows(differences_of(before, after, same_scene), 0.01)
    return {row.found.measure: row.verdict for row in rows}


@pytest.mark.parametrize(
    ("before", "after", "verdict"), [(30, 5, BETTER), (5, 30, WORSE), (30, 28, NOT_SHOWN), (30, 30, EQUAL)]
)
def test_failures__are_compared_in_pairs(before, after, verdict):
    assert verdicts(failing(before), failing(after))["failures"] == verdict


def test_failures__have_the_interval_of_the_difference_and_mcnemars_test_of_two_sides():
    row = next(each for each in compared_rows(differences_of(failing(30), failing(20), True), 0.01))
    found = row.found
    assert (found.measure, found.before.value, found.after.value, found.pairs) == ("failures", 0.3, 0.2, 100)
    # the 10 pairs that differ all fail before only
    assert found.p_value == pytest.approx(2 * 0.5**10)
    # mean -0.1 of 100 pairs, standard error 0.3015 / 10, t = 1.984
    assert found.mean == pytest.approx(-0.1)
    assert (row.difference, row.interval) == ("−10 points", "−16 points to −4 points")


def test_failures__without_the_same_scene_there_are_rates_and_no_test():
    (found,) = [each for each in differences_of(failing(30), failing(20), False) if each.measure == "failures"]
    assert (found.before.value, found.after.value, found.pairs) == (0.3, 0.2, 0)
    assert np.isnan(found.p_value)
    assert verdicts(failing(30), failing(20), same_scene=False)["failures"] == UNKNOWN


def test_harm__that_a_new_ego_leaves_to_others_is_worse():
    before, after = (failing(0).assign(person_failed=[1] * count + [0] * (100 - count)) for count in (2, 22))
    found = verdicts(before, after)
    assert found["failures of people without the ego"] == WORSE
    assert found["failures"] == EQUAL
    assert "failures of bystanders without the ego" not in found  # nobody was there


def test_speed__a_small_difference_is_not_relevant_however_certain():
    assert verdicts(failing(0), failing(0, speed=13.1))["average speed"] == NO_RELEVANT_DIFFERENCE


def test_headline__counts_what_is_better_and_worse():
    rows = compared_rows(differences_of(failing(30), failing(5), True), 0.01)
    assert headline(rows) == "Worse: 0 of 2 figures; better: 1."
    assert headline([]) == "The runs have no arm and seed in common."


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
