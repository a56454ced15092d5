from __future__ import annotations

import math
from dataclasses import replace

import pytest

from harness.evaluation.competence import AloneBound, Verdict
from harness.evaluation.game_theory.crossplay import Pairing, generalisation
from harness.evaluation.game_theory.findings import find
from tests.support.game_tables import TRAINED_AGAINST, a_campaign, arm, findings, table

NAIVE = Pairing(arm="naive_vs_distracted", seed=1, ego="naive", non_ego="distracted", persona="distracted")
RETRAINED = replace(NAIVE, arm="retrained_vs_distracted", ego="retrained_speedy")


def test_generalisation__agrees_with_the_arithmetic_on_paper():
    # failures naive 1 1 1 0 0 0 0 0, retrained 0 0 1 0 0 0 0 0: differences 1 1 0 ..., mean 1/4, variance 3/14
    episodes = table(
        arm("naive_vs_distracted", ego_failed=[1, 1, 1, 0, 0, 0, 0, 0]),
        arm("retrained_vs_distracted", ego_failed=[0, 0, 1, 0, 0, 0, 0, 0]),
    )
    (row,) = generalisation({"retrained_speedy": ("speedy",)}, [NAIVE, RETRAINED], episodes, 0.01).to_dict("records")
    assert [row[name] for name in ("ego", "met", "persona")] == ["retrained_speedy", "speedy", "distracted"]
    assert (row["pairs"], row["failure_rate"], row["naive_failure_rate"]) == (8, 0.125, 0.375)
    assert (row["fewer_failures"], row["share_of_naive"]) == (0.25, pytest.approx(1 / 3))
    half = 2.364624 * math.sqrt(3 / 14 / 8)  # 97.5 % quantile of t with 7 degrees of freedom
    assert (row["fewer_failures_low"], row["fewer_failures_high"]) == (
        pytest.approx(0.25 - half, abs=1e-5),
        pytest.approx(0.25 + half, abs=1e-5),
    )
    assert row["verdict"] == Verdict.NOT_SIGNIFICANT.value


def test_generalisation__has_only_personas_an_ego_was_not_trained_against():
    found = findings(games=20).generalisation
    assert [tuple(row) for row in found[["ego", "met", "non_ego"]].to_numpy()] == [
        ("retrained_speedy", "speedy", "distracted"),
        ("retrained_distracted", "distracted", "speedy"),
        ("retrained_distracted", "distracted", "speedy_round2"),
    ]


def test_generalisation__without_the_naive_egos_games_has_no_numbers():
    played = table(arm("retrained_vs_distracted", ego_failed=[0, 1]))
    for pairings in ([RETRAINED], [NAIVE, RETRAINED]):
        (row,) = generalisation({"retrained_speedy": ("speedy",)}, pairings, played, 0.01).to_dict("records")
        assert (row["pairs"], row["pairs_left_out"], row["verdict"]) == (0, 2, Verdict.NOT_ENOUGH_PAIRS.value)
        assert math.isnan(row["failure_rate"])
        assert math.isnan(row["fewer_failures"])


def test_generalisation__a_naive_ego_that_never_fails_has_no_share():
    episodes = table(arm("naive_vs_distracted", ego_failed=[0, 0]), arm("retrained_vs_distracted", ego_failed=[1, 0]))
    (row,) = generalisation({"retrained_speedy": ("speedy",)}, [NAIVE, RETRAINED], episodes, 0.01).to_dict("records")
    assert math.isnan(row["share_of_naive"])
    assert row["fewer_failures"] == -0.5


# --- all four tables at once ---


def test_find__gives_every_table_or_none_without_pairings_and_responses():
    episodes, pairings, responses = a_campaign(seeds=(1, 2), games=20)
    found = find(pairings, responses, TRAINED_AGAINST, episodes, 0.01)
    assert (len(found.gaps), len(found.crossplay), len(found.generalisation)) == (8, 32, 6)
    assert set(found.equilibria["game"]) == {"speedy", "distracted", "all"}
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
    pairings = [replace(each, alone=bounds[each.ego]) for each in (NAIVE, RETRAINED)]
    found = find(pairings, [], {"retrained_speedy": ("speedy",)}, table(*alone, *played), 0.01)
    (row,) = found.generalisation.to_dict("records")
    assert row["verdict"] == Verdict.EGO_CANNOT_DRIVE.value
    assert math.isnan(row["p_value"])
    assert (row["pairs"], row["fewer_failures"]) == (20, 0.9)  # what happened in the games stays
    assert found.cautions == [(1, row["reason"])]
