"""The plan of a campaign, and what each stage's numbers depend on."""

from __future__ import annotations

from pathlib import Path

import pytest

from harness.campaign.plan.paper_rounds import questions
from harness.campaign.plan.planned_drivers import SumoDriven, Trained, description
from harness.campaign.plan.stages import AssessmentStage, TrainingStage
from harness.campaign.preflight import open_campaign
from harness.drivers.policy_file import write_policy
from harness.game.roles import EGO, NON_EGO
from tests.support.plans import planned
from tests.support.policies import some_policy
from tests.support.tiny import CAREFUL, SPEEDY, write_campaign, write_persona


@pytest.fixture
def personas(tmp_path: Path) -> list[str]:
    return [str(write_persona(tmp_path, name)) for name in ("anna", "bert", "cleo")]


LEARNED_ARMS = {"{}_alone", "naive_vs_{}", "retrained_vs_{}", "retrained_alone_{}"}


def test_plan__of_a_learned_ego(tmp_path: Path, personas: list[str]) -> None:
    stages, _ = planned(tmp_path, personas=personas[:2], seeds=[1, 7])
    trainings = {id for id, stage in stages.items() if isinstance(stage, TrainingStage)}
    arms = {id for id, stage in stages.items() if isinstance(stage, AssessmentStage)}
    names = {"naive", "anna", "bert", "retrained_anna", "retrained_bert"}
    assert trainings == {f"{name}-seed{seed}" for name in names for seed in (1, 7)}
    names = {"naive_alone", "naive_vs_sumo", *(arm.format(who) for arm in LEARNED_ARMS for who in ("anna", "bert"))}
    assert arms == {f"{name}-seed{seed}" for name in names for seed in (1, 7)}


def test_plan__pairings_of_a_learned_ego(tmp_path: Path, personas: list[str]) -> None:
    stages, _ = planned(tmp_path, personas=personas[:1])

    assert {
        name: tuple(description(side[0]) if side else None for side in stage.sides)
        for name, stage in stages.items()
        if isinstance(stage, AssessmentStage)
    } == {
        "naive_alone-seed1": ("naive-seed1", None),
        "naive_vs_sumo-seed1": ("naive-seed1", "sumo"),
        "anna_alone-seed1": (None, "anna-seed1"),
        "naive_vs_anna-seed1": ("naive-seed1", "anna-seed1"),
        "retrained_vs_anna-seed1": ("retrained_anna-seed1", "anna-seed1"),
        "retrained_alone_anna-seed1": ("retrained_anna-seed1", None),
    }


def test_plan__trainings_of_a_learned_ego(tmp_path: Path, personas: list[str]) -> None:
    shares = {
        "non_ego_training": {"alone_share": 0.125},
        "retraining": {"alone_share": 0.5, "warm_start": True},
    }
    stages, _ = planned(tmp_path, personas=personas[:1], **shares)
    naive, anna, retrained = (stages[f"{name}-seed1"] for name in ("naive", "anna", "retrained_anna"))
    assert isinstance(naive, TrainingStage)
    assert isinstance(anna, TrainingStage)
    assert isinstance(retrained, TrainingStage)
    assert (naive.learner, naive.opponent, naive.initial, naive.alone_share) == (EGO, (), None, 1.0)
    assert (anna.learner, anna.initial, anna.alone_share) == (NON_EGO, None, 0.125)
    assert anna.opponent == (Trained(stage="naive-seed1"),)
    assert (retrained.learner, retrained.initial, retrained.alone_share) == (EGO, Trained(stage="naive-seed1"), 0.5)
    assert retrained.opponent == (Trained(stage="anna-seed1", persona="anna"),)


def test_plan__the_naive_ego_may_train_beside_sumos_driver(tmp_path: Path, personas: list[str]) -> None:
    stages, alone = planned(tmp_path, personas=personas[:1])
    beside, keys = planned(tmp_path, personas=personas[:1], naive_training={"alone_share": 0.25})
    naive = beside["naive-seed1"]
    assert isinstance(naive, TrainingStage)
    assert (naive.opponent, naive.alone_share) == ((SumoDriven(),), 0.25)
    assert (naive.needs, list(beside)) == ((), list(stages))
    assert keys["naive-seed1"] != alone["naive-seed1"]


def test_plan__without_a_warm_start_everyone_begins_from_nothing_but_still_needs_the_opponent(
    tmp_path: Path, personas: list[str]
) -> None:
    stages, _ = planned(tmp_path, personas=personas[:1])
    anna, retrained = stages["anna-seed1"], stages["retrained_anna-seed1"]
    assert isinstance(anna, TrainingStage)
    assert isinstance(retrained, TrainingStage)
    assert (anna.initial, anna.needs) == (None, ("naive-seed1",))
    assert (retrained.initial, retrained.needs) == (None, ("anna-seed1",))


@pytest.mark.parametrize("driver", ["sumo", "policy"])
def test_plan__an_ego_that_is_given_is_not_retrained(driver: str, tmp_path: Path, personas: list[str]) -> None:
    write_policy(some_policy(), tmp_path / "policy")
    stages, _ = planned(tmp_path, personas=personas[:2], ego={"driver": driver, "persona": str(CAREFUL)})
    names = {"naive_alone", "naive_vs_sumo", "anna", "bert"}
    names |= {f"{who}_alone" for who in ("anna", "bert")} | {f"naive_vs_{who}" for who in ("anna", "bert")}
    assert set(stages) == {f"{name}-seed1" for name in names}
    campaign = open_campaign(tmp_path / "tiny.toml")
    assert {each.question for each in questions(campaign.document, ["anna", "bert"])} == {"RQ1"}


