"""A stage's key: the hash of everything that its numbers depend on.

What is hashed is written out here, apart from the records of the plan: renaming a field changes no key.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from typing import Any

from harness.campaign.plan.budgets import demonstrator_speed_share, training_settings
from harness.campaign.plan.planned_drivers import (
    BestOf,
    Crowd,
    EquilibriumMixture,
    External,
    Mixture,
    PlannedDriver,
    Reconfigured,
    SumoDriven,
    Trained,
    TrainedBefore,
    members_of,
    persona_of,
)
from harness.campaign.plan.stages import AssessmentStage, PreventabilityStage, SearchStage, Stage, TrainingStage
from harness.campaign.preflight import OpenCampaign
from harness.campaign.storage.versions import NUMBERS_FORMAT
from harness.drivers.policy_file import policy_files
from harness.drivers.reference_drivers import reference_identity
from harness.evaluation.strategies import BestResponse


def stage_keys(campaign: OpenCampaign, stages: Sequence[Stage]) -> dict[str, str]:
    """Each stage's key. It covers what the stage reads itself, and the keys of the stages that it needs."""
    scene = campaign.scene.document
    files = {name: campaign.hash_of(campaign.scene.folder / name) for name in scene.files}
    shared: dict[str, Any] = {
        "format": NUMBERS_FORMAT,
        "scene": files,
        "given": campaign.ego_driver.identity if campaign.ego_driver is not None else "",
    }
    if campaign.scene.world.hiding.vehicles:  # scenes without tall vehicles keep the keys of earlier versions
        shared["sight"] = "tall vehicles hide"
    keys: dict[str, str] = {}
    for stage in stages:
        inputs = {**shared, **_inputs(campaign, stage), "needs": [keys[name] for name in stage.needs]}
        keys[stage.id] = hashlib.sha256(json.dumps(inputs, sort_keys=True).encode()).hexdigest()
    return keys


def _inputs(campaign: OpenCampaign, stage: Stage) -> dict[str, Any]:
    """What one stage's numbers depend on, beside the scene and other stages."""
    document = campaign.document
    inputs: dict[str, Any] = {"stage": _stage(stage), "personas": _personas(campaign, stage)}
    match stage:
        case TrainingStage():
            inputs["training"] = training_settings(document, stage).model_dump(mode="json")
            if (share := demonstrator_speed_share(document, stage)) != 1.0:  # others keep the keys of earlier versions
                inputs["demonstrator_speed_share"] = share
        case SearchStage():
            assert campaign.ego_driver is not None
            inputs["reconfiguration"] = document.reconfiguration.model_dump(mode="json")
            inputs["tunable"] = campaign.ego_driver.searched
        case AssessmentStage():
            inputs["episodes"] = document.assessment.episodes
        case PreventabilityStage():
            inputs["references"] = reference_identity()
            inputs["prevented"] = "goal without breaking a rule"
    if campaign.policies is not None and stage.reads:
        others = campaign.policy_drivers
        read = {name: policy_files(campaign.policies / name) for name in stage.reads if name not in others}
        inputs["policies"] = {name: [campaign.hash_of(file) for file in each] for name, each in read.items()}
        inputs["policies"] |= {name: others[name].identity for name in stage.reads if name in others}
    drivers = [each for driver in stage.drivers for each in members_of(driver)]
    if crossplay := sorted({each.name for each in drivers if isinstance(each, External) and each.name}):
        inputs["others"] = {name: campaign.other_egos[name].identity for name in crossplay}
    if any(isinstance(each, BestOf) for each in stage.drivers) and document.best_response is not None:
        inputs["choice_episodes"] = document.best_response.choice_episodes
    if stage.gates:
        inputs["significance"] = document.assessment.significance
        inputs["competence"] = document.competence.model_dump(mode="json")
    return inputs


def _personas(campaign: OpenCampaign, stage: Stage) -> list[Any]:
    """The documents of the ego's persona, the stage's own, and those of its drivers, each once."""
    personas = {"": campaign.ego_persona, **{each.name: each for each in campaign.personas}}
    own = [stage.persona] if stage.persona in personas else []
    players = (stage.opponent,) if isinstance(stage, TrainingStage | SearchStage) else stage.drivers
    names = ["", *own, *(persona_of(each) for driver in players for each in members_of(driver))]
    return [personas[name].identity() for name in dict.fromkeys(names)]


def _stage(stage: Stage) -> dict[str, Any]:
    described: dict[str, Any] = {"seed": stage.seed, "persona": stage.persona}
    if stage.gates:
        described["unless"] = [
            {"pair": each.pair, "ego_response": each.ego_response, "non_ego_response": each.non_ego_response}
            for each in stage.gates
        ]
    match stage:
        case TrainingStage(strategy=strategy, initial=initial):
            described |= {
                "name": stage.name,
                "learner": stage.learner,
                "opponent": _driver(stage.opponent),
                "initial": initial.stage if isinstance(initial, Trained) else None,
                "alone_share": stage.alone_share,
                "attentive_share": stage.attentive_share,
            }
            if isinstance(strategy, BestResponse):
                described["responds_in"] = [strategy.arm.pair.name]
            if isinstance(initial, TrainedBefore):
                described["begins_as"] = [initial.stage]
        case AssessmentStage():
            described |= {"arm": stage.name, "ego": _driver(stage.ego), "non_ego": _driver(stage.non_ego)}
        case SearchStage():
            described |= {"name": stage.name, "opponent": _driver(stage.opponent)}
        case PreventabilityStage():
            described |= {"name": stage.name}
    return described


def _driver(driver: PlannedDriver | None) -> dict[str, Any] | None:
    match driver:
        case None:
            return None
        case SumoDriven():
            return {"kind": "sumo", "stage": "", "persona": ""}
        case External(name=name):
            return {"kind": "given", "stage": name, "persona": ""}
        case Reconfigured(stage=stage):
            return {"kind": "reconfigured", "stage": stage, "persona": ""}
        case Trained(stage=stage, persona=persona):
            return {"kind": "policy", "stage": stage, "persona": persona}
        case TrainedBefore(stage=stage, persona=persona):
            return {"kind": "before", "stage": stage, "persona": persona}
        case Mixture(members=members, shares=shares):
            several = {"kind": "mixture", "stage": "", "persona": "", "members": [_driver(each) for each in members]}
            return several | {"shares": list(shares)}
        case Crowd(members=members):
            return {"kind": "crowd", "stage": "", "persona": "", "members": [_driver(each) for each in members]}
        case EquilibriumMixture(members=members, arms=arms):
            several = {"kind": "mixture", "stage": "", "persona": "", "members": [_driver(each) for each in members]}
            return several | {"weighed_by": [list(row) for row in arms]}
        case BestOf(members=members, persona=persona):
            return {"kind": "best", "stage": "", "persona": persona, "members": [_driver(each) for each in members]}
