"""A run that has not ended, as far as its folder tells: its stages, the time left, and the learning curves so far."""

from __future__ import annotations

from datetime import datetime, timezone
from pathlib import Path

from harness.campaign.plan.stages import Stage, TrainingStage
from harness.campaign.plan.strategy_stages import training_settings
from harness.campaign.results.run_index import begun_once, indexed_run
from harness.campaign.storage.manifest import planned
from harness.campaign.storage.run_folder import RunFolder
from harness.campaign.storage.training_curves import CHECKPOINT, curves_so_far
from harness.config.campaign import Campaign
from harness.errors import UsageError
from harness.reports.learning import learning
from harness.reports.run_tables import RunTables
from harness.reports.running_page import RunningStage, render_running


def has_report(path: Path) -> bool:
    """Whether a run has a report, and no command is carrying out its stages."""
    return RunFolder(path).results.is_file() and indexed_run(path).state != "running"


def running_page(path: Path) -> str:
    """The page of a run that has not ended. Raises UsageError for a run that can't be read."""
    folder, run = RunFolder(path), indexed_run(path)
    if run.state == "unreadable":
        raise UsageError.of(path, "", run.problem, "restore the folder, or run the campaign again into another one")
    manifest = folder.manifest()
    stages, campaign = planned(manifest), Campaign.model_validate(manifest["campaign"], strict=False)
    training = curves_so_far(folder, stages)
    steps = {
        (stage, seed): int(most) for (stage, seed), most in training.groupby(["stage", "seed"])["steps"].max().items()
    }
    now, begun = datetime.now(timezone.utc), begun_once(path)
    shown = [
        _running(each, folder, campaign, steps.get((each.name, each.seed)), begun.get(each.id), now)
        for each in stages
        if each.id in run.running
    ]
    strategies = {each.name: each.strategy for each in stages if isinstance(each, TrainingStage)}
    learned = learning(RunTables(manifest=manifest, strategies=strategies, training=training))
    going_on = {each.name for each in stages if each.id in run.running}
    curves = sorted(learned, key=lambda curve: curve["stage"] not in going_on)
    return render_running(run, shown, manifest["stages"], curves)


def _running(
    stage: Stage, folder: RunFolder, campaign: Campaign, steps: int | None, begun: datetime | None, now: datetime
) -> RunningStage:
    """A stage that is carried out. The time left of a training is that of its whole budget, at its pace from its
    beginning to its last checkpoint; it is not known before the first one, or where the training was interrupted."""
    since_s = None if begun is None else (now - begun).total_seconds()
    if not isinstance(stage, TrainingStage):
        return RunningStage(name=stage.id, kind=stage.kind, since_s=since_s)
    budget, left_s = training_settings(campaign, stage).steps, None
    checkpoint = folder.work(stage.id) / CHECKPOINT
    if steps and begun is not None and since_s is not None and checkpoint.is_file():
        took_s = checkpoint.stat().st_mtime - begun.timestamp()
        if took_s > 0.0:
            left_s = max(took_s * budget / steps - since_s, 0.0)
    return RunningStage(name=stage.id, kind=stage.kind, since_s=since_s, steps=steps, budget=budget, left_s=left_s)
