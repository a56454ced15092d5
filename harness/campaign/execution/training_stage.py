"""Carrying out a training: a policy, its card and its learning curve."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pandas as pd

from harness.campaign.execution.player_factory import PlayerFactory
from harness.campaign.execution.stage_run import StageRun
from harness.campaign.plan.planned_drivers import SumoDriven, description, driver_in
from harness.campaign.plan.stages import TrainingStage
from harness.campaign.plan.strategy_stages import training_settings
from harness.campaign.storage.training_curves import CHECKPOINT
from harness.campaign.storage.versions import versions_since
from harness.config.persona import Persona
from harness.drivers.policy_file import persona_hash, policy_files, read_policy, write_policy
from harness.drivers.policy_of_many import card_of_many
from harness.drivers.policy_origin import origin_card
from harness.errors import StageFailed
from harness.evaluation.tables import table_of, write_csv
from harness.game.roles import EGO, ROLES
from harness.road.scene.open_scene import OpenScene
from harness.training.early_stopping import RULE, failing_roads
from harness.training.ppo import train
from harness.training.training_games import LearningPlace, TrainingSpec


def carry_out_training(stage: TrainingStage, run: StageRun, scene: OpenScene) -> tuple[dict[str, Any], list[Path]]:
    """Train a player; the facts, and the files of policy and learning curve.

    Raises as `PlayerFactory.player` does, StageFailed where the training itself fails.
    """
    folder, spec = run.context.folder, _spec(stage, run, scene)
    checkpoint = folder.work(stage.id) / CHECKPOINT
    versions = versions_since(checkpoint)
    try:
        result = train(
            spec,
            checkpoint=checkpoint,
            key=run.context.keys[stage.id],
            card=_policy_card(stage, spec),
            tensorboard=folder.tensorboard(stage.id),
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
    failing = failing_roads(result.progress.alone_games, result.progress.alone_failures)
    if further := [road for road in _roads(spec) if road in failing]:
        facts["failing_roads"] = further
    write_policy(result.policy, folder.policy(stage.id))
    curve = pd.DataFrame([asdict(point) for point in result.progress.curve])
    ends = [*[""] * (len(curve) - 1), result.stopped][: len(curve)]  # the reason for the end is in the last row
    curve = curve.assign(stage=stage.name, persona=stage.persona, seed=stage.seed, stopped=ends)
    table = folder.work(stage.id) / "training.csv"
    write_csv(table_of("training", curve.to_dict("records")), table)
    return facts, [*policy_files(folder.policy(stage.id)), table]


def _spec(stage: TrainingStage, run: StageRun, scene: OpenScene) -> TrainingSpec:
    context, players = run.context, PlayerFactory(context=run.context, scene=scene)
    return TrainingSpec(
        personas=(context.ego_persona,) if stage.learner == EGO else tuple(map(context.persona, stage.personas)),
        places=(*_places(stage, players), *_places_on_roads(stage, run)),
        alone_share=stage.alone_share,
        attentive_share=stage.attentive_share,
        initial=read_policy(players.policy_folder(stage.initial)) if stage.initial is not None else None,
        settings=training_settings(context.document, stage),
        parts=("training", stage.seed, stage.name),
        as_it_drives=stage.is_best_response,
        best_known=players.driver(stage.best_known) if stage.best_known is not None else None,
    )


def _places(stage: TrainingStage, players: PlayerFactory) -> tuple[LearningPlace, ...]:
    """Where the learner drives. An ego has one place, and one more for games beside SUMO's driver if it meets others as
    well. A person learns in every place of the non-egos in turn: the other places are driven by SUMO, which no persona
    has trained."""
    if stage.learner == EGO:
        return tuple(
            LearningPlace(scene=players.scene, player=EGO, drivers=(None, *people), share=share)
            for people, share in players.sides(stage.opponent)
        )
    places = []
    for learner in range(1, len(players.scene.world.roles)):
        drivers = [players.player(driver_in(stage.opponent, 0)), *players.people((SumoDriven(),))]
        drivers[learner] = None
        places.append(LearningPlace(scene=players.scene, player=learner, drivers=tuple(drivers)))
    return tuple(places)


def _places_on_roads(stage: TrainingStage, run: StageRun) -> Iterator[LearningPlace]:
    for road in run.context.open_roads(stage):
        yield from _places(stage, PlayerFactory(context=run.context, scene=road))


def _roads(spec: TrainingSpec) -> list[str]:
    """The further scenes on which it learns; each may have two places."""
    names = dict.fromkeys(each.scene.document.name for each in spec.places)
    return [name for name in names if name != spec.scene.document.name]


def _persona_card(personas: tuple[Persona, ...]) -> dict[str, Any]:
    if len(personas) == 1:
        return {"persona": personas[0].name, "persona_sha256": persona_hash(personas[0])}
    return card_of_many(personas)


def _policy_card(stage: TrainingStage, spec: TrainingSpec) -> dict[str, Any]:
    roads = _roads(spec)
    return {
        "stage": stage.id,
        "player": ROLES[stage.learner],
        **_persona_card(spec.personas),
        **origin_card(spec.scene.document, spec.scene.world, stage.learner),
        "people": len(spec.scene.document.non_ego),
        **({"roads": roads} if roads else {}),
        "against": " and ".join(map(description, stage.opponent)) or None,
        "began_from": stage.initial.stage if stage.initial is not None else None,
        "alone_share": stage.alone_share,
        "attentive_share": stage.attentive_share,
        "training": {**spec.settings.model_dump(mode="json"), "demonstration_steps": spec.demonstration_steps},
    }
