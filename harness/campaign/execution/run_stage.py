"""Carrying out one stage: its inputs are read from the run folder, its outputs written into it.

A stage is a function of its inputs alone, which `cache_keys` hashes: a stage that is done is skipped.
"""

from __future__ import annotations

import logging
import time
from typing import Any

from harness.campaign.execution.equilibrium_stop import equilibrium_before
from harness.campaign.execution.stage_run import Made, StageInputs, StageRun
from harness.campaign.plan.stages import AssessmentStage, PreventabilityStage, SearchStage, Stage, TrainingStage
from harness.traffic.scene import open_scene


def carry_out(stage: Stage, run: StageRun) -> dict[str, Any]:
    """Carry out a stage and write the checksums of what it made. Returns the facts for the manifest.

    What the stage wrote from other inputs is removed first.
    """
    folder, key, started = run.folder, run.context.keys[stage.id], time.monotonic()
    folder.begin(stage.id, key)
    gate = equilibrium_before(stage, folder, run.context.document.assessment.significance)
    if gate is not None:
        message = f"not needed: {gate.pair} is an approximate equilibrium"
        settled: dict[str, Any] = {"settled": gate.pair, "message": message}
        folder.finish(stage.id, key, settled)
        return settled
    scene = open_scene(run.context.scene_folder, run.context.vehicle_type(stage))
    made = _make(stage, StageInputs(run=run, scene=scene))
    seconds, today = round(time.monotonic() - started, 1), time.strftime("%Y-%m-%d", time.gmtime())
    facts = {**made.facts, "seconds": seconds, "finished_on": today}
    folder.finish(stage.id, key, facts, made.files)
    if not facts.get("errors"):  # the segments of failed games are kept: the next run of the command plays those again
        folder.drop_segments(stage.id)
    return facts


def _make(stage: Stage, inputs: StageInputs) -> Made:
    """Make what a stage makes. Each kind imports what it needs: PyTorch and Optuna are slow to import."""
    match stage:
        case TrainingStage():
            logging.getLogger("harness.preparation").info("loading PyTorch")
            from harness.campaign.execution.training_stage import carry_out_training

            return carry_out_training(stage, inputs)
        case AssessmentStage():
            from harness.campaign.execution.assessment_stage import carry_out_assessment

            return carry_out_assessment(stage, inputs)
        case SearchStage():
            from harness.campaign.execution.search_stage import carry_out_search

            return carry_out_search(stage, inputs)
        case PreventabilityStage():
            from harness.campaign.execution.preventability_stage import carry_out_preventability

            return carry_out_preventability(stage, inputs)
