"""Carrying out one stage of the plan: its inputs from the run folder, its outputs into it.

A stage is a function of its inputs alone, which `cache_keys` hashes: done once, it is skipped.
"""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pandas as pd

from harness.campaign.execution.crash_retries import FIRST, Attempt, OnProgress, OnStart
from harness.campaign.execution.equilibrium_stop import settled
from harness.campaign.execution.player_factory import PlayerFactory
from harness.campaign.execution.run_context import RunContext
from harness.campaign.plan.best_responses import settings_of
from harness.campaign.plan.stages import AssessmentStage, ReconfigurationStage, Stage, TrainingStage
from harness.campaign.storage.manoeuvre_table import EPISODES, MANOEUVRES
from harness.campaign.storage.run_folder import RunFolder
from harness.campaign.storage.versions import versions_of_numbers
from harness.drivers.mixture import Player
from harness.drivers.policy_file import Policy, policy_files, read_policy, write_policy
from harness.errors import StageFailed
from harness.evaluation.tables import TRAINING_COLUMNS, typed, write_csv
from harness.files import make_folder, write_atomically
from harness.game.state import EGO, NON_EGO, ROLES
from harness.traffic.scene import OpenScene, open_scene


def carry_out(
    stage: Stage,
    conditions: RunContext,
    on_progress: OnProgress,
    on_start: OnStart = lambda place: None,
    attempt: Attempt = FIRST,
) -> dict[str, Any]:
    """Do a stage, seal what it made, say what came of it. What it wrote from other inputs is dropped."""
    folder, key = RunFolder(conditions.folder), conditions.keys[stage.id]
    folder.begin(stage.id, key)
    began = time.monotonic()
    gate = settled(stage, folder, conditions.document.assessment.significance)
    if gate is not None:
        info: dict[str, Any] = {"settled": gate.pair, "message": f"not needed: {gate.pair} has settled"}
        folder.finish(stage.id, key, info)
        return info
    scene = open_scene(conditions.scene_folder, conditions.vehicle_type(stage))
    do: Any = {TrainingStage: _train, AssessmentStage: _assess, ReconfigurationStage: _reconfigure}[type(stage)]
    info, files = do(stage, conditions, folder, scene, on_progress, on_start, attempt)
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
    conditions: RunContext,
    folder: RunFolder,
    scene: OpenScene,
    on_progress: OnProgress,
    on_start: OnStart,
    attempt: Attempt,
) -> tuple[dict[str, Any], list[Path]]:
    from harness.training.early_stopping import RULE
    from harness.training.ppo import TrainingSpec, train  # torch is slow to import, and assessment does without

    settings = settings_of(conditions.document, stage)
    spec = TrainingSpec(
        scene=scene,
        learner=stage.learner,
        personas=(conditions.ego_persona, conditions.persona_met(stage.persona)),
        opponent=PlayerFactory(conditions, folder, scene).player(stage.opponent),
        alone_share=stage.alone_share,
        attentive_share=stage.attentive_share,
        initial=_initial(stage, conditions, folder),
        settings=settings,
        parts=("training", stage.seed, stage.name),
        as_it_drives=bool(stage.responds_in),
    )
    learner = spec.personas[stage.learner]
    card = {
        "stage": stage.id,
        "player": ROLES[stage.learner],
        "persona": learner.name,
        "scene": scene.document.name,
        "against": stage.opponent.in_words if stage.opponent else None,
        "began_from": stage.initial or next(iter(stage.begins_as), None),
        "training": settings.model_dump(mode="json"),
    }
    key = conditions.keys[stage.id]
    checkpoint = folder.work(stage.id) / "checkpoint.safetensors"
    made_by = _made_by(checkpoint)
    try:
        trained = train(
            spec,
            checkpoint=checkpoint,
            key=key,
            card=card,
            tensorboard=folder.tensorboard(stage.id),
            on_progress=on_progress,
            on_start=on_start,
        )
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
    conditions: RunContext,
    folder: RunFolder,
    scene: OpenScene,
    on_progress: OnProgress,
    on_start: OnStart,
    attempt: Attempt,
) -> tuple[dict[str, Any], list[Path]]:
    from harness.campaign.execution.search_output import reconfigure  # Optuna is slow to import
    from harness.training.parameter_search import Search, version_of_search

    opponent = PlayerFactory(conditions, folder, scene).player(stage.opponent)
    assert opponent is not None
    other = conditions.persona_met(stage.persona)
    personas, settings = (conditions.ego_persona, other), conditions.document.reconfiguration
    named = ("reconfiguration", stage.seed, stage.name)
    search = Search(
        scene=scene, driver=conditions.given(""), personas=personas, opponent=opponent, settings=settings, parts=named
    )
    kept = folder.work(stage.id) / "trials.json"
    made_by = _made_by(kept, version_of_search())
    labels = {"stage": stage.name, "persona": stage.persona, "seed": stage.seed}
    try:
        info, files = reconfigure(search, labels, kept, folder.policy(stage.id), on_progress, on_start)
    except StageFailed as error:
        raise StageFailed(f"{stage.id}: {error}") from error
    return {**info, "versions": made_by}, files


def _assess(
    stage: AssessmentStage,
    conditions: RunContext,
    folder: RunFolder,
    scene: OpenScene,
    on_progress: OnProgress,
    on_start: OnStart,
    attempt: Attempt,
) -> tuple[dict[str, Any], list[Path]]:
    from harness.campaign.execution.arm_segments import join_segments, play_segments, segments_of
    from harness.environments.rollout import Arm  # the parent, who plays nothing, does without

    casting = PlayerFactory(conditions, folder, scene)
    personas = (conditions.ego_persona, conditions.persona(stage.non_ego.persona if stage.non_ego else ""))
    players: list[Player] = []
    chosen: dict[str, Any] = {}
    for player, planned in enumerate((stage.ego, stage.non_ego)):
        if planned is not None and planned.kind == "best":
            best, earned = casting.best(stage, personas, player)
            players.append(best)
            names = [each.stage for each in planned.members]
            chosen = {"chosen": names[earned.index(max(earned))], "earned": dict(zip(names, earned, strict=True))}
        else:
            players.append(casting.player(planned))
    arm = Arm(name=stage.arm, scene=scene, drivers=(players[EGO], players[NON_EGO]), personas=personas, seed=stage.seed)
    segments = segments_of(folder.segments(stage.id), conditions.document.assessment.episodes)
    labels = {"arm": stage.arm, "persona": stage.persona, "seed": stage.seed}
    errors = play_segments(arm, segments, labels, attempt, on_start, on_progress)
    work = folder.work(stage.id)
    files = [work / EPISODES, work / MANOEUVRES, folder.traces(stage.id)]
    join_segments(segments, *files)
    info = {"episodes": segments[-1].episodes.stop, "errors": errors, "versions": [versions_of_numbers()], **chosen}
    return info, files


def _initial(stage: TrainingStage, conditions: RunContext, folder: RunFolder) -> Policy | None:
    """The policy that a training begins from."""
    if stage.begins_as:
        return read_policy(conditions.policy_before(stage.begins_as[0]))
    return read_policy(folder.policy(stage.initial)) if stage.initial else None
