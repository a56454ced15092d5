"""Carrying out one stage: its inputs are read from the run folder, its outputs written into it.

A stage is a function of its inputs alone, which `cache_keys` hashes: a stage that is done is skipped.
"""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeAlias

from harness.campaign.execution.crash_retries import FIRST, Attempt, OnProgress, OnStart
from harness.campaign.execution.equilibrium_stop import equilibrium_before
from harness.campaign.execution.people import learning_places, people_of
from harness.campaign.execution.run_context import RunContext
from harness.campaign.plan.budgets import training_settings
from harness.campaign.plan.planned_drivers import BestOf, SumoDriven, description, persona_of
from harness.campaign.plan.stages import AssessmentStage, PreventabilityStage, SearchStage, Stage, TrainingStage
from harness.campaign.storage.run_folder import RunFolder
from harness.campaign.storage.versions import versions_of_numbers
from harness.config.training import Training
from harness.drivers.mixture import Player
from harness.drivers.policy_file import persona_hash, policy_files, read_policy, write_policy
from harness.errors import StageFailed
from harness.files import make_folder, write_atomically
from harness.game.roles import ROLES
from harness.traffic.scene import OpenScene, open_scene

if TYPE_CHECKING:
    from harness.campaign.execution.player_factory import PlayerFactory
    from harness.environments.rollout import Arm

_LOGGER = logging.getLogger("harness.preparation")

Made: TypeAlias = tuple[dict[str, Any], list[Path]]
"""What a stage made: facts for the manifest, and the files that its numbers are read from."""


@dataclass(frozen=True, kw_only=True)
class StageRun:
    """What a stage is carried out with."""

    context: RunContext
    folder: RunFolder
    scene: OpenScene
    on_progress: OnProgress
    on_start: OnStart
    attempt: Attempt

    @property
    def people(self) -> int:
        """The number of people of the scene."""
        return len(self.scene.world.roles) - 1

    @property
    def players(self) -> PlayerFactory:
        """Makes the stage's players."""
        from harness.campaign.execution.player_factory import PlayerFactory  # imports statistics

        return PlayerFactory(context=self.context, folder=self.folder, scene=self.scene)


def carry_out(
    stage: Stage,
    context: RunContext,
    on_progress: OnProgress,
    on_start: OnStart = lambda place: None,
    attempt: Attempt = FIRST,
) -> dict[str, Any]:
    """Carry out a stage and write the checksums of what it made. Returns the facts for the manifest.

    What the stage wrote from other inputs is removed first.
    """
    folder, key = RunFolder(context.folder), context.keys[stage.id]
    folder.begin(stage.id, key)
    started = time.monotonic()
    gate = equilibrium_before(stage, folder, context.document.assessment.significance)
    if gate is not None:
        message = f"not needed: {gate.pair} is an approximate equilibrium"
        info: dict[str, Any] = {"settled": gate.pair, "message": message}
        folder.finish(stage.id, key, info)
        return info
    run = StageRun(
        context=context,
        folder=folder,
        scene=open_scene(context.scene_folder, context.vehicle_type(stage)),
        on_progress=on_progress,
        on_start=on_start,
        attempt=attempt,
    )
    match stage:
        case TrainingStage():
            info, files = _train(stage, run)
        case AssessmentStage():
            info, files = _assess(stage, run)
        case SearchStage():
            info, files = _search(stage, run)
        case PreventabilityStage():
            info, files = _judge(stage, run)
    info["seconds"] = round(time.monotonic() - started, 1)
    info["finished_on"] = time.strftime("%Y-%m-%d", time.gmtime())
    folder.finish(stage.id, key, info, files)
    if not info.get("errors"):  # the segments of failed games are kept: the next run of the command plays those again
        folder.drop_segments(stage.id)
    return info


