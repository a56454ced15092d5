from __future__ import annotations

import math

import pytest

from harness.evaluation.game_theory.crossplay import Pairing, crossplay
from harness.evaluation.game_theory.empirical_game import equilibria
from harness.evaluation.game_theory.held_out import with_held_out_rates
from tests.support.game_tables import arm, table


def solved(games, **payoffs):
    """The solutions of a game against one persona: by (ego, non-ego) whether the ego fails in each episode, and by the
    two, joined by "_vs_", the ego's payoff and the non-ego's in each episode."""
    names = {f"{ego}_vs_{non_ego}": (ego, non_ego) for ego, non_ego in games}
    arms = [arm(name, 1, games[cell], *payoffs.get(name, ()), persona="speedy") for name, cell in names.items()]
    pairings = [
        Pairing(arm=name, seed=1, ego=ego, non_ego=non_ego, persona="speedy") for name, (ego, non_ego) in names.items()
    ]
    episodes = table(*arms)
    return with_held_out_rates(equilibria(crossplay(pairings, episodes)), pairings, episodes)


def rates(found, game):
    """The failure rate of the first solution of a game, and the one that is held out."""
    row = found[found["game"] == game].iloc[0]
    return row["solution_failure_rate"], row["held_out_failure_rate"]


def failing(*episodes, games=10):
    return [int(episode in episodes) for episode in range(games)]


def test_safest__is_played_in_games_that_did_not_choose_it():
    # in all 10 games both egos fail once. Without game 0 the naive ego never does, and is chosen: it fails in game 0.
    # Without game 1 the robust ego is chosen, and fails in it. Otherwise the naive ego is, which does not: 2 of 10
    found = solved({("naive", "speedy"): failing(0), ("robust", "speedy"): failing(1)})
    assert rates(found, "all") == (0.1, pytest.approx(0.2))


def test_safest__is_the_worst_mean_over_non_egos_not_the_mean_of_the_worst():
    # one ego: 3 of 20 games and 2 of 20, whatever is chosen
    found = solved(
        {("naive", "speedy"): failing(0, 1, 2, games=20), ("naive", "speedy_round3"): failing(8, 9, games=20)}
    )
    assert rates(found, "all") == (0.15, pytest.approx(0.15))


def test_nash__is_computed_from_the_other_nine_folds():
    # the naive ego earns 10 in game 0 and 1 in the others, mean 1.9, and never fails; the robust ego earns 1.5 and
    # always fails. Without game 0 the naive ego's mean is 1: the robust ego plays game 0, and fails
    games = {("naive", "speedy"): failing(), ("robust", "speedy"): [1] * 10}
    payoffs = {"naive_vs_speedy": ([10.0, *[1.0] * 9],), "robust_vs_speedy": ([1.5] * 10,)}
    assert rates(solved(games, **payoffs), "speedy") == (0, pytest.approx(0.1))


# payoffs of a game in which both want to meet: 2 and 2, or 1 and 1, otherwise nothing
MEETING = {("naive", "speedy"): 2.0, ("naive", "speedy_round3"): 0.0, ("robust", "speedy"): 0.0}
MEETING |= {("robust", "speedy_round3"): 1.0}


def test_nash__only_the_equilibrium_to_choose_first_is_held_out():
    payoffs = {f"{ego}_vs_{other}": ([value] * 10, [value] * 10) for (ego, other), value in MEETING.items()}
    found = solved(dict.fromkeys(MEETING, failing(3)), **payoffs)
    found = found[found["solution"] == "nash"]
    assert set(found["number"]) == {1, 2, 3}
    assert found["held_out_failure_rate"].notna().tolist() == (found["number"] == 1).tolist()
    assert rates(found, "speedy") == (0.1, pytest.approx(0.1))


@pytest.mark.parametrize(
    "robust", [failing(1, games=9), [*failing(1, games=9), None]], ids=["no episode of a fold", "a game that errored"]
)
def test_held_out__is_empty_where_a_fold_lacks_a_cell(robust):
    found = solved({("naive", "speedy"): failing(0), ("robust", "speedy"): robust})
    for game in ("all", "speedy"):
        rate, held_out = rates(found, game)
        assert math.isfinite(rate)
        assert math.isnan(held_out)
