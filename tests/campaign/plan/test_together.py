"""The plan of a campaign whose personas learn together, and of one whose ego is retrained against several alone."""

from __future__ import annotations

from typing import Any

from harness.campaign.plan.paper_rounds import questions
from harness.campaign.plan.plan import plan
from harness.campaign.plan.planned_drivers import (
    FixedMixture,
    Shipped,
    SumoDriven,
    Trained,
    by_control,
    without_shipped,
)
from harness.campaign.plan.stages import AssessmentStage, ConditioningStage, TrainingStage
from harness.campaign.plan.strategy_stages import training_settings
from harness.config.traits import PersonTraits
from tests.support.plans import campaign_of, stages_of

PERSONAS = ("anna", "bert", "cleo")
ASKED: dict[str, Any] = {
    "non_ego_training": {"together": True},
    "retraining": {"against": ["anna", "bert"]},
    "rounds": {"count": 1},
}


def test_plan__of_all_personas_three_trainings_are_left() -> None:
    stages = plan(campaign_of(*PERSONAS, **ASKED), PERSONAS)
    trainings = [each for each in stages if isinstance(each, TrainingStage)]
    assert [each.id for each in trainings] == ["naive-seed1", "people-seed1", "robust-seed1"]
    assert trainings[1].personas == PERSONAS
    derived = [each for each in stages if isinstance(each, ConditioningStage)]
    assert {each.id: each.needs for each in derived} == {f"{name}-seed1": ("people-seed1",) for name in PERSONAS}
    of_robust = {each.name for each in stages if isinstance(each, AssessmentStage) and "robust" in each.name}
    assert of_robust == {"robust_alone", "robust_vs_sumo", *(f"robust_vs_{name}" for name in PERSONAS)}


def test_plan__the_budget_of_a_training_together_is_that_of_as_many_trainings() -> None:
    campaign = campaign_of(*PERSONAS, **ASKED)
    steps = {
        each.id: training_settings(campaign, each).steps
        for each in plan(campaign, PERSONAS)
        if isinstance(each, TrainingStage)
    }
    one = campaign.training.steps
    assert steps == {"naive-seed1": one, "people-seed1": 3 * one, "robust-seed1": 2 * one}


def test_plan__an_ego_retrained_against_sumos_driver_too_meets_it_in_an_equal_share() -> None:
    asked = {**ASKED, "retraining": {"against": ["anna", "bert", "sumo"]}}
    robust = stages_of(*PERSONAS, **asked)["robust"]
    assert isinstance(robust, TrainingStage)
    people = tuple(Trained(stage=f"{name}-seed1", persona=name) for name in ("anna", "bert"))
    assert robust.opponent == (FixedMixture(members=(*people, SumoDriven()), shares=(1.0, 1.0, 1.0)),)
    assert by_control(robust.opponent) == (
        ((FixedMixture(members=people, shares=(1.0, 1.0)),), 2.0),
        ((SumoDriven(),), 1.0),
    )
    assert by_control(people) == ((people, 1.0),)
    campaign = campaign_of(*PERSONAS, **asked)
    assert training_settings(campaign, robust).steps == 3 * campaign.training.steps


def test_plan__an_ego_retrained_against_several_learns_with_people_of_the_other_training_seeds() -> None:
    asked = {**ASKED, "retraining": {"against": ["sumo", "anna"]}, "seeds": [7, 8, 9]}
    campaign = campaign_of(*PERSONAS, **asked)
    stages = plan(campaign, PERSONAS)
    robust = next(each for each in stages if each.id == "robust-seed8")
    assert isinstance(robust, TrainingStage)
    people = tuple(Trained(stage=f"anna-seed{seed}", persona="anna") for seed in (7, 9))
    assert robust.opponent == (FixedMixture(members=(SumoDriven(), *people), shares=(1.0, 0.5, 0.5)),)
    assert training_settings(campaign, robust).steps == 2 * campaign.training.steps
    assert next(each for each in stages if each.id == "robust_vs_anna-seed8").needs == ("robust-seed8", "anna-seed8")
    done = set[str]()
    for stage in stages:
        assert done.issuperset(stage.needs), stage.id
        done.add(stage.id)


