"""How long the paper's campaign takes if no training stops early, and how long one of its arms takes.

The campaign runs with a share of its training steps. The full length of each training follows from its rate; the plan
is then scheduled on two workers as the harness schedules it. Arms and the report are timed in full.
"""

from __future__ import annotations

import io
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any
from unittest.mock import patch

from rich.console import Console

from benchmarks.budget import Budget
from benchmarks.figures import Measured
from benchmarks.games import MERGE, REPOSITORY, coasting_policy, persona_file
from benchmarks.sides import LapTimer, OnProgress, Side, running_sides
from harness.campaign.execution import run_campaign as campaign_module
from harness.campaign.execution.cache_keys import stage_keys
from harness.campaign.execution.run_stage import carry_out
from harness.campaign.execution.schedule import Schedule
from harness.campaign.execution.stage_run import Event, StageRun, run_context_of
from harness.campaign.execution.worker_pool import WorkerPool
from harness.campaign.plan.plan import plan
from harness.campaign.plan.stages import Stage, TrainingStage
from harness.campaign.preflight import open_campaign
from harness.campaign.storage.run_folder import RunFolder
from harness.drivers.policy_file import write_policy

_STEPS = 3_000_000
_WORKERS = 2
_ARM = "naive_vs_paper_speedy-seed11"

_DOCUMENT = """name = "benchmark"
scene = "{scene}"
personas = ["{paper_speedy}", "{paper_distracted}"]
[ego]
persona = "{careful}"
[training]
steps = {steps}
early_convergence = false
[assessment]
episodes = {episodes}
"""


def write_document(folder: Path, steps: int, episodes: int) -> Path:
    """Write the campaign with trainings of `steps` and arms of `episodes`."""
    personas = {name: persona_file(name).as_posix() for name in ("careful", "paper_speedy", "paper_distracted")}
    file = folder / "benchmark.toml"
    text = _DOCUMENT.format(scene=MERGE.as_posix(), steps=steps, episodes=episodes, **personas)
    file.write_text(text, encoding="utf-8")
    return file


class _EventRecorder:
    """Replaces `StageProgress`: records the time of every event, and reports the progress of the campaign."""

    def __init__(self, timer: LapTimer) -> None:
        self._timer = timer
        self.stages: Sequence[Stage] = ()
        self.progress: dict[str, list[tuple[float, int]]] = {}
        """Seconds and steps of each progress event, by stage."""
        self.ended_s: dict[str, float] = {}
        self.infos: dict[str, Mapping[str, Any]] = {}

    def __call__(self, stages: Sequence[Stage], finished: int, console: Console) -> _EventRecorder:
        self.stages = stages
        return self

    def __enter__(self) -> _EventRecorder:
        return self

    def __exit__(self, *exception: object) -> None:
        """Nothing to close."""

    def show(self, event: Event) -> None:
        """Record an event. Raises RuntimeError if a stage failed."""
        if event.kind == "progress" and event.message:
            return  # it prepares: its own work has not started
        if event.kind == "progress":
            self.progress.setdefault(event.stage, []).append((time.perf_counter(), event.done))
        elif event.kind == "done":
            self.ended_s[event.stage], self.infos[event.stage] = time.perf_counter(), event.info
            self._timer.progress(len(self.ended_s) / len(self.stages))
        elif event.kind != "started":
            raise RuntimeError(f"{event.stage} {event.kind}: {event.message}")

    def tell(self, stage: Stage, status: str, message: str) -> None:
        """A remark on a stage costs nothing."""


def campaign_side(timer: LapTimer, steps: int, episodes: int) -> None:
    """One shortened campaign in one lap; the lap's values are the seconds of its parts."""
    with tempfile.TemporaryDirectory(prefix="benchmark-") as scratch:
        opened_campaign = open_campaign(write_document(Path(scratch), steps, episodes))
        recorder = _EventRecorder(timer)
        timer.ready()
        with patch.object(campaign_module, "StageProgress", recorder):
            start_s = time.perf_counter()
            folder = RunFolder(Path(scratch) / "run")
            start_workers = partial(WorkerPool, jobs=_WORKERS)
            campaign_module.run_campaign(opened_campaign, folder, start_workers, Console(file=io.StringIO()))
            end_s = time.perf_counter()
        stages = {}
        for stage in recorder.stages:
            info = recorder.infos[stage.id]
            stages[stage.id] = {"seed": stage.seed, "needs": list(stage.needs), "seconds": float(info["seconds"])}
            if isinstance(stage, TrainingStage):
                (first_s, first), *_, (last_s, last) = recorder.progress[stage.id]
                stages[stage.id] |= {"steps": info["steps"], "steps_per_s": (last - first) / (last_s - first_s)}
        report_s = end_s - max(recorder.ended_s.values())
        timer.finish_lap(1.0, stages=stages, whole_s=end_s - start_s, report_s=report_s)


