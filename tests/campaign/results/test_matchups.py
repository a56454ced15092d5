"""Which strategy meets which, which responses there are, and which strategies a response is compared with."""

from __future__ import annotations

from typing import Any

import pytest

from harness.campaign.results.matchups import Matchups, matchups_of
from tests.support.plans import campaign_of, stages_of

RESPONSE: dict[str, Any] = {"steps": 2048, "starts": 2}
BOTH = ("anna", "bert")


def matchups(*personas: str, tunable: bool = False, **changes: Any) -> Matchups | None:
    ids = {f"{name}-seed1" for name in stages_of(*personas, tunable=tunable, **changes)}
    return matchups_of(campaign_of(*personas, **changes), personas, ids, tunable)


def test_matchups__of_all_egos_against_all_people() -> None:
    changes = {"crossplay": {"egos": ["sumo", "egos/adas.toml"]}, "retraining": {"against": ["anna"]}}
    found = matchups(*BOTH, rounds={"count": 4}, **changes)
    assert found is not None
    egos = {"naive", "robust", "sumo", "adas"}
    egos |= {f"retrained_{who}{round_}" for who in BOTH for round_ in ("", "_round4", "_round4_rejected")}
    non_egos = {f"{who}{round_}" for who in BOTH for round_ in ("", "_round3", "_round3_rejected")}
    assert {(each.ego, each.non_ego) for each in found.pairings} == {(ego, other) for ego in egos for other in non_egos}
    assert found.training_personas["robust"] == ["anna"]
    assert found.training_personas["retrained_bert_round4"] == ["bert"]


@pytest.mark.parametrize(
    ("driver", "tunable", "egos", "measured"),
    [
        ("sumo", False, {"naive", "adas"}, "naive_vs_anna"),
        ("adas.toml", True, {"naive", "reconfigured_anna", "sumo"}, "reconfigured_vs_anna"),
    ],
)
def test_matchups__of_an_external_ego_as_it_is_and_as_it_was_tuned(
    driver: str, tunable: bool, egos: set[str], measured: str
) -> None:
    other = "sumo" if driver != "sumo" else "adas.toml"
    changes = {"ego": {"driver": driver}, "crossplay": {"egos": [other]}, "best_response": RESPONSE}
    found = matchups("anna", tunable=tunable, **changes)
    assert found is not None
    assert {each.ego for each in found.pairings} == egos
    assert {each.pair_arm for each in found.responses} == {measured}


def test_matchups__there_are_none_of_the_papers_rounds() -> None:
    assert matchups(*BOTH) is None


def test_matchups__a_response_has_the_pair_and_round_that_it_belongs_to() -> None:
    found = matchups("anna", rounds={"count": 3}, best_response=RESPONSE)
    assert found is not None
    assert {(each.role, each.round, each.pair_arm, each.ego, each.non_ego) for each in found.responses} == {
        (role, last, pair, "retrained_anna", non_ego)
        for role in ("ego", "non_ego")
        for last, pair, non_ego in (
            (2, "retrained_vs_anna", "anna"),
            (3, "retrained_anna_vs_anna_round3", "anna_round3"),
        )
    }


def test_matchups__a_response_knows_the_strategies_that_met_the_same_other_player_with_the_same_payoff() -> None:
    response = {**RESPONSE, "arms": ["naive_vs_anna_round3"]}
    changes = {"rounds": {"count": 3, "stop_early": False}, "crossplay": {"egos": ["sumo"]}}
    found = matchups(*BOTH, best_response=response, **changes)
    assert found is not None
    (ego, non_ego) = (each for each in found.responses if each.pair_arm == "retrained_anna_vs_anna_round3")
    assert (ego.search_steps, ego.search_starts) == (2048, 2)
    assert ego.known_arms == {
        "naive": "naive_vs_anna_round3",
        "retrained_bert": "retrained_bert_vs_anna_round3",
        "sumo": "sumo_vs_anna_round3",
        "naive_vs_anna_round3_ego_response": "naive_vs_anna_round3_ego_response",
    }
    # neither bert's nor SUMO's driver has anna's payoff
    assert non_ego.known_arms == {
        "anna": "retrained_vs_anna",
        "anna_round3_rejected": "retrained_anna_vs_anna_round3_rejected",
    }
    (_, non_ego) = (each for each in found.responses if each.pair_arm == "naive_vs_anna_round3")
    assert non_ego.known_arms == {"anna": "naive_vs_anna", "anna_round3_rejected": "naive_vs_anna_round3_rejected"}


def test_matchups__a_response_does_not_know_the_strategies_of_another_seed() -> None:
    campaign = campaign_of("anna", seeds=[1, 2], crossplay={}, best_response=RESPONSE)
    names = [f"retrained_vs_anna{ending}-seed1" for ending in ("", "_ego_response")]
    found = matchups_of(campaign, ["anna"], {*names, "naive_vs_anna-seed2"})
    assert found is not None
    assert [each.known_arms for each in found.responses] == [{}]
