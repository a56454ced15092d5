"""Carrying out one stage of the plan: its inputs from the run folder, its outputs into it.

A stage is a function of its inputs alone, and its key is the hash of them: done once, it is skipped.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pandas as pd

from harness.attempts import FIRST, Attempt, Begin, Report
from harness.documents.campaign import Campaign
from harness.documents.persona import Persona
from harness.drivers.car import car_of
from harness.drivers.given import GivenDriver
from harness.drivers.learned import LearnedDriver
from harness.drivers.protocol import Driver
from harness.drivers.sumo import SumoDriver
from harness.errors import StageFailed
from harness.files import make_folder, write_atomically
from harness.game.state import EGO, ROLES
from harness.manoeuvre_file import EPISODES, MANOEUVRES
from harness.policy_file import policy_files, read_policy, write_policy
from harness.preflight import OpenCampaign
from harness.rounds import AssessmentStage, Drives, ReconfigurationStage, Stage, TrainingStage
from harness.run_folder import RunFolder
from harness.tables import TRAINING_COLUMNS, typed, write_csv
from harness.traffic.opening import OpenScene, open_scene
from harness.versions import NUMBERS_FORMAT, versions_of_numbers


@dataclass(frozen=True)
class Conditions:
    """What all stages of a run share; small enough to be sent to another process."""

    folder: Path
    scene_folder: Path
    document: Campaign
    ego_persona: Persona
    personas: Mapping[str, Persona]
    ego_driver: GivenDriver | None
    policies: Path | None
    keys: Mapping[str, str]  # of every stage

    def persona(self, name: str) -> Persona:
        """A persona of the campaign; the ego's own for the empty name."""
        return self.personas[name] if name else self.ego_persona


def stage_keys(campaign: OpenCampaign, stages: Sequence[Stage]) -> dict[str, str]:
    """Each stage's key: the hash of all that its numbers depend on, through the stages it needs."""
    scene = campaign.scene.document
    files = ("scene.toml", scene.net, scene.routes)
    rests_on = {name: campaign.hash_of(campaign.scene.folder / name) for name in files}
    personas = {"": campaign.ego_persona, **{each.name: each for each in campaign.personas}}
    given = campaign.ego_driver.identity if campaign.ego_driver is not None else ""
    keys: dict[str, str] = {}
    for stage in stages:
        inputs: dict[str, Any] = {
            "format": NUMBERS_FORMAT,
            "stage": asdict(stage),
            "scene": rests_on,
            "personas": [personas[name].model_dump(mode="json") for name in dict.fromkeys(("", stage.persona))],
            "needs": [keys[name] for name in stage.needs],
            "given": given,
        }
        if isinstance(stage, TrainingStage):
            inputs["training"] = campaign.document.training.model_dump(mode="json")
        else:
            if isinstance(stage, ReconfigurationStage):
                assert campaign.ego_driver is not None
                inputs["reconfiguration"] = campaign.document.reconfiguration.model_dump(mode="json")
                inputs["tunable"] = campaign.ego_driver.searched
            else:
                inputs["episodes"] = campaign.document.assessment.episodes
            if campaign.policies is not None:
                files_of = {name: policy_files(campaign.policies / name) for name in stage.reads}
                inputs["policies"] = {
                    name: [campaign.hash_of(file) for file in files] for name, files in files_of.items()
                }
        keys[stage.id] = hashlib.sha256(json.dumps(inputs, sort_keys=True).encode()).hexdigest()
    return keys


def conditions_of(campaign: OpenCampaign, folder: RunFolder, keys: Mapping[str, str]) -> Conditions:
    """The conditions of a run of a campaign: on the run folder's copy of the scene, which stays what it was."""
    personas = {each.name: each for each in campaign.personas}
    return Conditions(
        folder.path,
        folder.scene,
        campaign.document,
        campaign.ego_persona,
        personas,
        campaign.ego_driver,
        campaign.policies,
        keys,
    )


def carry_out(
    stage: Stage,
    conditions: Conditions,
    report: Report,
    begin: Begin = lambda place: None,
    attempt: Attempt = FIRST,
) -> dict[str, Any]:
    """Do a stage, seal what it made, say what came of it. What it wrote from other inputs is dropped."""
    folder, key = RunFolder(conditions.folder), conditions.keys[stage.id]
    folder.begin(stage.id, key)
    scene = open_scene(conditions.scene_folder, conditions.ego_driver.vehicle_type if conditions.ego_driver else None)
    began = time.monotonic()
    do: Any = {TrainingStage: _train, AssessmentStage: _assess, ReconfigurationStage: _reconfigure}[type(stage)]
    info, files = do(stage, conditions, folder, scene, report, begin, attempt)
    info["seconds"] = round(time.monotonic() - began, 1)
    folder.finish(stage.id, key, info, files)
    if not info.get("errors"):  # failures are not kept: the next run tries those games again, and only those segments
        folder.drop_segments(stage.id)
    return info


def _made_by(checkpoint: Path, besides: Mapping[str, str] = MappingProxyType({})) -> list[dict[str, str]]:
    """The versions that a training or a search is made by: more than one, if it went on where others had stopped."""
    file, now = checkpoint.with_name("versions.json"), {**versions_of_numbers(), **besides}
    try:
        before = json.loads(file.read_text(encoding="utf-8")) if checkpoint.is_file() else []
    except (OSError, ValueError):
        before = []
    made_by = [*before, now] if isinstance(before, list) and now not in before else before or [now]
    write_atomically(file, json.dumps(made_by).encode())
    return made_by


