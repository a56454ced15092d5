"""Carrying out one stage: its inputs are read from the run folder, its outputs written into it.

A stage is a function of its inputs alone, which `cache_keys` hashes: a stage that is done is skipped. Where an
approximate equilibrium is reached, later stages have nothing to do: no player's best response gains anything
distinguishable from 0. A pair of which a player can't drive the scene alone is in none, nor is one of which a search
lacks power: that no training found anything better shows nothing. Stages about rejected answers have nothing to do
where the selection took the answer.
"""

from __future__ import annotations

import logging
import shutil
import time
from pathlib import Path
from typing import Any

from harness.campaign.execution.stage_run import Help, StageRun, Task
from harness.campaign.plan.stages import (
    AssessmentStage,
    ConditioningStage,
    EquilibriumGate,
    Gate,
    PreventabilityStage,
    RejectionGate,
    SearchStage,
    SelectionStage,
    Stage,
    TrainingStage,
)
from harness.campaign.storage.run_folder import RunFolder
from harness.config.campaign import Campaign
from harness.road.scene.open_scene import OpenScene


def carry_out(task: Task, run: StageRun) -> dict[str, Any]:
    """Carry out a stage, or help with one. Returns the facts for the manifest, or of the help."""
    if not isinstance(task, Help):
        return _carry_out_stage(task, run)
    from harness.campaign.execution.assessment_stage import help_with_arm

    return help_with_arm(task.arm, run, run.context.open_scene(task.arm))


def _carry_out_stage(stage: Stage, run: StageRun) -> dict[str, Any]:
    """Carry out a stage and write the checksums of what it made. Returns the facts for the manifest.

    What the stage wrote from other inputs is removed first.
    """
    context, key, started_s = run.context, run.context.keys[stage.id], time.monotonic()
    folder = context.folder
    folder.begin(stage.id, key)
    match closed_gate_before(stage, folder, context.document):
        case EquilibriumGate(pair=pair):
            return _leave(stage, folder, key, pair, f"{pair} is an approximate equilibrium")
        case RejectionGate(answer=answer):
            return _leave(stage, folder, key, answer, f"{answer} was taken, and no answer was rejected")
    facts, files = _make(stage, run, context.open_scene(stage))
    facts["seconds"] = round(time.monotonic() - started_s, 1)
    facts["finished_on"] = time.strftime("%Y-%m-%d", time.gmtime())
    folder.finish(stage.id, key, facts, files)
    if not facts.get("errors"):  # the segments of failed games are kept: the next run of the command plays those again
        shutil.rmtree(folder.segments(stage.id), ignore_errors=True)
    return facts


def _leave(stage: Stage, folder: RunFolder, key: str, settled: str, reason: str) -> dict[str, Any]:
    """Mark a stage as finished, with nothing to do."""
    facts = {"settled": settled, "message": f"not needed: {reason}"}
    folder.finish(stage.id, key, facts)
    return facts


def _make(stage: Stage, run: StageRun, scene: OpenScene) -> tuple[dict[str, Any], list[Path]]:
    """Make what a stage makes: facts for the manifest, and the files that its numbers are read from.

    Each kind imports what it needs: PyTorch and Optuna are slow to import.
    """
    match stage:
        case TrainingStage():
            logging.getLogger("harness.preparation").info("loading PyTorch")
            from harness.campaign.execution.training_stage import carry_out_training

            return carry_out_training(stage, run, scene)
        case ConditioningStage():
            from harness.campaign.execution.conditioning_stage import carry_out_conditioning

            return carry_out_conditioning(stage, run, scene)
        case AssessmentStage():
            from harness.campaign.execution.assessment_stage import carry_out_assessment

            return carry_out_assessment(stage, run, scene)
        case SearchStage():
            from harness.campaign.execution.search_stage import carry_out_search

            return carry_out_search(stage, run, scene)
        case SelectionStage():
            from harness.campaign.execution.selection_stage import carry_out_selection

            return carry_out_selection(stage, run, scene)
        case PreventabilityStage():
            from harness.campaign.execution.preventability_stage import carry_out_preventability

            return carry_out_preventability(stage, run, scene)


def closed_gate_before(stage: Stage, folder: RunFolder, campaign: Campaign) -> Gate | None:
    """The first gate of a stage that leaves it nothing to do; None if the stage has to be carried out."""
    return next((gate for gate in stage.gates if _is_closed(gate, stage, folder, campaign)), None)


def _is_closed(gate: Gate, stage: Stage, folder: RunFolder, campaign: Campaign) -> bool:
    match gate:
        case RejectionGate(selection=selection, answer=answer):
            record = folder.done(selection)
            return record is not None and record["info"].get("chosen") == answer
        case EquilibriumGate():
            return _is_equilibrium(gate, stage, folder, campaign)


def _is_equilibrium(gate: EquilibriumGate, stage: Stage, folder: RunFolder, campaign: Campaign) -> bool:
    """Whether a gate's pair is an approximate equilibrium.

    The searched best responses alone decide. The campaign's other strategies, which count in `gaps.csv`, may be made
    later than this stage: by them the result would depend on the order of the stages.
    """
    search = campaign.best_response
    assert search is not None, "only a campaign with best responses has gates"
    import pandas as pd  # slow to import, and few stages have gates

    from harness.campaign.storage.arm_tables import arm_tables
    from harness.evaluation.game_theory.best_response_gap import Response, Role, gaps, nothing_to_gain

    episodes = pd.concat([arm_tables(folder, each).episodes for each in gate.stages], ignore_index=True)
    pair, *responses = (str(name) for name in episodes["arm"].unique()[:3])
    roles: tuple[Role, Role] = ("ego", "non_ego")
    asked = [
        Response(
            seed=stage.seed,
            role=role,
            persona=stage.persona,
            round=0,
            pair_arm=pair,
            response_arm=arm,
            ego="",
            non_ego="",
            search_steps=search.steps,
            search_starts=search.starts,
            alone=gate.bounds,
        )
        for role, arm in zip(roles, responses, strict=True)
    ]
    return nothing_to_gain(gaps(asked, episodes, campaign.assessment.significance))
