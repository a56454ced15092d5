"""A stage's key: the hash of everything that its numbers depend on.

A stage and its drivers are hashed as their records show themselves, documents as their JSON values. A change of either
changes keys: finished stages are then carried out again.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from harness.assessment.continuation import Continuation
from harness.campaign.plan.planned_drivers import (
    BestOf,
    External,
    Shielded,
    Shipped,
    borrowed_of,
    members_of,
    persona_of,
)
from harness.campaign.plan.stages import (
    AssessmentStage,
    ConditioningStage,
    EquilibriumGate,
    PreventabilityStage,
    SearchStage,
    SelectionStage,
    Stage,
    TrainingStage,
    plays_with_errors,
)
from harness.campaign.plan.strategy_stages import training_settings
from harness.campaign.preflight import OpenCampaign
from harness.campaign.storage.checksums import digest_of
from harness.campaign.storage.run_folder import JUDGED, TAKEN_OVER
from harness.drivers.policy_file import policy_files
from harness.drivers.reference_drivers import reference_identity


def stage_keys(campaign: OpenCampaign, stages: Sequence[Stage]) -> dict[str, str]:
    """Each stage's key. It covers what the stage reads itself, and the keys of the stages that it needs."""
    shared: dict[str, Any] = {
        "scene": campaign.hashes_of(campaign.scene),
        "ego_driver": campaign.ego_driver.identity if campaign.ego_driver is not None else "",
    }
    keys: dict[str, str] = {}
    for stage in stages:
        inputs = {**shared, **_inputs(campaign, stage), "needs": [keys[name] for name in stage.needs]}
        keys[stage.id] = digest_of(inputs)
    return keys


def _inputs(campaign: OpenCampaign, stage: Stage) -> dict[str, Any]:
    """What one stage's numbers depend on, beside the scene and other stages."""
    document = campaign.document
    personas = {"": campaign.ego_persona, **campaign.people}
    learners = stage.personas if isinstance(stage, TrainingStage) else (stage.persona,)
    own = [each for each in learners if each in personas]
    players = members_of(*(stage.opponent if isinstance(stage, TrainingStage | SearchStage) else stage.drivers))
    givers = [borrowed.of for each in players if (borrowed := borrowed_of(each)) is not None]
    names = dict.fromkeys(["", *own, *map(persona_of, players), *givers])
    people = [personas[name].model_dump(mode="json", exclude={"unlike_people"}) for name in names]  # it changes no game
    inputs: dict[str, Any] = {"stage": repr(stage), "personas": people}
    match stage:
        case TrainingStage():
            inputs["training"] = training_settings(document, stage).record()
            if stage.learns_on_roads and campaign.roads:
                inputs["roads"] = [campaign.hashes_of(each) for each in campaign.roads]
            if any(isinstance(each, Shipped) for each in players):
                files = {name: [file for each in of for file in each.files] for name, of in campaign.shipped.items()}
                inputs["shipped"] = {name: [campaign.hash_of(file) for file in each] for name, each in files.items()}
            if stage.best_known is not None:
                inputs["regret"] = {"best_known": repr(stage.best_known), "references": reference_identity()}
        case ConditioningStage():
            pass  # the policy that it derives from is one of its needs
        case SearchStage():
            assert campaign.ego_driver is not None
            inputs["reconfiguration"] = document.reconfiguration.record()
            inputs["tunable"] = campaign.ego_driver.searched
        case PreventabilityStage():
            inputs["references"] = reference_identity()
            inputs["continuations"] = [each.value for each in Continuation]
            inputs["tables"] = [JUDGED, TAKEN_OVER]
        case _:
            inputs["episodes"] = document.assessment.episodes
    if isinstance(stage, AssessmentStage | SelectionStage | PreventabilityStage) and stage.seed != document.start_seed:
        inputs["start_seed"] = document.start_seed  # that of the first training seed is in the stage
    if campaign.policies is not None and stage.reads:
        others = campaign.policy_drivers
        read = {name: policy_files(campaign.policies / name) for name in stage.reads if name not in others}
        inputs["policies"] = {name: [campaign.hash_of(file) for file in each] for name, each in read.items()}
        inputs["policies"] |= {name: others[name].identity for name in stage.reads if name in others}
    named = {each.name for each in members_of(*stage.drivers) if isinstance(each, External)}
    if crossplay := sorted(named - {""}):
        inputs["others"] = {name: campaign.other_egos[name].identity for name in crossplay}
    if document.ego.perception_errors is not None and plays_with_errors(stage):
        inputs["perception"] = repr(document.ego.perception_errors)
    if any(isinstance(each, Shielded) for each in stage.drivers):
        inputs["shield"] = reference_identity()["rss"]
    if any(isinstance(each, BestOf) for each in stage.drivers):
        inputs["choice_episodes"] = document.assessment.episodes
    if any(isinstance(gate, EquilibriumGate) for gate in stage.gates):
        inputs["significance"] = document.assessment.significance
        inputs["competence"] = document.competence.record()
    return inputs
