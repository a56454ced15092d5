from __future__ import annotations

import math

import pytest

from harness.evaluation.columns import TABLES
from harness.evaluation.game_theory.crossplay import Pairing, crossplay
from tests.support.game_tables import arm, table

NAIVE = Pairing(arm="naive_vs_speedy", seed=1, ego="naive", non_ego="speedy", persona="speedy")
RETRAINED = Pairing(arm="retrained_vs_speedy", seed=1, ego="retrained_speedy", non_ego="speedy", persona="speedy")
SUMO = Pairing(arm="naive_vs_sumo", seed=1, ego="naive", non_ego="sumo", persona="")


def rows(pairings, *arms):
    return crossplay(pairings, table(*arms)).to_dict("records")


def test_crossplay__a_cell_is_the_rates_and_means_of_its_arm():
    (row,) = rows([NAIVE], arm("naive_vs_speedy", ego_failed=[1, 0, 0, 0], ego_payoff=[1, 2, 3, 4], speed=12.5))
    assert (row["games"], row["left_out"], row["failure_rate"]) == (4, 0, 0.25)
    # Clopper-Pearson's interval of 1 in 4: 1 - 0.975 ** (1 / 4) = 0.0063, and p with 5 % / 2 below: 0.8059
    assert (row["failure_rate_low"], row["failure_rate_high"]) == (
        pytest.approx(0.0063, abs=1e-4),
        pytest.approx(0.8059, abs=1e-4),
    )
    # mean 2.5, standard error sqrt(5/3)/2, 97.5 % quantile of t with 3 degrees of freedom 3.182446
    half = 3.182446 * math.sqrt(5 / 3) / 2
    assert row["ego_payoff"] == 2.5
    assert row["ego_payoff_low"] == pytest.approx(2.5 - half, abs=1e-5)
    assert (row["non_ego_payoff"], row["ego_mean_speed_mps"]) == (20, 12.5)
    assert math.isnan(row["non_ego_payoff_low"])  # all payoffs alike: nothing to judge an interval by


def test_crossplay__unmeasured_values_are_empty_and_unplayed_games_are_counted():
    other = arm("naive_vs_sumo", ego_failed=[0] * 5, non_ego_payoff=[math.nan] * 5)
    naive, sumo = rows([NAIVE, SUMO], arm("naive_vs_speedy", ego_failed=[1, None, 0]), other)
    assert (naive["games"], naive["left_out"], naive["failure_rate"]) == (2, 3, 0.5)
    assert (sumo["games"], sumo["left_out"]) == (5, 0)
    assert math.isnan(sumo["non_ego_payoff"])
    (naive, retrained) = rows([NAIVE, RETRAINED], arm("naive_vs_speedy", ego_failed=[1, 0]))
    assert (retrained["games"], retrained["left_out"]) == (0, 2)
    assert all(math.isnan(retrained[name]) for name, column in TABLES["crossplay"].items() if column.dtype == "float64")


def test_crossplay__a_pairing_twice_is_refused():
    with pytest.raises(ValueError, match="are paired twice"):
        rows([NAIVE, NAIVE], arm("naive_vs_speedy", ego_failed=[0]))