def _train(stage: TrainingStage, run: StageRun) -> Made:
    _LOGGER.info("loading PyTorch")
    import pandas as pd

    from harness.evaluation.tables import TRAINING_COLUMNS, typed, write_csv
    from harness.training.early_stopping import RULE  # torch is slow to import, and assessment does without
    from harness.training.ppo import train
    from harness.training.training_games import TrainingSpec

    context, folder = run.context, run.folder
    settings = training_settings(context.document, stage)
    several = run.people > 1
    spec = TrainingSpec(
        scene=run.scene,
        learner=stage.learner,
        personas=(context.ego_persona, context.opponent_persona(stage.persona)),
        opponent=None if several else run.players.player(stage.opponent),
        places=learning_places(stage, run.players, run.people) if several else (),
        alone_share=stage.alone_share,
        attentive_share=stage.attentive_share,
        initial=read_policy(run.players.policy_folder(stage.initial)) if stage.initial is not None else None,
        settings=settings,
        parts=("training", stage.seed, stage.name),
        as_it_drives=stage.is_best_response,
    )
    card = _policy_card(stage, spec, settings) | ({"people": run.people} if several else {})
    checkpoint = folder.work(stage.id) / "checkpoint.safetensors"
    versions = _versions_since(checkpoint)
    try:
        trained = train(
            spec,
            checkpoint=checkpoint,
            key=context.keys[stage.id],
            card=card,
            tensorboard=folder.tensorboard(stage.id),
            on_progress=run.on_progress,
            on_start=run.on_start,
        )
    except (FloatingPointError, ValueError) as error:
        raise StageFailed(f"{stage.id}: {error}") from error
    make_folder(folder.policy(stage.id))
    write_policy(trained.policy, folder.policy(stage.id))
    curve = pd.DataFrame([asdict(point) for point in trained.progress.curve])
    ends = [*[""] * (len(curve) - 1), trained.stopped][: len(curve)]
    curve = curve.assign(stage=stage.name, persona=stage.persona, seed=stage.seed, stopped=ends)
    table = folder.work(stage.id) / "training.csv"
    write_csv(typed(curve.reindex(columns=list(TRAINING_COLUMNS))), table)
    info = {
        "steps": trained.progress.steps,
        "budget_steps": settings.steps,
        "stopped": trained.stopped,
        "rule": RULE if settings.early_convergence else "",
        "versions": versions,
    }
    return info, [*policy_files(folder.policy(stage.id)), table]


def _policy_card(stage: TrainingStage, spec: Any, settings: Training) -> dict[str, Any]:
    """What `policy.json` says of how a policy came about."""
    persona = spec.personas[stage.learner]
    return {
        "stage": stage.id,
        "player": ROLES[stage.learner],
        "persona": persona.name,
        "persona_sha256": persona_hash(persona),
        "scene": spec.scene.document.name,
        "against": description(stage.opponent) if stage.opponent is not None else None,
        "began_from": stage.initial.stage if stage.initial is not None else None,
        "training": settings.model_dump(mode="json"),
    }


def _search(stage: SearchStage, run: StageRun) -> Made:
    from harness.campaign.execution.search_output import reconfigure  # Optuna is slow to import
    from harness.training.parameter_search import Search, version_of_search

    context, folder = run.context, run.folder
    people = people_of(stage.opponent, run.players, run.people)
    search = Search(
        scene=run.scene,
        driver=context.external_driver(),
        personas=(context.ego_persona, context.opponent_persona(stage.persona)),
        opponent=tuple(each for each in people if each is not None),
        settings=context.document.reconfiguration,
        parts=("reconfiguration", stage.seed, stage.name),
    )
    trials = folder.work(stage.id) / "trials.json"
    versions = _versions_since(trials, version_of_search())
    labels = {"stage": stage.name, "persona": stage.persona, "seed": stage.seed}
    try:
        info, files = reconfigure(
            search,
            labels=labels,
            trials_file=trials,
            folder=folder.policy(stage.id),
            on_progress=run.on_progress,
            on_start=run.on_start,
        )
    except StageFailed as error:
        raise StageFailed(f"{stage.id}: {error}") from error
    return {**info, "versions": versions}, files


