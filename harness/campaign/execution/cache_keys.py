"""A stage's key: the hash of all that its numbers depend on."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from typing import Any

from harness.campaign.plan.best_responses import settings_of
from harness.campaign.plan.stages import AssessmentStage, Drives, ReconfigurationStage, Stage, TrainingStage
from harness.campaign.preflight import OpenCampaign
from harness.campaign.storage.versions import NUMBERS_FORMAT
from harness.drivers.policy_file import policy_files


def stage_keys(campaign: OpenCampaign, stages: Sequence[Stage]) -> dict[str, str]:
    """Each stage's key: the hash of all that its numbers depend on, through the stages it needs."""
    document, scene = campaign.document, campaign.scene.document
    files = ("scene.toml", scene.net, scene.routes)
    rests_on = {name: campaign.hash_of(campaign.scene.folder / name) for name in files}
    personas = {"": campaign.ego_persona, **{each.name: each for each in campaign.personas}}
    given = campaign.ego_driver.identity if campaign.ego_driver is not None else ""
    keys: dict[str, str] = {}
    for stage in stages:
        players = list(_players(stage))
        names = ("", *([stage.persona] if stage.persona in personas else []), *(each.persona for each in players))
        inputs: dict[str, Any] = {
            "format": NUMBERS_FORMAT,
            "stage": _without_unused(asdict(stage)),
            "scene": rests_on,
            "personas": [personas[name].identity() for name in dict.fromkeys(names)],
            "needs": [keys[name] for name in stage.needs],
            "given": given,
        }
        if isinstance(stage, TrainingStage):
            inputs["training"] = settings_of(document, stage).model_dump(mode="json")
        elif isinstance(stage, ReconfigurationStage):
            assert campaign.ego_driver is not None
            inputs["reconfiguration"] = document.reconfiguration.model_dump(mode="json")
            inputs["tunable"] = campaign.ego_driver.searched
        else:
            inputs["episodes"] = document.assessment.episodes
        if campaign.policies is not None and (reads := stage.reads):
            files_of = {name: policy_files(campaign.policies / name) for name in reads}
            inputs["policies"] = {name: [campaign.hash_of(file) for file in each] for name, each in files_of.items()}
        if others := sorted({each.stage for each in players if each.kind == "given" and each.stage}):
            inputs["others"] = {name: campaign.other_egos[name].identity for name in others}
        if any(each.kind == "best" for each in _seats(stage)) and document.best_response is not None:
            inputs["choice_episodes"] = document.best_response.choice_episodes
        if stage.unless:
            inputs["significance"] = document.assessment.significance
        keys[stage.id] = hashlib.sha256(json.dumps(inputs, sort_keys=True).encode()).hexdigest()
    return keys


def _seats(stage: Stage) -> Iterable[Drives]:
    planned = (stage.ego, stage.non_ego) if isinstance(stage, AssessmentStage) else (stage.opponent,)
    return [each for each in planned if each is not None]


def _players(stage: Stage) -> Iterable[Drives]:
    return [each for seat in _seats(stage) for each in seat.everyone]


def _without_unused(described: Any) -> Any:
    """Leave out what is empty: a stage that does not use what a later version can do keeps its key."""
    if isinstance(described, dict):
        return {name: _without_unused(value) for name, value in described.items() if value != ()}
    return [_without_unused(each) for each in described] if isinstance(described, tuple) else described
