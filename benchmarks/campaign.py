"""How long the paper's campaign takes where no training stops early, and how long one arm of it.

The campaign is run with a share of its training steps; from the rate of each training its whole length follows, and
the plan is laid out on two workers as the harness lays it out. Arms and the report are timed whole.
"""

from __future__ import annotations

import io
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Any
from unittest.mock import patch

from rich.console import Console

from benchmarks.budget import Budget
from benchmarks.games import MERGE, REPOSITORY, coasting_policy, persona_file
from benchmarks.sides import Pace, Side, Tell, opened
from harness.campaign.execution import run_campaign as campaign_run
from harness.campaign.execution.cache_keys import stage_keys
from harness.campaign.execution.run_context import run_context_of
from harness.campaign.execution.run_stage import carry_out
from harness.campaign.execution.worker_pool import Event
from harness.campaign.plan.plan import plan
from harness.campaign.plan.stages import Stage, TrainingStage
from harness.campaign.preflight import open_campaign
from harness.campaign.storage.run_folder import RunFolder
from harness.drivers.policy_file import write_policy

_STEPS = 3_000_000
_WORKERS = 2
_ARM = "naive_vs_speedy-seed1"

_DOCUMENT = """name = "benchmark"
scene = "{scene}"
personas = ["{speedy}", "{distracted}"]
[ego]
persona = "{careful}"
[training]
steps = {steps}
early_convergence = false
[assessment]
episodes = {episodes}
"""


def _write_document(folder: Path, steps: int, episodes: int) -> Path:
    people = {name: persona_file(name).as_posix() for name in ("careful", "speedy", "distracted")}
    file = folder / "benchmark.toml"
    text = _DOCUMENT.format(scene=MERGE.as_posix(), steps=steps, episodes=episodes, **people)
    file.write_text(text, encoding="utf-8")
    return file


class _Watch:
    """Stands where a campaign shows its progress: notes what happened when, and passes on how far it is."""

    def __init__(self, pace: Pace) -> None:
        self._pace = pace
        self.stages: Sequence[Stage] = ()
        self.seen: dict[str, list[tuple[float, int]]] = {}  # seconds and steps
        self.ended_s: dict[str, float] = {}
        self.infos: dict[str, Mapping[str, Any]] = {}

    def __call__(self, stages: Sequence[Stage], finished: int, console: Console) -> _Watch:
        self.stages = stages
        return self

    def __enter__(self) -> _Watch:
        return self

    def __exit__(self, *exception: object) -> None:
        """Nothing was opened."""

    def tell(self, event: Event) -> None:
        """Note an event. Raises RuntimeError where a stage failed."""
        if event.kind == "progress":
            self.seen.setdefault(event.stage, []).append((time.perf_counter(), event.done))
        elif event.kind == "done":
            self.ended_s[event.stage], self.infos[event.stage] = time.perf_counter(), event.info
            self._pace.tell(len(self.ended_s) / len(self.stages))
        elif event.kind != "started":
            raise RuntimeError(f"{event.stage} {event.kind}: {event.message}")


def campaign_side(pace: Pace, steps: int, episodes: int) -> None:
    """One campaign, shortened; what it brings are the seconds of its parts."""
    with tempfile.TemporaryDirectory(prefix="benchmark-") as scratch:
        opened_campaign = open_campaign(_write_document(Path(scratch), steps, episodes))
        watch = _Watch(pace)
        pace.begin()
        with patch.object(campaign_run, "StageProgress", watch):
            began = time.perf_counter()
            folder = RunFolder(Path(scratch) / "run")
            campaign_run.run_campaign(opened_campaign, folder, _WORKERS, Console(file=io.StringIO()))
            ended = time.perf_counter()
        stages = {}
        for stage in watch.stages:
            info, seen = watch.infos[stage.id], watch.seen[stage.id]
            stages[stage.id] = {"needs": list(stage.needs), "seconds": float(info["seconds"])}
            if isinstance(stage, TrainingStage):
                (first_s, first), (last_s, last) = seen[0], seen[-1]
                stages[stage.id] |= {"steps": info["steps"], "steps_per_s": (last - first) / (last_s - first_s)}
        pace.lap(1.0, stages=stages, whole_s=ended - began, report_s=ended - max(watch.ended_s.values()))


