"""Carrying out a conditioning: the policy of one persona, from the policy that several learned together."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from harness.campaign.execution.player_factory import PlayerFactory
from harness.campaign.execution.stage_run import StageRun
from harness.campaign.plan.stages import ConditioningStage
from harness.drivers.policy_file import persona_hash, policy_files, write_policy
from harness.drivers.policy_of_many import as_persona, read_policy_of_many
from harness.road.scene.open_scene import OpenScene


def carry_out_conditioning(
    stage: ConditioningStage, run: StageRun, scene: OpenScene
) -> tuple[dict[str, Any], list[Path]]:
    """Write the policy of a persona; the facts of the training that it comes from, and the policy's files.

    Raises UsageError if the policy of all personas can't be read.
    """
    context, players = run.context, PlayerFactory(context=run.context, scene=scene)
    of_many, persona = read_policy_of_many(players.policy_folder(stage.of)), context.persona(stage.persona)
    policy, made = as_persona(of_many, stage.persona), context.folder.policy(stage.id)
    named = {"stage": stage.id, "persona": persona.name, "persona_sha256": persona_hash(persona)}
    of_all = {"learned_in": stage.of.stage, "learned_with": list(of_many.card["personas"])}
    write_policy(replace(policy, card={**policy.card, **named, **of_all}), made)
    facts: dict[str, Any] = {"learned_in": stage.of.stage}
    if (training := context.folder.done(stage.of.stage)) is not None:  # it is one of this run
        facts |= {key: training["info"][key] for key in ("steps", "budget_steps", "stopped", "rule", "versions")}
    return facts, list(policy_files(made))
