"""What campaigns would take, from their plans and the measured times of `make bench`."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from benchmarks.campaign import TimedStage, makespan_s
from harness.campaign.execution.worker_pool import cores
from harness.campaign.plan.stages import AssessmentStage, SelectionStage, Stage, TrainingStage
from harness.campaign.plan.strategy_stages import training_settings
from harness.campaign.preflight import OpenCampaign, open_campaign

_HOUR_S = 3600.0


def cost_table(campaigns: Sequence[Path], root: Path) -> str:
    """A row per campaign: trainings, steps, arms, core-hours, hours on this machine's cores; and their sum.

    Trainings count with their whole budget, although they may stop earlier, arms of rejected answers although the
    answers may be taken, and stages that a run folder has already count as well.
    """
    results = json.loads((root / "benchmarks" / "results.json").read_text(encoding="utf-8"))
    steps_per_s, arm_s = _rates(results)
    lines = [
        f"| campaign | trainings | steps | arms | core-hours | hours on {cores()} cores |",
        "| --- | ---: | ---: | ---: | ---: | ---: |",
    ]
    core_h = wall_h = 0.0
    for path in campaigns:
        campaign = open_campaign(path, policies_exist=False)  # an earlier step may make them
        stages = campaign.stages
        seconds = {stage.id: _seconds(campaign, stage, steps_per_s, arm_s) for stage in stages}
        timed = [TimedStage(id=each.id, seed=each.seed, needs=each.needs, seconds=seconds[each.id]) for each in stages]
        trainings = [each for each in stages if isinstance(each, TrainingStage)]
        steps = sum(training_settings(campaign.document, each).steps for each in trainings)
        own_h, own_wall_h = sum(seconds.values()) / _HOUR_S, makespan_s(timed, cores()) / _HOUR_S
        core_h, wall_h = core_h + own_h, wall_h + own_wall_h
        arms = sum(isinstance(each, AssessmentStage) for each in stages)
        name = path.relative_to(root).as_posix()
        lines.append(f"| {name} | {len(trainings)} | {steps / 1e6:.1f} M | {arms} | {own_h:.1f} | {own_wall_h:.1f} |")
    lines.append(f"| all | | | | {core_h:.1f} | {wall_h:.1f} |")
    return "\n".join(lines)


def _rates(results: dict[str, object]) -> tuple[float, float]:
    """Training steps/s of one of two workers, and seconds of an arm's episode."""
    details: dict[str, dict[str, dict[str, dict[str, dict[str, float]]]]] = results["details"]  # type: ignore[assignment]
    stages = details["campaign"]["measured"]["stages"].values()
    rates = [stage["steps_per_s"] for stage in stages if "steps_per_s" in stage]
    arms = [stage["seconds"] for stage in stages if "steps_per_s" not in stage]
    return sum(rates) / len(rates), sum(arms) / len(arms) / 100


def _seconds(campaign: OpenCampaign, stage: Stage, steps_per_s: float, episode_s: float) -> float:
    match stage:
        case TrainingStage():
            return training_settings(campaign.document, stage).steps / steps_per_s
        case AssessmentStage():
            return campaign.document.assessment.episodes * episode_s
        case SelectionStage(candidates=candidates):
            return len(candidates) * campaign.document.assessment.episodes * episode_s
        case _:  # a search: trials of so many games each
            search = campaign.document.reconfiguration
            return search.trials * search.games * episode_s