def test_plan__best_responses_are_those_to_the_ego_retrained_against_several_where_none_is_against_one() -> None:
    stages = plan(campaign_of(*PERSONAS, **ASKED, best_response={"steps": 1000, "starts": 1}), PERSONAS)
    measured = [
        each.name for each in stages if isinstance(each, AssessmentStage) and each.arm.best_response_of is not None
    ]
    players = ("ego", "non_ego")
    assert measured == [f"robust_vs_{name}_{player}_response" for name in PERSONAS for player in players]


def test_plan__an_ego_retrained_against_shipped_people_meets_all_their_trainings_but_one_of_each() -> None:
    campaign = campaign_of(seeds=[7, 8], retraining={"against": ["sumo", "shipped"]})
    robust = [each for each in plan(campaign, []) if isinstance(each, TrainingStage) and each.name == "robust"]
    mixtures = [FixedMixture(members=(SumoDriven(), Shipped(without=k)), shares=(1.0, 1.0)) for k in (0, 1)]
    assert [each.opponent for each in robust] == [(each,) for each in mixtures]
    assert training_settings(campaign, robust[0]).steps == 2 * campaign.training.steps
    assert by_control((mixtures[0],))[1] == ((SumoDriven(),), 1.0)


def test_without_shipped__the_others_have_their_games_or_sumos_driver() -> None:
    shipped, sumo, anna = Shipped(without=0), SumoDriven(), Trained(stage="anna-seed1", persona="anna")
    assert without_shipped((shipped,)) == (sumo,)
    assert without_shipped((FixedMixture(members=(anna, shipped), shares=(1.0, 2.0)),)) == (anna,)
    three = FixedMixture(members=(anna, shipped, sumo), shares=(1.0, 2.0, 3.0))
    assert without_shipped((three,)) == (FixedMixture(members=(anna, sumo), shares=(1.0, 3.0)),)
    assert without_shipped((anna,)) == (anna,)


def test_plan__the_arms_are_those_of_personas_that_learn_alone() -> None:
    arms = []
    for together in (False, True):
        stages = stages_of(*PERSONAS, **{**ASKED, "non_ego_training": {"together": together}})
        arms.append({name: each.sides for name, each in stages.items() if isinstance(each, AssessmentStage)})
    assert arms[0] == arms[1]


def test_plan__the_baseline_of_an_attribution_learns_with_the_others() -> None:
    campaign = campaign_of("anna", non_ego_training={"together": True}, attribution={"baseline": "cleo"})
    stages = plan(campaign, ["anna"], traits=PersonTraits(baseline="cleo", differing={"anna": ("payoff",)}))
    assert [each.personas for each in stages if isinstance(each, TrainingStage) and each.name == "people"] == [
        ("anna", "cleo")
    ]


def test_plan__one_persona_learns_alone() -> None:
    stages = plan(campaign_of("anna", non_ego_training={"together": True}), ["anna"])
    assert [each.name for each in stages if isinstance(each, TrainingStage)] == ["naive", "anna", "retrained_anna"]


def test_plan__with_policies_each_persona_gets_its_own_from_the_one_that_is_read() -> None:
    changes = {"non_ego_training": {"together": True}, "policies": "folder", "ego": {"driver": "sumo"}}
    stages = {each.id: each for each in plan(campaign_of("anna", **changes), ["anna"])}
    assert not [each for each in stages.values() if isinstance(each, TrainingStage)]
    assert stages["anna-seed1"].reads == ("people-seed1",)
    assert stages["anna-seed1"].needs == ()
    assert "anna-seed1" in stages["naive_vs_anna-seed1"].needs


def test_questions__without_an_ego_of_one_persona_the_second_is_about_the_robust_one() -> None:
    asked = questions(campaign_of(*PERSONAS, **ASKED), PERSONAS)
    assert [(each.baseline, each.treatment) for each in asked if each.question == "RQ2"] == [
        (f"naive_vs_{name}", f"robust_vs_{name}") for name in PERSONAS
    ]
    without = {**ASKED, "retraining": {}}
    assert not [each for each in questions(campaign_of(*PERSONAS, **without), PERSONAS) if each.question == "RQ2"]