def _assess(stage: AssessmentStage, run: StageRun) -> Made:
    from harness.campaign.execution.arm_segments import join_segments, play_segments, segments_of
    from harness.campaign.storage.manoeuvre_table import EPISODES, MANOEUVRES
    from harness.campaign.storage.trace_tables import make_tables

    context, folder = run.context, run.folder
    if run.people > 1:
        arm, choice = _arm_of_several(stage, run), dict[str, Any]()
    else:
        arm, choice = _arm_of_two(stage, run)
    segments = segments_of(folder.segments(stage.id), context.document.assessment.episodes)
    labels: dict[str, str | int] = {"arm": stage.name, "persona": stage.persona, "seed": stage.seed}
    callbacks = run.on_start, run.on_progress
    errors = play_segments(arm, segments, labels, run.attempt, *callbacks, keep_going=context.keep_going)
    work = folder.work(stage.id)
    files = [work / EPISODES, work / MANOEUVRES, folder.traces(stage.id)]
    join_segments(segments, files[0], files[1], files[2], labels)
    files += make_tables(folder, stage.id, run.scene)
    episodes = segments[-1].episodes.stop
    facts = {"episodes": episodes, "errors": errors, "versions": [versions_of_numbers()], **choice}
    return facts | _goals_alone(stage, work / EPISODES), files


def _judge(stage: PreventabilityStage, run: StageRun) -> Made:
    from harness.campaign.execution.preventability import JudgedArm, judge_failures

    seatless = replace(stage.of, ego=SumoDriven())  # the reference drivers have the ego's seat
    arm = _arm_of_several(seatless, run) if run.people > 1 else _arm_of_two(seatless, run)[0]
    work = JudgedArm(folder=run.folder, stage=stage, arm=arm, attempt=run.attempt)
    return judge_failures(work, run.on_start, run.on_progress)


def _arm_of_two(stage: AssessmentStage, run: StageRun) -> tuple[Arm, dict[str, Any]]:
    """The arm, and which driver was chosen for a best response."""
    from harness.environments.rollout import Arm  # the parent process plays nothing and does without

    context = run.context
    non_ego_persona = persona_of(stage.non_ego) if stage.non_ego is not None else ""
    personas = (context.ego_persona, context.persona(non_ego_persona))
    drivers: list[Player] = []
    choice: dict[str, Any] = {}
    for player, planned in enumerate(stage.drivers):
        if isinstance(planned, BestOf):
            best, made = run.players.choose(stage, personas, player)
            drivers.append(best)
            choice = {
                "chosen": made.stages[made.best],
                "earned": dict(zip(made.stages, made.mean_payoffs, strict=True)),
            }
        else:
            drivers.append(run.players.player(planned))
    arm = Arm(name=stage.name, scene=run.scene, drivers=tuple(drivers), personas=personas, seed=stage.seed)
    return arm, choice


def _arm_of_several(stage: AssessmentStage, run: StageRun) -> Arm:
    from harness.environments.rollout import Arm

    drivers = (run.players.player(stage.ego), *people_of(stage.non_ego, run.players, run.people))
    personas = (run.context.ego_persona,) * len(drivers)  # each driver of a person brings its own
    return Arm(name=stage.name, scene=run.scene, drivers=drivers, personas=personas, seed=stage.seed)


def _goals_alone(stage: AssessmentStage, episodes: Path) -> dict[str, int]:
    """How often the player of an arm reached its goal, if it drives alone: whether its training succeeded."""
    if None not in stage.drivers:
        return {}
    from harness.evaluation.competence import goals_alone
    from harness.evaluation.tables import read_csv

    return goals_alone(read_csv(episodes), "ego" if stage.ego is not None else "non_ego").record()


def _versions_since(checkpoint: Path, also: Mapping[str, str] = MappingProxyType({})) -> list[dict[str, str]]:
    """The versions that make a training or search: several, if it continues what other versions started."""
    file, now = checkpoint.with_name("versions.json"), {**versions_of_numbers(), **also}
    try:
        before = json.loads(file.read_text(encoding="utf-8")) if checkpoint.is_file() else []
    except (OSError, ValueError):
        before = []
    versions = [*before, now] if isinstance(before, list) and now not in before else before or [now]
    write_atomically(file, json.dumps(versions).encode())
    return versions
