"""Whose competence each question, pair and training rests on."""

from __future__ import annotations

from typing import Any

import pytest

from harness.campaign.plan.alone_bounds import alone_bounds, bound_of
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
        (Arm(ego=NaiveEgo()), {"naive_alone"}),
        (Arm(ego=NaiveEgo(), non_ego=ANNA), {"naive_alone", "anna_alone"}),
        (Arm(ego=NaiveEgo(), non_ego=SumoNonEgo()), {"naive_alone"}),  # SUMO's driver is not played alone
        (Arm(ego=RetrainedEgo(against="anna"), non_ego=ANNA), {"retrained_alone_anna", "anna_alone"}),
        (Arm(ego=ReconfiguredEgo(against="anna"), non_ego=ANNA), {"reconfigured_alone_anna", "anna_alone"}),
        (Arm(ego=RobustEgo(), non_ego=ANNA), {"robust_alone", "anna_alone"}),
        (Arm(ego=OtherEgo(driver="adas"), non_ego=ANNA), {"anna_alone"}),  # it has no arm alone
        (
            Arm(ego=RetrainedEgo(against="anna", round=4), non_ego=PersonaNonEgo(persona="anna", round=3)),
            {"retrained_anna_round4_alone", "anna_round3_alone"},
        ),
        (Arm(ego=NaiveEgo(), non_ego=PersonaNonEgo(persona="town")), {"naive_alone", "anna_alone", "bert_alone"}),
    ],
)
def test_bounds__of_an_arm_are_asked_in_the_arms_of_its_players_alone(arm: Arm, alone: set[str]) -> None:
    bounds = alone_bounds(campaign(population=[TOWN]), arm)
    assert {each.arm for each in bounds} == alone
    assert {each.goal_share for each in bounds if each.player == "ego"} <= {0.97}
    assert {each.goal_share for each in bounds if each.player == "non_ego"} <= {0.8}


def test_bounds__are_the_campaigns() -> None:
    asked = campaign(competence={"ego_goal_share": 0.5, "non_ego_goal_share": 0.25})
    ego, person = alone_bounds(asked, Arm(ego=NaiveEgo(), non_ego=ANNA))
    assert (ego.goal_share, person.goal_share) == (0.5, 0.25)
    assert (ego.words, person.words) == ("the naive ego", "the anna driver")


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
    rq1 = ["naive_alone", "anna_alone"]
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
    bounds = {stage.name: bound_of(document, stage) for stage in trainings}
    judged = {name: bound.arm for name, bound in bounds.items() if bound is not None}
    assert judged["naive"] == "naive_alone"
    assert judged["anna"] == "anna_alone"
    assert judged["retrained_town"] == "retrained_alone_town"
    assert judged["robust"] == "robust_alone"
    unjudged = {each.name for each in trainings if isinstance(each.strategy, BestResponse | RoundAnswer)}
    assert "anna_round3_answer" in unjudged
    assert unjudged == set(bounds) - set(judged)