def laid_out(stages: Mapping[str, tuple[float, Sequence[str]]], workers: int) -> float:
    """Seconds until all stages (their seconds, and what they need) are done: whoever is free takes, of what can be
    done, that which most others wait for, as `harness.campaign.execution.worker_pool` hands it out."""
    waiting, running, done = dict(stages), dict[str, float](), set[str]()
    now = 0.0
    while waiting or running:
        while len(running) < workers:
            ready = [name for name, (_, needs) in waiting.items() if set(needs) <= done]
            if not ready:
                break
            name = max(ready, key=lambda one: sum(one in needs for _, needs in waiting.values()))
            running[name] = now + waiting.pop(name)[0]
        first = min(running, key=lambda one: running[one])
        now = running.pop(first)
        done.add(first)
    return now


def campaign_minutes(budget: Budget, tell: Tell) -> tuple[dict[str, float], dict[str, Any]]:
    """Minutes of a campaign of one naive ego, two personas and two retrainings, of 3 million steps each."""
    steps = int(_STEPS * budget.campaign_share)
    with opened({"campaign": Side(campaign_side, (steps, budget.episodes))}, 0.0) as runners:
        values = runners["campaign"].lap(tell).values
    lengths: dict[str, tuple[float, Sequence[str]]] = {}
    for name, stage in values["stages"].items():
        left_s = (_STEPS - stage["steps"]) / stage["steps_per_s"] if "steps" in stage else 0.0
        lengths[name] = (stage["seconds"] + left_s, stage["needs"])
    stages_s = laid_out(lengths, _WORKERS)
    details = {
        "extrapolated_from_share": budget.campaign_share,
        "workers": _WORKERS,
        "seconds": {name: seconds for name, (seconds, _) in lengths.items()},
        "stages_minutes": stages_s / 60.0,
        "report_minutes": values["report_s"] / 60.0,
        "measured": dict(values),
    }
    return {"campaign_minutes": (stages_s + values["report_s"]) / 60.0}, details


def assessment_side(pace: Pace) -> None:
    """One arm, as a stage of a campaign plays, records and names its games."""
    with tempfile.TemporaryDirectory(prefix="benchmark-") as scratch:
        campaign = open_campaign(REPOSITORY / "campaigns" / "merge.toml")
        folder = RunFolder(Path(scratch) / "run")
        folder.claim(campaign.document.name)
        scene = campaign.scene.document
        folder.keep_scene(campaign.scene.folder, ("scene.toml", scene.net, scene.routes))
        stages = plan(campaign.document, [each.name for each in campaign.personas])
        conditions = run_context_of(campaign, folder, stage_keys(campaign, stages))
        arm = next(stage for stage in stages if stage.id == _ARM)
        for needed in arm.needs:
            write_policy(coasting_policy(), folder.policy(needed))
        pace.begin()
        while True:
            info = carry_out(arm, conditions, lambda done, total: pace.tell(done / total))
            pace.lap(float(info["episodes"]))


def assessment_seconds(budget: Budget, tell: Tell) -> tuple[dict[str, float], dict[str, Any]]:
    """Seconds for an arm of 100 episodes on one core: the median of several, the first one left out."""
    laps, times = [], budget.arms + 1
    with opened({"arm": Side(assessment_side)}, 0.0) as runners:
        for done in range(times):

            def tell_of_all(share: float, done: int = done) -> None:
                tell((done + share) / times)

            laps.append(runners["arm"].lap(tell_of_all))
    seconds = [lap.seconds for lap in laps]
    details = {"unit": "s", "episodes": laps[0].units, "first_s": seconds[0], "seconds": seconds[1:]}
    return {"assessment_seconds": median(seconds[1:])}, details
