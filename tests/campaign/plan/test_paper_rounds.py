"""The plan of a campaign, and what each stage's numbers depend on."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

from harness.campaign.plan.paper_rounds import questions
from harness.campaign.plan.plan import plan
from harness.campaign.plan.planned_drivers import Shielded, SumoDriven, Trained, description
from harness.campaign.plan.stages import AssessmentStage, PreventabilityStage, TrainingStage, plays_with_errors
from harness.config.traits import PersonTraits
from harness.drivers.policy_file import write_policy
from harness.evaluation.planned_tests import About, families
from harness.evaluation.strategies import ATTENTIVE
from harness.game.roles import EGO, NON_EGO
from tests.support.plans import campaign_of, planned, stages_of
from tests.support.policies import some_policy
from tests.support.tiny import CAREFUL, PAPER_MERGE, SPEEDY, write_persona


@pytest.fixture
def personas(tmp_path: Path) -> list[str]:
    return [str(write_persona(tmp_path, name)) for name in ("anna", "bert", "cleo")]


ARMS_OF_NO_PERSONA = {"naive_alone", "naive_vs_sumo"}
LEARNED_ARMS = {"{}_alone", "naive_vs_{}", "retrained_vs_{}", "retrained_alone_{}"}


def test_plan__of_a_learned_ego() -> None:
    stages = plan(campaign_of("anna", "bert", seeds=[1, 7]), ["anna", "bert"])
    trainings = {stage.id for stage in stages if isinstance(stage, TrainingStage)}
    names = {"naive", "anna", "bert", "retrained_anna", "retrained_bert"}
    assert trainings == {f"{name}-seed{seed}" for name in names for seed in (1, 7)}
    arms = {stage.id for stage in stages if isinstance(stage, AssessmentStage)}
    names = {*ARMS_OF_NO_PERSONA, *(arm.format(who) for arm in LEARNED_ARMS for who in ("anna", "bert"))}
    assert arms == {f"{name}-seed{seed}" for name in names for seed in (1, 7)}


def test_plan__pairings_of_a_learned_ego() -> None:
    arms = {name: stage for name, stage in stages_of("anna").items() if isinstance(stage, AssessmentStage)}
    assert {name: [description(side[0]) if side else None for side in stage.sides] for name, stage in arms.items()} == {
        "naive_alone": ["naive-seed1", None],
        "naive_vs_sumo": ["naive-seed1", "sumo"],
        "anna_alone": [None, "anna-seed1"],
        "naive_vs_anna": ["naive-seed1", "anna-seed1"],
        "retrained_vs_anna": ["retrained_anna-seed1", "anna-seed1"],
        "retrained_alone_anna": ["retrained_anna-seed1", None],
    }


def test_plan__a_shield_plays_each_arm_of_an_ego_once_more_and_changes_no_other_stage() -> None:
    """Of the rounds up to 2: the same policies, with nothing trained and judged anew."""
    asked: dict[str, Any] = {"retraining": {"against": ["bert"]}, "rounds": {"count": 4}, "crossplay": {}}
    without, stages = (stages_of("anna", "bert", ego=ego, **asked) for ego in ({}, {"shield": "rss"}))
    egos = ("naive", "retrained", "robust")
    shielded = {f"shielded_{name}" for name in without if name.startswith(egos) and "_round" not in name}
    shielded = {name for name in shielded if "_vs_" in name or "_alone" in name}
    shielded -= {name for name in shielded if name.count("retrained_anna_vs") or name.count("retrained_bert_vs")}
    assert stages.keys() - without.keys() == shielded
    assert {name: stages[name] for name in without} == without
    arm = stages["shielded_retrained_vs_anna"]
    assert arm.ego == (Shielded(members=(Trained(stage="retrained_anna-seed1"),), rule="rss"),)
    assert arm.needs == without["retrained_vs_anna"].needs


def test_plan__each_arm_of_an_ego_is_played_without_its_perception_errors_too() -> None:
    perception = {"name": "mine", "description": "Something to test with."}
    without, stages = (stages_of("anna", ego=ego) for ego in ({}, {"perception": perception}))
    free = {f"error_free_{name}" for name in ("naive_alone", "naive_vs_sumo", "naive_vs_anna", "retrained_vs_anna")}
    assert stages.keys() - without.keys() == {*free, "error_free_retrained_alone_anna"}
    assert stages["error_free_retrained_vs_anna"].sides == stages["retrained_vs_anna"].sides
    arms = {name: stage for name, stage in stages.items() if isinstance(stage, AssessmentStage)}
    assert {name for name, arm in arms.items() if not plays_with_errors(arm)} == {
        name for name in arms if name.startswith("error_free") or name == "anna_alone"
    }


def test_plan__a_persona_with_lapses_is_also_assessed_alone_with_its_eyes_on_the_road() -> None:
    stages, without = stages_of("anna", "bert", traits=PersonTraits(lapsing=("anna",))), stages_of("anna", "bert")
    assert stages.keys() - without.keys() == {"anna_attentive_alone"}
    arm = stages["anna_attentive_alone"]
    assert arm.sides == ((), (Trained(stage="anna-seed1", persona="anna", borrowed=ATTENTIVE),))
    assert stages["anna_alone"].non_ego == (Trained(stage="anna-seed1", persona="anna"),)


@pytest.mark.parametrize("warm", [False, True])
def test_plan__trainings_of_a_learned_ego(warm: bool) -> None:
    shares = {"non_ego_training": {"alone_share": 0.125}, "retraining": {"alone_share": 0.5, "warm_start": warm}}
    stages = stages_of("anna", **shares)
    naive, anna, retrained = (stages[name] for name in ("naive", "anna", "retrained_anna"))
    assert (naive.learner, naive.opponent, naive.initial, naive.alone_share) == (EGO, (SumoDriven(),), None, 0.3)
    assert (anna.learner, anna.initial, anna.alone_share) == (NON_EGO, None, 0.125)
    assert anna.opponent == (Trained(stage="naive-seed1"),)
    assert (retrained.learner, retrained.alone_share) == (EGO, 0.5)
    assert retrained.initial == (Trained(stage="naive-seed1") if warm else None)
    assert retrained.opponent == (Trained(stage="anna-seed1", persona="anna"),)
    assert (anna.needs, set(retrained.needs)) == (
        ("naive-seed1",),
        {"anna-seed1"} | ({"naive-seed1"} if warm else set()),
    )


def test_plan__egos_of_round_2_are_compared_with_the_naive_ego_where_starts_are_by_regret() -> None:
    asked: dict[str, Any] = {"rounds": {"count": 4}}
    by_regret = stages_of("anna", retraining={"starts": "regret", "against": ["anna"]}, **asked)
    uniform = stages_of("anna", retraining={"against": ["anna"]}, **asked)
    trainings = {name: stage for name, stage in by_regret.items() if isinstance(stage, TrainingStage)}
    of_round_2 = {"retrained_anna", "robust"}
    assert {name for name, stage in trainings.items() if stage.best_known is not None} == of_round_2
    for name in of_round_2:
        assert trainings[name].best_known == Trained(stage="naive-seed1")
        assert "naive-seed1" in trainings[name].needs
        assert "naive-seed1" not in uniform[name].needs
    assert {name: repr(stage) for name, stage in by_regret.items()} == {
        name: repr(stage) for name, stage in uniform.items()
    }  # the keys of stages without replays are those that they had


def test_plan__the_naive_ego_may_train_alone(tmp_path: Path) -> None:
    stages, beside = planned(tmp_path)
    alone, keys = planned(tmp_path, naive_training={"alone_share": 1.0})
    naive = alone["naive-seed1"]
    assert isinstance(naive, TrainingStage)
    assert (naive.opponent, naive.alone_share) == ((), 1.0)
    assert (naive.needs, list(alone)) == ((), list(stages))
    assert keys["naive-seed1"] != beside["naive-seed1"]


@pytest.mark.parametrize("driver", ["sumo", "policy"])
def test_plan__an_external_ego_is_not_retrained(driver: str) -> None:
    names = {"naive_alone", "naive_vs_sumo", "anna", "bert"}
    names |= {f"{who}_alone" for who in ("anna", "bert")} | {f"naive_vs_{who}" for who in ("anna", "bert")}
    assert set(stages_of("anna", "bert", ego={"driver": driver})) == names
    asked = questions(campaign_of("anna", "bert", ego={"driver": driver}), ["anna", "bert"])
    assert {each.question for each in asked} == {"RQ1"}


def test_questions__each_persona_and_seed_is_asked_both() -> None:
    asked = questions(campaign_of("anna", "bert", seeds=[1, 7]), ["anna", "bert"])
    assert [(each.question, each.persona, each.seed, each.baseline, each.treatment) for each in asked] == [
        pair
        for who in ("anna", "bert")
        for seed in (1, 7)
        for pair in (
            ("RQ1", who, seed, "naive_alone", f"naive_vs_{who}"),
            ("RQ2", who, seed, f"naive_vs_{who}", f"retrained_vs_{who}"),
        )
    ]


def test_plan__each_arm_of_an_ego_against_a_persona_is_judged() -> None:
    stages = stages_of("anna", assessment={"reference_drivers": True})
    judged = {name: each for name, each in stages.items() if isinstance(each, PreventabilityStage)}
    assert set(judged) == {"naive_vs_anna_preventability", "retrained_vs_anna_preventability"}
    for name, stage in judged.items():
        assert stage.needs[0] == f"{name.removesuffix('_preventability')}-seed1"


# --- keys -----------------------------------------------------------------------------------------------------------


def differing(keys: dict[str, str], others: dict[str, str]) -> set[str]:
    return {name.removesuffix("-seed1") for name in keys if keys[name] != others[name]}


def of_persona(name: str) -> set[str]:
    return {name, f"retrained_{name}", *(arm.format(name) for arm in LEARNED_ARMS)}


def test_keys__do_not_depend_on_which_other_personas_there_are(tmp_path: Path, personas: list[str]) -> None:
    _, keys = planned(tmp_path, personas=personas[:2])
    _, more = planned(tmp_path, personas=personas)
    assert {name: more[name] for name in keys} == keys
    _, turned = planned(tmp_path, personas=personas[::-1])
    assert turned == more


def test_keys__do_not_depend_on_seeds_after_the_first(tmp_path: Path) -> None:
    """The starts of all arms are drawn from the first seed; trainings depend on their own seed alone."""
    _, keys = planned(tmp_path, seeds=[3])
    _, more = planned(tmp_path, seeds=[3, 1])
    assert {name: more[name] for name in keys} == keys
    assert len(set(more.values())) == len(more)
    _, after_another = planned(tmp_path, seeds=[1, 3])
    assert after_another["naive-seed3"] == keys["naive-seed3"]
    assert after_another["naive_vs_sumo-seed3"] != keys["naive_vs_sumo-seed3"]


def test_keys__a_persona_changes_what_it_takes_part_in(tmp_path: Path, personas: list[str]) -> None:
    _, keys = planned(tmp_path, personas=personas)
    write_persona(tmp_path, "bert", goal=2.5)
    _, changed = planned(tmp_path, personas=personas)
    assert differing(keys, changed) == of_persona("bert")


def test_keys__what_a_persona_declares_of_people_changes_no_game(tmp_path: Path, personas: list[str]) -> None:
    _, keys = planned(tmp_path, personas=personas)
    declared = '[[unlike_people]]\nfigure = "max_jerk_mps3"\nreason = "It is the driver of a paper."\n'
    Path(personas[1]).write_text(f"{Path(personas[1]).read_text()}{declared}")
    assert planned(tmp_path, personas=personas)[1] == keys


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"ego": {"persona": str(SPEEDY)}}, {"naive", *ARMS_OF_NO_PERSONA, *of_persona("speedy")}),
        ({"assessment": {"episodes": 5}}, ARMS_OF_NO_PERSONA | {arm.format("speedy") for arm in LEARNED_ARMS}),
        ({"assessment": {"episodes": 4, "significance": 0.2}}, set()),
        ({"non_ego_training": {"alone_share": 0.7}}, of_persona("speedy")),
        (
            {"retraining": {"alone_share": 0.5}},
            {"retrained_speedy", "retrained_vs_speedy", "retrained_alone_speedy"},
        ),
        (
            {"retraining": {"starts": "regret"}},
            {"retrained_speedy", "retrained_vs_speedy", "retrained_alone_speedy"},
        ),
        ({"retraining": {"starts": "uniform"}}, set()),
    ],
)
def test_keys__a_setting_changes_what_follows_from_it(
    changes: dict[str, Any], expected: set[str], tmp_path: Path
) -> None:
    _, keys = planned(tmp_path)
    _, changed = planned(tmp_path, **changes)
    assert differing(keys, changed) == expected


def test_keys__do_not_depend_on_where_the_campaign_lies(tmp_path: Path) -> None:
    _, keys = planned(tmp_path / "here")
    _, moved = planned(tmp_path / "there", name="another")
    assert moved == keys


@pytest.mark.parametrize("changed", ["training", "policy", "scene.toml", "paper_merge.net.xml", "paper_merge.rou.xml"])
def test_keys__what_all_stages_rest_on_changes_them_all(changed: str, tmp_path: Path) -> None:
    """Settings of trainings, the policy of an external ego, and every file of the scene."""
    shutil.copytree(PAPER_MERGE, tmp_path / "merge")
    write_policy(some_policy(seed=1), tmp_path / "policy")
    changes: dict[str, Any] = {"scene": "merge"}
    if changed == "policy":
        changes["ego"] = {"driver": "policy", "persona": str(CAREFUL)}
    _, keys = planned(tmp_path, **changes)
    if changed == "training":
        changes["training"] = {"steps": 4096}
    elif changed == "policy":
        write_policy(some_policy(seed=2), tmp_path / "policy")
    else:
        with (tmp_path / "merge" / changed).open("a") as file:
            file.write("\n")
    _, others = planned(tmp_path, **changes)
    assert not set(keys.values()) & set(others.values())


def test_keys__of_judgements_depend_on_their_arms_and_no_others_on_them(tmp_path: Path) -> None:
    _, keys = planned(tmp_path / "with", assessment={"episodes": 4, "reference_drivers": True})
    _, keys_without = planned(tmp_path / "without")
    assert {name: keys[name] for name in keys_without} == keys_without
    judged = keys.keys() - keys_without.keys()
    assert len(judged) == 2
    _, more = planned(tmp_path / "five", assessment={"episodes": 5, "reference_drivers": True})
    assert all(keys[name] != more[name] for name in judged)


@pytest.mark.parametrize(
    ("seeds", "of_pairs", "over"), [([1], 6, 0), ([1, 2], 12, 0), ([1, 2, 3], 18, 6), ([4, 1, 2, 3], 24, 6)]
)
def test_families__are_those_of_the_plan(seeds: list[int], of_pairs: int, over: int) -> None:
    personas = ["anna", "bert", "carl"]
    found = families(questions(campaign_of(*personas, seeds=seeds), personas))
    sizes = {About.TRAINED_PAIR: of_pairs, About.TRAININGS: over}
    assert {about: len(tests) for about, tests in found.items()} == {
        about: size for about, size in sizes.items() if size
    }
    for about, tests in found.items():
        asked = {tuple(each.seed for each in test) for test in tests}
        assert asked == ({tuple(seeds)} if about is About.TRAININGS else {(seed,) for seed in seeds})
        assert {(each.question, each.persona) for test in tests for each in test} == {
            (question, persona) for question in ("RQ1", "RQ2") for persona in personas
        }


def test_families__of_an_ego_that_does_not_learn_have_its_only_question() -> None:
    campaign = campaign_of("anna", seeds=[1, 2, 3], ego={"driver": "sumo"})
    pairs, (over,) = families(questions(campaign, ["anna"])).values()
    assert [(each.question, each.persona, each.seed) for each in over] == [("RQ1", "anna", seed) for seed in (1, 2, 3)]
    assert len(pairs) == 3
