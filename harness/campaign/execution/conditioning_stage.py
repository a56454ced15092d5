"""Carrying out a conditioning: the policy of one persona, from the policy that several learned together."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from harness.campaign.execution.stage_run import StageRun
from harness.campaign.plan.stages import ConditioningStage
from harness.drivers.policy_file import persona_hash, policy_files, read_policy, write_policy
from harness.drivers.policy_of_many import as_persona, layout_of_many
from harness.errors import StageFailed
from harness.files import make_folder


def carry_out_conditioning(stage: ConditioningStage, run: StageRun) -> tuple[dict[str, Any], list[Path]]:
    """Write the policy of a persona; the facts of the training that it comes from, and the policy's files.

    Raises UsageError if the policy of all personas can't be read, StageFailed if its training is not done.
    """
    folder, persona = run.context.folder, run.context.persona(stage.persona)
    training = folder.done(stage.of.stage)
    if training is None:
        raise StageFailed(f"{stage.id}: {stage.of.stage} is not done")
    of_many = read_policy(folder.policy(stage.of.stage), layout_of_many(stage.together))
    policy = as_persona(of_many, stage.together.index(stage.persona))
    shared = {key: value for key, value in policy.card.items() if key != "personas"}
    named = {"stage": stage.id, "persona": persona.name, "persona_sha256": persona_hash(persona)}
    of_all = {"learned_in": stage.of.stage, "learned_with": list(stage.together)}
    make_folder(folder.policy(stage.id))
    write_policy(replace(policy, card={**shared, **named, **of_all}), folder.policy(stage.id))
    facts = {key: training["info"][key] for key in ("steps", "budget_steps", "stopped", "rule", "versions")}
    return facts, list(policy_files(folder.policy(stage.id)))