@pytest.mark.parametrize("driver", ["learned", "sumo"])
def test_plan__what_a_stage_needs_stands_before_it(driver: str, tmp_path: Path, personas: list[str]) -> None:
    stages, _ = planned(tmp_path, personas=personas, seeds=[1, 2], ego={"driver": driver, "persona": str(CAREFUL)})
    before: set[str] = set()
    for name, stage in stages.items():
        assert set(stage.needs) <= before, name
        assert len(set(stage.needs)) == len(stage.needs)
        before.add(name)


def test_questions__each_persona_and_seed_is_asked_both(tmp_path: Path, personas: list[str]) -> None:
    campaign = open_campaign(write_campaign(tmp_path, personas=personas[:2], seeds=[1, 7]))
    asked = {
        (each.question, each.persona, each.seed): (each.baseline, each.treatment)
        for each in questions(campaign.document, ["anna", "bert"])
    }
    assert asked == {
        **{("RQ1", who, seed): ("naive_alone", f"naive_vs_{who}") for who in ("anna", "bert") for seed in (1, 7)},
        **{
            ("RQ2", who, seed): (f"naive_vs_{who}", f"retrained_vs_{who}")
            for who in ("anna", "bert")
            for seed in (1, 7)
        },
    }


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


def test_keys__do_not_depend_on_which_other_seeds_there_are(tmp_path: Path) -> None:
    _, keys = planned(tmp_path, seeds=[3])
    _, more = planned(tmp_path, seeds=[1, 3])
    assert {name: more[name] for name in keys} == keys
    assert len(set(more.values())) == len(more)


def test_keys__a_persona_changes_what_it_takes_part_in(tmp_path: Path, personas: list[str]) -> None:
    _, keys = planned(tmp_path, personas=personas)
    write_persona(tmp_path, "bert", goal=2.5)
    _, changed = planned(tmp_path, personas=personas)
    assert differing(keys, changed) == of_persona("bert")


def test_keys__the_egos_persona_changes_everything(tmp_path: Path, personas: list[str]) -> None:
    _, keys = planned(tmp_path, personas=personas[:1])
    _, changed = planned(tmp_path, personas=personas[:1], ego={"persona": str(SPEEDY)})
    assert differing(keys, changed) == {name.removesuffix("-seed1") for name in keys}


def test_keys__episodes_change_assessments_only(tmp_path: Path) -> None:
    stages, keys = planned(tmp_path)
    _, changed = planned(tmp_path, assessment={"episodes": 5})
    changes = {name for name in keys if keys[name] != changed[name]}
    assert changes == {name for name, stage in stages.items() if isinstance(stage, AssessmentStage)}


def test_keys__significance_changes_nothing_that_is_played(tmp_path: Path) -> None:
    _, keys = planned(tmp_path)
    _, changed = planned(tmp_path, assessment={"episodes": 4, "significance": 0.2})
    assert changed == keys


def test_keys__alone_shares_change_what_follows_from_them(tmp_path: Path) -> None:
    _, keys = planned(tmp_path)
    _, changed = planned(tmp_path, retraining={"alone_share": 0.5})
    assert differing(keys, changed) == {"retrained_speedy", "retrained_vs_speedy", "retrained_alone_speedy"}
    _, changed = planned(tmp_path, non_ego_training={"alone_share": 0.5})
    assert differing(keys, changed) == of_persona("speedy")


def test_keys__training_settings_change_everything_that_was_trained(tmp_path: Path) -> None:
    _, keys = planned(tmp_path)
    _, changed = planned(tmp_path, training={"steps": 4096})
    assert not set(keys.values()) & set(changed.values())


def test_keys__do_not_depend_on_where_the_campaign_lies(tmp_path: Path) -> None:
    _, keys = planned(tmp_path / "here")
    _, moved = planned(tmp_path / "there", name="another")
    assert moved == keys


def test_keys__the_given_policy_counts(tmp_path: Path) -> None:
    ego = {"driver": "policy", "persona": str(CAREFUL)}
    write_policy(some_policy(seed=1), tmp_path / "policy")
    _, keys = planned(tmp_path, ego=ego)
    write_policy(some_policy(seed=2), tmp_path / "policy")
    _, changed = planned(tmp_path, ego=ego)
    assert not set(keys.values()) & set(changed.values())


@pytest.mark.parametrize("kind", ["scene.toml", "merge.net.xml", "merge.rou.xml"])
def test_keys__every_file_of_the_scene_counts(kind: str, tmp_path: Path) -> None:
    import shutil

    from tests.support.tiny import MERGE

    shutil.copytree(MERGE, tmp_path / "merge")
    _, keys = planned(tmp_path, scene="merge")
    with (tmp_path / "merge" / kind).open("a") as file:
        file.write("\n")
    _, changed = planned(tmp_path, scene="merge")
    assert not set(keys.values()) & set(changed.values())
