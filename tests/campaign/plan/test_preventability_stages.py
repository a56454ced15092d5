"""The judgement of failures in the plan: which arms have one, what it needs, and that it changes no other stage."""

from __future__ import annotations

from pathlib import Path

from harness.campaign.plan.stages import PreventabilityStage
from tests.support.plans import planned

JUDGED = {"assessment": {"episodes": 4, "reference_drivers": True}}


def test_plan__each_arm_of_an_ego_against_a_persona_is_judged(tmp_path: Path) -> None:
    stages, _ = planned(tmp_path, **JUDGED)
    judged = {name: each for name, each in stages.items() if isinstance(each, PreventabilityStage)}
    assert set(judged) == {"naive_vs_speedy_preventability-seed1", "retrained_vs_speedy_preventability-seed1"}
    for name, stage in judged.items():
        assert stage.needs[0] == name.replace("_preventability", "")


def test_keys__of_other_stages_do_not_depend_on_it(tmp_path: Path) -> None:
    _, keys = planned(tmp_path / "with", **JUDGED)
    without, keys_without = planned(tmp_path / "without")
    assert not any(isinstance(each, PreventabilityStage) for each in without.values())
    assert {name: keys[name] for name in keys_without} == keys_without
    assert len(keys) == len(keys_without) + 2


def test_keys__a_judgement_depends_on_its_arm(tmp_path: Path) -> None:
    _, keys = planned(tmp_path / "four", **JUDGED)
    _, more = planned(tmp_path / "five", assessment={"episodes": 5, "reference_drivers": True})
    name = "naive_vs_speedy_preventability-seed1"
    assert keys[name] != more[name]
