"""Carrying out a training: a policy, its card and its learning curve."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import pandas as pd

from harness.campaign.execution.player_factory import PlayerFactory
from harness.campaign.execution.stage_run import Made, StageInputs, versions_since
from harness.campaign.plan.budgets import training_settings
from harness.campaign.plan.planned_drivers import SumoDriven, description
from harness.campaign.plan.stages import TrainingStage
from harness.drivers.policy_file import persona_hash, policy_files, read_policy, write_policy
from harness.errors import StageFailed
from harness.evaluation.tables import table_of, write_csv
from harness.files import make_folder
from harness.game.roles import EGO, ROLES
from harness.training.early_stopping import RULE
from harness.training.ppo import TrainingResult, train
from harness.training.training_games import LearningPlace, TrainingSpec


def carry_out_training(stage: TrainingStage, inputs: StageInputs) -> Made:
    """Train a player. Raises as `PlayerFactory.player` does, StageFailed where the training itself fails."""
    run, spec = inputs.run, _spec(stage, inputs)
    checkpoint = run.folder.work(stage.id) / "checkpoint.safetensors"
    versions = versions_since(checkpoint)
    try:
        result = train(
            spec,
            checkpoint=checkpoint,
            key=run.context.keys[stage.id],
            card=_policy_card(stage, spec),
            tensorboard=run.folder.tensorboard(stage.id),
            on_progress=run.on_progress,
            on_start=run.on_start,
        )
    except (FloatingPointError, ValueError) as error:
        raise StageFailed(f"{stage.id}: {error}") from error
    facts = {
        "steps": result.progress.steps,
        "budget_steps": spec.settings.steps,
        "stopped": result.stopped,
        "rule": RULE if spec.settings.early_convergence else "",
        "versions": versions,
    }
    return Made(facts=facts, files=_write(stage, inputs, result))


def _spec(stage: TrainingStage, inputs: StageInputs) -> TrainingSpec:
    context, players = inputs.run.context, PlayerFactory.of(inputs)
    return TrainingSpec(
        scene=inputs.scene,
        persona=context.ego_persona if stage.learner == EGO else context.persona(stage.persona),
        places=_places(stage, players),
        alone_share=stage.alone_share,
        attentive_share=stage.attentive_share,
        initial=read_policy(players.policy_folder(stage.initial)) if stage.initial is not None else None,
        settings=training_settings(context.document, stage),
        parts=("training", stage.seed, stage.name),
        as_it_drives=stage.is_best_response,
    )


def _places(stage: TrainingStage, players: PlayerFactory) -> tuple[LearningPlace, ...]:
    """Where the learner drives. An ego has one place. A person learns in every place of the non-egos in turn: the other
    places are driven by SUMO, which no persona has trained."""
    if stage.learner == EGO:
        return (LearningPlace(player=EGO, drivers=(None, *players.people(stage.opponent))),)
    places = []
    for learner in range(1, len(players.scene.world.roles)):
        drivers = [players.ego(stage.opponent), *players.people((SumoDriven(),))]
        drivers[learner] = None
        places.append(LearningPlace(player=learner, drivers=tuple(drivers)))
    return tuple(places)


def _policy_card(stage: TrainingStage, spec: TrainingSpec) -> dict[str, Any]:
    """What `policy.json` says of how a policy came about."""
    return {
        "stage": stage.id,
        "player": ROLES[stage.learner],
        "persona": spec.persona.name,
        "persona_sha256": persona_hash(spec.persona),
        "scene": spec.scene.document.name,
        "people": len(spec.scene.document.non_ego),
        "against": " and ".join(map(description, stage.opponent)) or None,
        "began_from": stage.initial.stage if stage.initial is not None else None,
        "training": spec.settings.model_dump(mode="json"),
    }


def _write(stage: TrainingStage, inputs: StageInputs, result: TrainingResult) -> list[Path]:
    """Write the policy and the learning curve, with the reason for the end in its last row."""
    folder = inputs.run.folder
    make_folder(folder.policy(stage.id))
    write_policy(result.policy, folder.policy(stage.id))
    curve = pd.DataFrame([asdict(point) for point in result.progress.curve])
    ends = [*[""] * (len(curve) - 1), result.stopped][: len(curve)]
    curve = curve.assign(stage=stage.name, persona=stage.persona, seed=stage.seed, stopped=ends)
    table = folder.work(stage.id) / "training.csv"
    write_csv(table_of("training", curve.to_dict("records")), table)
    return [*policy_files(folder.policy(stage.id)), table]
