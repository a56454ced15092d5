"""The judgement of failures in the plan: which arms have one, what it needs, and that it changes no other stage."""

from __future__ import annotations

from pathlib import Path

from harness.campaign.plan.stages import PreventabilityStage
from tests.support.plans import planned, stages_of


def test_plan__each_arm_of_an_ego_against_a_persona_is_judged() -> None:
    stages = stages_of("anna", assessment={"reference_drivers": True})
    judged = {name: each for name, each in stages.items() if isinstance(each, PreventabilityStage)}
    assert set(judged) == {"naive_vs_anna_preventability", "retrained_vs_anna_preventability"}
    for name, stage in judged.items():
        assert stage.needs[0] == f"{name.removesuffix('_preventability')}-seed1"


def test_keys__of_judgements_depend_on_their_arms_and_no_others_on_them(tmp_path: Path) -> None:
    _, keys = planned(tmp_path / "with", assessment={"episodes": 4, "reference_drivers": True})
    _, keys_without = planned(tmp_path / "without")
    assert {name: keys[name] for name in keys_without} == keys_without
    judged = keys.keys() - keys_without.keys()
    assert len(judged) == 2
    _, more = planned(tmp_path / "five", assessment={"episodes": 5, "reference_drivers": True})
    assert all(keys[name] != more[name] for name in judged)