def _train(
    stage: TrainingStage,
    conditions: Conditions,
    folder: RunFolder,
    scene: OpenScene,
    report: Report,
    begin: Begin,
    attempt: Attempt,
) -> tuple[dict[str, Any], list[Path]]:
    from harness.convergence import RULE
    from harness.training import Lesson, train  # torch is slow to import, and assessment does without

    settings = conditions.document.training
    lesson = Lesson(
        scene,
        stage.learner,
        (conditions.ego_persona, conditions.persona(stage.persona)),
        _driver(stage.opponent, conditions, folder, scene),
        stage.alone_share,
        stage.attentive_share,
        read_policy(folder.policy(stage.initial)) if stage.initial else None,
        settings,
        ("training", stage.seed, stage.name),
    )
    learner = lesson.personas[stage.learner]
    card = {
        "stage": stage.id,
        "player": ROLES[stage.learner],
        "persona": learner.name,
        "scene": scene.document.name,
        "against": stage.opponent.stage or stage.opponent.kind if stage.opponent else None,
        "began_from": stage.initial,
        "training": settings.model_dump(mode="json"),
    }
    key = conditions.keys[stage.id]
    checkpoint = folder.work(stage.id) / "checkpoint.safetensors"
    made_by = _made_by(checkpoint)
    try:
        trained = train(lesson, checkpoint, key, card, folder.tensorboard(stage.id), report, begin)
    except (FloatingPointError, ValueError) as error:
        raise StageFailed(f"{stage.id}: {error}") from error
    make_folder(folder.policy(stage.id))
    write_policy(trained.policy, folder.policy(stage.id))
    curve = pd.DataFrame([asdict(window) for window in trained.progress.curve])
    curve = curve.assign(stage=stage.name, persona=stage.persona, seed=stage.seed)
    table = folder.work(stage.id) / "training.csv"
    write_csv(typed(curve.reindex(columns=list(TRAINING_COLUMNS))), table)
    info = {
        "steps": trained.progress.steps,
        "budget_steps": settings.steps,
        "stopped": trained.stopped,
        "rule": RULE if settings.early_convergence else "",
        "versions": made_by,
    }
    return info, [*policy_files(folder.policy(stage.id)), table]


def _reconfigure(
    stage: ReconfigurationStage,
    conditions: Conditions,
    folder: RunFolder,
    scene: OpenScene,
    report: Report,
    begin: Begin,
    attempt: Attempt,
) -> tuple[dict[str, Any], list[Path]]:
    from harness.reconfiguration import Search, version_of_search
    from harness.reconfigured import reconfigure  # Optuna is slow to import

    opponent, given = _driver(stage.opponent, conditions, folder, scene), conditions.ego_driver
    assert opponent is not None
    assert given is not None
    personas = (conditions.ego_persona, conditions.persona(stage.persona))
    settings = conditions.document.reconfiguration
    search = Search(scene, given, personas, opponent, settings, ("reconfiguration", stage.seed, stage.name))
    kept = folder.work(stage.id) / "trials.json"
    made_by = _made_by(kept, version_of_search())
    labels = {"stage": stage.name, "persona": stage.persona, "seed": stage.seed}
    try:
        info, files = reconfigure(search, labels, kept, folder.policy(stage.id), report, begin)
    except StageFailed as error:
        raise StageFailed(f"{stage.id}: {error}") from error
    return {**info, "versions": made_by}, files


def _assess(
    stage: AssessmentStage,
    conditions: Conditions,
    folder: RunFolder,
    scene: OpenScene,
    report: Report,
    begin: Begin,
    attempt: Attempt,
) -> tuple[dict[str, Any], list[Path]]:
    from harness.assessment import Arm  # the parent, who plays nothing, does without
    from harness.segments import join_segments, play_segments, segments_of

    drivers = tuple(_driver(each, conditions, folder, scene) for each in (stage.ego, stage.non_ego))
    habits = stage.non_ego.persona if stage.non_ego else ""
    personas = (conditions.ego_persona, conditions.persona(habits))
    arm = Arm(stage.arm, scene, drivers, personas, stage.seed)  # type: ignore[arg-type]
    segments = segments_of(folder.segments(stage.id), conditions.document.assessment.episodes)
    labels = {"arm": stage.arm, "persona": stage.persona, "seed": stage.seed}
    errors = play_segments(arm, segments, labels, attempt, begin, report)
    work = folder.work(stage.id)
    files = [work / EPISODES, work / MANOEUVRES, folder.traces(stage.id)]
    join_segments(segments, *files)
    info = {"episodes": segments[-1].episodes.stop, "errors": errors, "versions": [versions_of_numbers()]}
    return info, files


def _driver(drives: Drives | None, conditions: Conditions, folder: RunFolder, scene: OpenScene) -> Driver | None:
    if drives is None:
        return None
    if drives.kind == "sumo":
        return SumoDriver()
    sampled = conditions.persona(drives.persona).decisions == "sampled"
    if drives.kind in ("given", "reconfigured"):
        given = conditions.ego_driver
        assert given is not None
        if drives.kind == "reconfigured":
            from harness.reconfigured import read_found

            given = read_found(given, folder.policy(drives.stage))
        return given.make(car_of(scene.world, EGO), sampled)
    return LearnedDriver(read_policy(_policy(drives, conditions, folder)), sampled)


def _policy(drives: Drives, conditions: Conditions, folder: RunFolder) -> Path:
    if drives.kind == "before":
        assert conditions.policies is not None
        return conditions.policies / drives.stage
    return folder.policy(drives.stage)
