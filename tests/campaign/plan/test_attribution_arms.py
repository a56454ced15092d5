"""The arms of `[attribution]`: the person without each trait, and the baseline with each alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from harness.campaign.plan.attribution_arms import trait_questions
from harness.campaign.plan.planned_drivers import SumoDriven, Trained
from harness.campaign.plan.stages import AssessmentStage, TrainingStage
from harness.campaign.preflight import open_campaign
from harness.config.traits import PersonTraits
from harness.errors import UsageError
from harness.evaluation.strategies import Borrowed
from tests.support.plans import campaign_of, planned, stages_of
from tests.support.tiny import CAREFUL, SPEEDY, TEXTING, write_campaign, write_persona

TRAITS = PersonTraits(baseline="cleo", differing={"anna": ("payoff", "attention"), "bert": ("payoff",)})
BASELINE = {"attribution": {"baseline": str(CAREFUL)}}


def test_plan__the_person_without_each_trait_and_the_baseline_with_each_alone() -> None:
    stages, without = stages_of("anna", "bert", traits=TRAITS), stages_of("anna", "bert")
    assert {name: stages[name] for name in without} == without
    added = [name for name in stages if name not in without and "bert" not in name]
    assert added == [
        "cleo",
        "cleo_alone",
        "naive_vs_cleo",
        "naive_vs_anna_with_payoff_of_cleo",
        "naive_vs_cleo_with_payoff_of_anna",
        "naive_vs_anna_with_attention_of_cleo",
        "naive_vs_cleo_with_attention_of_anna",
    ]


def test_plan__the_baseline_is_trained_as_a_persona_of_round_1_and_nothing_else_is() -> None:
    stages, without = stages_of("anna", "bert", traits=TRAITS), stages_of("anna", "bert")
    trainings = {name for name, stage in stages.items() if isinstance(stage, TrainingStage) and name not in without}
    assert trainings == {"cleo"}
    cleo, anna = stages["cleo"], stages["anna"]
    same = ("opponent", "initial", "alone_share", "attentive_share", "gates", "learner")
    assert [getattr(cleo, name) for name in same] == [getattr(anna, name) for name in same]


def test_plan__of_a_payoff_the_policy_is_exchanged_and_of_a_limit_it_is_not() -> None:
    stages = stages_of("anna", "bert", traits=TRAITS)

    def person(arm: str) -> Any:
        (driver,) = stages[arm].non_ego
        return driver

    payoff, attention = (Borrowed(trait=trait, of="cleo") for trait in ("payoff", "attention"))
    assert person("naive_vs_anna_with_payoff_of_cleo") == Trained(stage="cleo-seed1", persona="anna", borrowed=payoff)
    assert person("naive_vs_anna_with_attention_of_cleo") == Trained(
        stage="anna-seed1", persona="anna", borrowed=attention
    )
    assert person("naive_vs_cleo_with_payoff_of_anna").stage == "anna-seed1"
    assert person("naive_vs_cleo_with_attention_of_anna").stage == "cleo-seed1"
    for name, stage in stages.items():
        if isinstance(stage, AssessmentStage) and "_of_" in name:
            assert stage.ego == stages["naive_vs_anna"].ego


def test_plan__a_person_with_one_trait_is_the_baseline_without_it() -> None:
    traits = PersonTraits(baseline="cleo", differing={"bert": ("payoff",)})
    assert [name for name in stages_of("bert", traits=traits) if "cleo" in name] == [
        "cleo",
        "cleo_alone",
        "naive_vs_cleo",
    ]
    (every, payoff) = trait_questions(campaign_of("bert"), traits)
    assert (every.trait, payoff.trait) == ("all", "payoff")
    assert (every.arm, every.without_arm, every.alone_arm) == ("naive_vs_bert", "naive_vs_cleo", "")
    assert (payoff.without_arm, payoff.alone_arm) == ("naive_vs_cleo", "naive_vs_bert")


def test_plan__an_ego_that_is_not_trained_works_too() -> None:
    stages = stages_of("anna", "bert", traits=TRAITS, ego={"driver": "sumo"})
    arm = stages["naive_vs_anna_with_payoff_of_cleo"]
    assert (arm.ego, arm.needs) == ((SumoDriven(),), ("cleo-seed1",))


def test_plan__a_baseline_that_is_a_persona_is_trained_once(tmp_path: Path) -> None:
    stages, _ = planned(tmp_path, personas=[str(CAREFUL), str(SPEEDY)], seeds=[1, 2], **BASELINE)
    assert [name for name, each in stages.items() if isinstance(each, TrainingStage) and "careful" in name] == [
        f"{name}-seed{seed}" for seed in (1, 2) for name in ("careful", "retrained_careful")
    ]
    assert "naive_vs_speedy_with_shoulder_glance_of_careful-seed2" in stages


def test_questions__name_the_arms_and_who_has_to_drive() -> None:
    asked = trait_questions(campaign_of("anna", "bert", seeds=[1, 7]), TRAITS)
    assert [(each.persona, each.seed, each.trait) for each in asked] == [
        *(("anna", seed, trait) for seed in (1, 7) for trait in ("all", "payoff", "attention")),
        *(("bert", seed, trait) for seed in (1, 7) for trait in ("all", "payoff")),
    ]
    question = asked[2]
    assert question.arms == (
        "naive_vs_anna",
        "naive_vs_anna_with_attention_of_cleo",
        "naive_vs_cleo",
        "naive_vs_cleo_with_attention_of_anna",
    )
    assert [bound.arm for bound in question.bounds] == ["naive_alone", "naive_vs_sumo", "anna_alone", "cleo_alone"]


def test_keys__of_other_stages_do_not_depend_on_the_baseline(tmp_path: Path) -> None:
    _, keys = planned(tmp_path / "without", personas=[str(TEXTING)])
    _, more = planned(tmp_path / "with", personas=[str(TEXTING)], **BASELINE)
    assert {name: more[name] for name in keys} == keys
    assert len(more) == len(keys) + 7


def test_keys__the_giver_of_a_trait_changes_the_arms_that_have_it(tmp_path: Path) -> None:
    people = [str(write_persona(tmp_path, "anna"))]
    baseline = {"attribution": {"baseline": str(write_persona(tmp_path, "cleo", goal=3.0))}}
    two = Path(people[0])
    two.write_text(two.read_text() + "[reaction]\ndelay_s = [1.0, 2.0]\n")
    _, keys = planned(tmp_path / "here", personas=people, **baseline)
    write_persona(tmp_path, "cleo", goal=4.0)
    _, changed = planned(tmp_path / "there", personas=people, **baseline)
    assert {name.removesuffix("-seed1") for name in keys if keys[name] != changed[name]} == {
        *("cleo", "cleo_alone", "naive_vs_cleo"),
        *(f"naive_vs_anna_with_{trait}_of_cleo" for trait in ("payoff", "reaction")),
        *(f"naive_vs_cleo_with_{trait}_of_anna" for trait in ("payoff", "reaction")),
    }


def refused(folder: Path, **changes: Any) -> list[tuple[str, str]]:
    """Key and message of each problem of a campaign."""
    with pytest.raises(UsageError) as error:
        open_campaign(write_campaign(folder, **changes))
    return [(problem.key, problem.message) for problem in error.value.problems]


def test_check__a_baseline_that_is_missing_or_compares_nothing_is_refused(tmp_path: Path) -> None:
    ((key, _),) = refused(tmp_path, attribution={"baseline": "nobody_at_all"})
    assert key == "attribution.baseline"
    nothing = refused(tmp_path, attribution={"baseline": str(SPEEDY)})
    assert nothing == [
        ("attribution.baseline", "no persona of the campaign differs from 'speedy': there is nothing to compare")
    ]
    ((key, _),) = refused(tmp_path, attribution={})
    assert key == "attribution.baseline"


def test_check__two_persons_of_one_name_are_refused(tmp_path: Path) -> None:
    anna, other = write_persona(tmp_path, "anna"), tmp_path / "other"
    other.mkdir()
    baseline = write_persona(other, "anna", goal=3.0)
    ((key, message),) = refused(tmp_path, personas=[str(anna)], attribution={"baseline": str(baseline)})
    assert (key, message) == (
        "attribution.baseline",
        f"the persona {str(anna)!r} is called 'anna' too, and is another one",
    )
    mixed = {"name": "careful", "shares": {"anna": 1.0, "speedy": 1.0}}
    changes = {"personas": [str(anna), str(SPEEDY)], "attribution": {"baseline": str(CAREFUL)}}
    file = write_campaign(tmp_path, **changes)
    file.write_text(
        file.read_text() + f'[[population]]\nname = "{mixed["name"]}"\nshares = {{ anna = 1.0, speedy = 1.0 }}\n'
    )
    with pytest.raises(UsageError, match="is the name of a persona or of the baseline"):
        open_campaign(file)


def test_check__policies_of_another_run_have_to_hold_the_baselines(tmp_path: Path) -> None:
    (tmp_path / "policies").mkdir()
    found = refused(tmp_path, policies="policies", training=None, attribution={"baseline": str(CAREFUL)})
    assert ("policies", "'policies' holds no policy 'careful-seed1'") in found
    assert not any("retrained_careful" in message for _, message in found)
