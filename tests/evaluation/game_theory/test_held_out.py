"""Mixtures in games that did not choose them: five folds of the episodes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from harness.evaluation.game_theory.crossplay import Pairing, crossplay
from harness.evaluation.game_theory.empirical_game import SolutionKind, equilibria
from harness.evaluation.game_theory.held_out import FOLDS, with_held_out_rates
from tests.support.game_tables import arm, table

SAFEST, NASH = SolutionKind.SAFEST.value, SolutionKind.NASH.value
FOLD = [episode % FOLDS for episode in range(20)]


def solved(failed, payoffs=None):
    """The solutions of a cross-play: the ego's failures by (ego, non-ego), and both payoffs where they matter."""
    arms, pairings = [], []
    for ego, non_ego in failed:
        name = f"{ego}_vs_{non_ego}"
        sides = [[value] * len(FOLD) for value in (payoffs or {}).get((ego, non_ego), (0.0, 0.0))]
        arms.append(arm(name, 1, failed[ego, non_ego], *sides, persona="speedy"))
        pairings.append(Pairing(arm=name, seed=1, ego=ego, non_ego=non_ego, persona="speedy"))
    episodes = table(*arms)
    return with_held_out_rates(equilibria(crossplay(pairings, episodes)), pairings, episodes)


def rate_of(found, kind):
    rates = found.loc[found["solution"] == kind, ["solution_failure_rate", "held_out_failure_rate"]].drop_duplicates()
    ((in_sample, held_out),) = rates.to_numpy().tolist()
    return in_sample, held_out


def test_held_out__an_ego_chosen_for_its_luck_in_the_sample_does_worse_in_other_games():
    # naive fails in all games of folds 0 and 1, retrained in those of folds 2 and 3: 8 of 20 each. Without one of these
    # folds the ego that fails in it has 4 failures in 16 games, the other 8: the first is chosen, and fails in the fold
    failed = {
        ("naive", "speedy"): [int(fold in (0, 1)) for fold in FOLD],
        ("retrained", "speedy"): [int(fold in (2, 3)) for fold in FOLD],
    }
    assert rate_of(solved(failed), SAFEST) == (pytest.approx(0.4), pytest.approx(0.8))


def test_held_out__a_failure_that_every_fold_has_alike_is_as_frequent_in_all_of_them():
    failed = {
        ("naive", "speedy"): [int(episode < FOLDS) for episode in range(20)],
        ("retrained", "speedy"): [int(episode >= FOLDS) for episode in range(20)],
    }
    assert rate_of(solved(failed), SAFEST) == (pytest.approx(0.25), pytest.approx(0.25))


def test_held_out__of_an_equilibrium_is_its_shares_in_the_other_games():
    failed = {
        ("naive", "speedy"): [1] * 20,
        ("naive", "speedy_round2"): [0] * 20,
        ("retrained", "speedy"): [0] * 20,
        ("retrained", "speedy_round2"): [0] * 20,
    }
    pennies = {
        ("naive", "speedy"): (1.0, -1.0),
        ("naive", "speedy_round2"): (-1.0, 1.0),
        ("retrained", "speedy"): (-1.0, 1.0),
        ("retrained", "speedy_round2"): (1.0, -1.0),
    }
    assert rate_of(solved(failed, pennies), NASH) == (pytest.approx(0.25), pytest.approx(0.25))  # half and half


def test_held_out__a_fold_without_a_measured_game_leaves_it_unknown():
    failed = {("naive", "speedy"): [None if fold == 0 else 0 for fold in FOLD]}
    assert math.isnan(rate_of(solved(failed), SAFEST)[1])
    assert np.isnan(solved({("naive", "speedy"): [0] * 3})["held_out_failure_rate"]).all()
