from __future__ import annotations

import math
from dataclasses import replace

import pytest

from harness.evaluation.columns import TABLES
from harness.evaluation.competence import AloneBound, Verdict
from harness.evaluation.game_theory.crossplay import Pairing, crossplay, generalisation
from harness.evaluation.game_theory.findings import find
from tests.support.game_tables import TRAINED_AGAINST, a_campaign, arm, findings, table

NAIVE = Pairing(arm="naive_vs_speedy", seed=1, ego="naive", non_ego="speedy", persona="speedy")
RETRAINED = replace(NAIVE, arm="retrained_vs_speedy", ego="retrained_speedy")
SUMO = Pairing(arm="naive_vs_sumo", seed=1, ego="naive", non_ego="sumo", persona="")
UNMET = {"non_ego": "distracted", "persona": "distracted"}
BOTH = [replace(NAIVE, arm="naive_vs_distracted", **UNMET), replace(RETRAINED, arm="retrained_vs_distracted", **UNMET)]
"""The naive ego and one retrained against another persona, against a person that neither was trained against."""


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


# --- against personas that an ego was not trained against ---


def test_generalisation__agrees_with_the_arithmetic_on_paper():
    # failures naive 1 1 1 0 0 0 0 0, retrained 0 0 1 0 0 0 0 0: differences 1 1 0 ..., mean 1/4, variance 3/14
    episodes = table(
        arm("naive_vs_distracted", ego_failed=[1, 1, 1, 0, 0, 0, 0, 0]),
        arm("retrained_vs_distracted", ego_failed=[0, 0, 1, 0, 0, 0, 0, 0]),
    )
    (row,) = generalisation({"retrained_speedy": ("speedy",)}, BOTH, episodes, 0.01).to_dict("records")
    assert [row[name] for name in ("ego", "met", "persona")] == ["retrained_speedy", "speedy", "distracted"]
    assert (row["pairs"], row["failure_rate"], row["naive_failure_rate"]) == (8, 0.125, 0.375)
    assert (row["fewer_failures"], row["share_of_naive"]) == (0.25, pytest.approx(1 / 3))
    half = 2.364624 * math.sqrt(3 / 14 / 8)  # 97.5 % quantile of t with 7 degrees of freedom
    assert (row["fewer_failures_low"], row["fewer_failures_high"]) == (
        pytest.approx(0.25 - half, abs=1e-5),
        pytest.approx(0.25 + half, abs=1e-5),
    )
    assert row["verdict"] == Verdict.NOT_SIGNIFICANT.value


def test_generalisation__of_failures_that_all_vanish_the_exact_test_counts():
    always, never = [1] * 10, [0] * 10
    episodes = table(arm("naive_vs_distracted", ego_failed=always), arm("retrained_vs_distracted", ego_failed=never))
    (row,) = generalisation({"retrained_speedy": ("speedy",)}, BOTH, episodes, 0.01).to_dict("records")
    assert row["p_value"] == pytest.approx(2.0**-10)
    assert row["verdict"] == Verdict.SIGNIFICANT.value


def test_generalisation__has_only_personas_an_ego_was_not_trained_against():
    found = findings(games=20).generalisation
    assert [tuple(row) for row in found[["ego", "met", "non_ego"]].to_numpy()] == [
        ("retrained_speedy", "speedy", "distracted"),
        ("retrained_distracted", "distracted", "speedy"),
        ("retrained_distracted", "distracted", "speedy_round2"),
    ]


def test_generalisation__without_the_naive_egos_games_has_no_numbers():
    played = table(arm("retrained_vs_distracted", ego_failed=[0, 1]))
    for pairings in (BOTH[1:], BOTH):
        (row,) = generalisation({"retrained_speedy": ("speedy",)}, pairings, played, 0.01).to_dict("records")
        assert (row["pairs"], row["pairs_left_out"], row["verdict"]) == (0, 2, Verdict.NOT_ENOUGH_PAIRS.value)
        assert math.isnan(row["failure_rate"])
        assert math.isnan(row["fewer_failures"])


def test_generalisation__a_naive_ego_that_never_fails_has_no_share():
    episodes = table(arm("naive_vs_distracted", ego_failed=[0, 0]), arm("retrained_vs_distracted", ego_failed=[1, 0]))
    (row,) = generalisation({"retrained_speedy": ("speedy",)}, BOTH, episodes, 0.01).to_dict("records")
    assert math.isnan(row["share_of_naive"])
    assert row["fewer_failures"] == -0.5


# --- all four tables at once ---


def test_find__gives_every_table_or_none_without_pairings_and_responses():
    episodes, pairings, responses = a_campaign(seeds=(1, 2), games=20)
    found = find(pairings, responses, TRAINED_AGAINST, episodes, 0.01)
    assert (len(found.gaps), len(found.crossplay), len(found.generalisation)) == (8, 32, 6)
    assert set(found.equilibria["game"]) == {"speedy", "distracted", "all"}
    assert found.equilibria.loc[found.equilibria["game"] == "all", "held_out_failure_rate"].notna().all()
    assert find([], [], {}, episodes, 0.01) is None


@pytest.mark.parametrize("incapable", ["naive", "retrained_speedy"])
def test_generalisation__an_ego_that_cannot_drive_is_compared_with_none(incapable):
    bounds = {
        name: (AloneBound(player="ego", words=f"the ego {name}", arm=f"{name}_alone", goal_share=0.97),)
        for name in ("naive", "retrained_speedy")
    }
    alone = [arm(f"{name}_alone", ego_failed=[int(name == incapable)] * 20) for name in bounds]
    played = [
        arm("naive_vs_distracted", ego_failed=[1] * 18 + [0] * 2),
        arm("retrained_vs_distracted", ego_failed=[0] * 20),
    ]
    pairings = [replace(each, alone=bounds[each.ego]) for each in BOTH]
    found = find(pairings, [], {"retrained_speedy": ("speedy",)}, table(*alone, *played), 0.01)
    (row,) = found.generalisation.to_dict("records")
    assert row["verdict"] == Verdict.EGO_CANNOT_DRIVE.value
    assert math.isnan(row["p_value"])
    assert (row["pairs"], row["fewer_failures"]) == (20, 0.9)  # what happened in the games stays
    assert found.cautions == [(1, row["reason"])]