@dataclass(frozen=True, kw_only=True)
class TimedStage:
    """A stage as the schedule knows it, and its measured length."""

    id: str
    seed: int
    needs: Sequence[str]
    seconds: float


def makespan_s(stages: Sequence[TimedStage], workers: int) -> float:
    """Seconds until all stages are done, on this number of workers, dispatched by the campaign's own schedule."""
    schedule, running, now_s = Schedule(stages, finished=()), dict[str, float](), 0.0
    while True:
        while len(running) < workers and (stage := schedule.take()) is not None:
            running[stage.id] = now_s + stage.seconds
        if not running:
            return now_s
        first = min(running, key=running.__getitem__)
        now_s = running.pop(first)
        schedule.done(first)


def campaign_minutes(budget: Budget, on_progress: OnProgress) -> Measured:
    """Minutes of a campaign of one naive ego, two personas and two retrainings, of 3 million steps each."""
    steps = int(_STEPS * budget.campaign_share)
    side = Side(run=campaign_side, arguments=(steps, budget.episodes))
    with running_sides({"campaign": side}, lap_s=0.0) as runners:
        values = runners["campaign"].lap(on_progress).values
    stages = []
    for name, stage in values["stages"].items():
        left_s = (_STEPS - stage["steps"]) / stage["steps_per_s"] if "steps" in stage else 0.0
        stages.append(TimedStage(id=name, seed=stage["seed"], needs=stage["needs"], seconds=stage["seconds"] + left_s))
    stages_s = makespan_s(stages, _WORKERS)
    details = {
        "extrapolated_from_share": budget.campaign_share,
        "workers": _WORKERS,
        "seconds": {stage.id: stage.seconds for stage in stages},
        "stages_minutes": stages_s / 60.0,
        "report_minutes": values["report_s"] / 60.0,
        "measured": dict(values),
    }
    return {"campaign_minutes": (stages_s + values["report_s"]) / 60.0}, details


def assessment_side(timer: LapTimer) -> None:
    """One arm as a stage of a campaign: games, records, traces and manoeuvres."""
    with tempfile.TemporaryDirectory(prefix="benchmark-") as scratch:
        campaign = open_campaign(REPOSITORY / "campaigns" / "paper_merge.toml")
        folder = RunFolder(Path(scratch) / "run")
        folder.claim(campaign.document.name)
        scene = campaign.scene.document
        folder.keep_scene(campaign.scene.folder, ("scene.toml", scene.net, scene.routes))
        stages = plan(campaign.document, [each.name for each in campaign.personas])
        context = run_context_of(campaign, folder, stage_keys(campaign, stages))
        arm = next(stage for stage in stages if stage.id == _ARM)
        for needed in arm.needs:
            write_policy(coasting_policy(), folder.policy(needed))
        run = StageRun(context=context, on_progress=lambda done, total: timer.progress(done / total))
        timer.ready()
        while True:
            info = carry_out(arm, run)
            timer.finish_lap(float(info["episodes"]))


def assessment_seconds(budget: Budget, on_progress: OnProgress) -> Measured:
    """Seconds of an arm of 100 episodes on one core: the median of several, without the first."""
    laps, times = [], budget.arms + 1
    with running_sides({"arm": Side(run=assessment_side)}, lap_s=0.0) as runners:
        for done in range(times):

            def on_progress_of_arm(share: float, done: int = done) -> None:
                on_progress((done + share) / times)

            laps.append(runners["arm"].lap(on_progress_of_arm))
    seconds = [lap.seconds for lap in laps]
    details = {"unit": "s", "episodes": laps[0].units, "first_s": seconds[0], "seconds": seconds[1:]}
    return {"assessment_seconds": median(seconds[1:])}, details
