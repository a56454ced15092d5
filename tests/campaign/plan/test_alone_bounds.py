"""Whose competence each question, pair and training rests on."""

from __future__ import annotations

from typing import Any

import pytest

from harness.campaign.plan.alone_bounds import alone_bounds, bounds_of
from harness.campaign.plan.paper_rounds import questions
from harness.campaign.plan.plan import plan
from harness.campaign.plan.stages import AssessmentStage, TrainingStage
from harness.config.campaign import Campaign
from harness.evaluation.strategies import (
    Arm,
    BestResponse,
    NaiveEgo,
    OtherEgo,
    PersonaNonEgo,
    ReconfiguredEgo,
    RetrainedEgo,
    RobustEgo,
    RoundAnswer,
    SumoNonEgo,
)
from tests.support.plans import campaign_of

ANNA = PersonaNonEgo(persona="anna")
NAIVE = ["naive_alone", "naive_vs_sumo"]
"""The arms of a naive ego that learned alone and beside SUMO's driver."""


def campaign(**changes: Any) -> Campaign:
    return campaign_of("anna", "bert", **changes)


TOWN = {"name": "town", "shares": {"anna": 1.0, "bert": 3.0}}
RACE = {
    "rounds": {"count": 4},
    "retraining": {"against": ["anna", "bert"]},
    "population": [TOWN],
    "crossplay": {"egos": ["sumo"]},
    "best_response": {"steps": 1000, "starts": 1},
}


@pytest.mark.parametrize(
    ("arm", "alone"),
    [
        (Arm(ego=NaiveEgo()), {*NAIVE}),
        (Arm(ego=NaiveEgo(), non_ego=ANNA), {*NAIVE, "anna_alone"}),
        (Arm(ego=NaiveEgo(), non_ego=SumoNonEgo()), {*NAIVE}),  # SUMO's driver is not played alone
        (Arm(ego=RetrainedEgo(against="anna"), non_ego=ANNA), {"retrained_alone_anna", "anna_alone"}),
        (Arm(ego=ReconfiguredEgo(against="anna"), non_ego=ANNA), {"reconfigured_alone_anna", "anna_alone"}),
        (Arm(ego=RobustEgo(), non_ego=ANNA), {"robust_alone", "anna_alone"}),
        (Arm(ego=OtherEgo(driver="adas"), non_ego=ANNA), {"anna_alone"}),  # it has no arm alone
        (
            Arm(ego=RetrainedEgo(against="anna", round=4), non_ego=PersonaNonEgo(persona="anna", round=3)),
            {"retrained_anna_round4_alone", "anna_round3_alone"},
        ),
        (Arm(ego=NaiveEgo(), non_ego=PersonaNonEgo(persona="town")), {*NAIVE, "anna_alone", "bert_alone"}),
    ],
)
def test_bounds__of_an_arm_are_asked_in_the_arms_of_its_players_alone(arm: Arm, alone: set[str]) -> None:
    bounds = alone_bounds(campaign(population=[TOWN]), arm)
    assert {each.arm for each in bounds} == alone
    assert {each.goal_share for each in bounds if each.player == "ego"} <= {0.97}
    assert {each.goal_share for each in bounds if each.player == "non_ego"} <= {0.8}


def test_bounds__are_the_campaigns() -> None:
    asked = campaign(competence={"ego_goal_share": 0.5, "non_ego_goal_share": 0.25})
    ego, beside_sumo, person = alone_bounds(asked, Arm(ego=NaiveEgo(), non_ego=ANNA))
    assert (ego.goal_share, beside_sumo.goal_share, person.goal_share) == (0.5, 0.5, 0.25)
    assert (ego.words, beside_sumo.words, person.words) == ("the naive ego", "the naive ego", "the anna driver")
    assert (ego.where, beside_sumo.where) == ("alone", "beside an ordinary road user")


def test_bounds__are_not_asked_beside_a_driver_beside_whom_the_ego_did_not_learn() -> None:
    for changes in ({"naive_training": {"alone_share": 1.0}}, {"ego": {"driver": "egos/adas.toml"}}):
        found = alone_bounds(campaign(**changes), Arm(ego=NaiveEgo(), non_ego=ANNA))
        assert [each.arm for each in found] == ["naive_alone", "anna_alone"]


@pytest.mark.parametrize(
    ("driver", "tunable", "round_2"),
    [
        ("learned", False, ["retrained_alone_anna"]),
        ("sumo", False, None),
        ("egos/adas.toml", False, None),
        ("egos/adas.toml", True, ["reconfigured_alone_anna"]),
    ],
)
def test_questions__ask_the_players_of_both_arms(driver: str, tunable: bool, round_2: list[str] | None) -> None:
    asked = questions(campaign(ego={"driver": driver}), ["anna"], tunable)
    rq1 = [*(NAIVE if driver == "learned" else ["naive_alone"]), "anna_alone"]
    expected = [rq1] if round_2 is None else [rq1, rq1 + round_2]
    assert [[each.arm for each in question.alone] for question in asked] == expected


@pytest.mark.parametrize(
    ("changes", "tunable"),
    [({}, False), (RACE, False), ({"ego": {"driver": "sumo"}}, False), ({"ego": {"driver": "x.toml"}}, True)],
)
def test_bounds__every_arm_that_they_name_is_played(changes: dict[str, Any], tunable: bool) -> None:
    document = campaign(**changes)
    stages = plan(document, ["anna", "bert"], tunable)
    arms = {stage.arm for stage in stages if isinstance(stage, AssessmentStage)}
    asked = {each.arm for arm in arms for each in alone_bounds(document, arm.pair)}
    asked |= {each.arm for question in questions(document, ["anna", "bert"], tunable) for each in question.alone}
    assert asked <= {arm.name for arm in arms}


def test_trainings__are_judged_by_their_players_arm_alone_except_best_responses_and_answers() -> None:
    document = campaign(**RACE)
    trainings = [each for each in plan(document, ["anna", "bert"]) if isinstance(each, TrainingStage)]
    bounds = {stage.name: list(bounds_of(document, stage.strategy)) for stage in trainings}
    judged = {name: [each.arm for each in found] for name, found in bounds.items() if found}
    assert judged["naive"] == NAIVE
    assert judged["anna"] == ["anna_alone"]
    assert judged["retrained_town"] == ["retrained_alone_town"]
    assert judged["robust"] == ["robust_alone"]
    unjudged = {each.name for each in trainings if isinstance(each.strategy, BestResponse | RoundAnswer)}
    assert "anna_round3_answer" in unjudged
    assert unjudged == set(bounds) - set(judged)
