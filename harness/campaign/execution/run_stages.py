"""Carrying a plan out: what is ready is submitted to workers, and what they report decides what follows.

It knows no processes: `Workers` has two implementations, the processes of this machine (`worker_pool`) and a Ray
cluster (`ray_workers`).

A worker that crashes affects no other: its stage continues from its last segment in another one. After `MOST_CRASHES`
crashes in the same segment a training has failed, by name, and the stages that don't need it continue; after as many in
the same game an arm continues without that game, which is an error.

Where workers are idle and no stage is ready, they help with arms that have been running for some seconds: they play
segments of their games, for some seconds at a time. A worker that crashes or fails while it helps changes nothing: the
arm's own worker plays what is missing.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from itertools import count
from typing import Protocol, TypeAlias

from harness.campaign.execution.schedule import Schedule
from harness.campaign.execution.stage_run import SEGMENT_EPISODES, Attempt, Emit, Event, Help, RunContext, Task
from harness.campaign.plan.planned_drivers import BestOf
from harness.campaign.plan.stages import AssessmentStage, PreventabilityStage, SelectionStage, Stage

MOST_CRASHES = 3
"""Crashes of one segment or game after which it is not tried again."""
HELPED_AFTER_S = 3.0
"""An arm is helped when it has run for this time: the start of a worker takes as long."""
MOST_ABANDONED = 20
"""Games of an arm that may be abandoned in one run of the command. With more, the scene is at fault and not a game."""


class Workers(Protocol):
    @property
    def capacity(self) -> int:
        """Number of tasks that they can carry out at a time now."""
        ...

    def submit(self, task: Task, attempt: Attempt) -> None:
        """Start a task. It is called only while fewer than `capacity` tasks are running."""
        ...

    def next_events(self) -> Sequence[Event]:
        """Wait until something happens to a running task; the events in their order, possibly none.

        A task ends with done, failed or crashed. After crashed, nothing of that attempt is reported any more.
        """
        ...


StartWorkers: TypeAlias = Callable[[RunContext], AbstractContextManager[Workers]]
"""Makes the workers of a run for a `with` block, from what its stages share."""


class Crashes:
    """Counts crashes by place: a segment of a training, a game of an arm, or the way there (None).

    Only the crashes of this run of the command count: where the whole command was killed, no game is to blame.
    """

    def __init__(self) -> None:
        self._attempted: set[str] = set()
        self._place: dict[str, int] = {}
        self._farthest: dict[str, int] = {}
        self._counts: Counter[tuple[str, int | None]] = Counter()
        self._abandoned: dict[str, dict[int, str]] = {}

    def next_attempt(self, stage: Stage) -> Attempt:
        first = stage.id not in self._attempted
        self._attempted.add(stage.id)
        self._place.pop(stage.id, None)
        return Attempt(first=first, abandoned=self.abandoned(stage))

    def abandoned(self, stage: Stage) -> dict[int, str]:
        """The games of an arm that are not played again, each with the reason."""
        return dict(self._abandoned.get(stage.id, {}))

    def note_start(self, stage: str, place: int) -> None:
        """A worker starts a segment, game or trial."""
        self._place[stage] = place
        if place > self._farthest.get(stage, -1):  # it got farther: crashes on the way there no longer count
            self._farthest[stage] = place
            del self._counts[stage, None]

    def note_crash(self, stage: Stage, cause: str) -> Event:
        """A worker crashed in a stage, of `cause`. Returns what this means for the stage: crashed, to be tried again,
        or failed."""
        place = self._place.get(stage.id)
        self._counts[stage.id, place] += 1
        if self._counts[stage.id, place] < MOST_CRASHES:
            return Event(kind="crashed", stage=stage.id, message=cause)
        often = f"{cause}, {MOST_CRASHES} times"
        if place is None or not isinstance(stage, AssessmentStage | SelectionStage | PreventabilityStage):
            return Event(kind="failed", stage=stage.id, message=often)
        abandoned = self._abandoned.setdefault(stage.id, {})
        abandoned[place] = often
        if len(abandoned) > MOST_ABANDONED:
            message = f"{len(abandoned)} games crashed; the last: {often}"
            return Event(kind="failed", stage=stage.id, message=message)
        return Event(kind="crashed", stage=stage.id, message=f"{often} in game {place}, which is abandoned")


class _Helping:
    """Finds the running arms that idle workers help with."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self.running: dict[str, Help] = {}
        self._since: dict[str, float] = {}
        """When each arm reported first."""
        self._left: dict[str, int] = {}
        """Games of each running arm that were not played when it last reported."""
        self._closed: set[str] = set()
        """Arms with no segment left to start, or in which a helper crashed or failed."""
        self._numbers = count(1)

    def next_help(self, stages: Iterable[Stage]) -> Help | None:
        """Help with the running arm that has most games left for each of its workers; None if no arm has a segment
        left that no worker plays. Which of several best responses an arm plays, its own worker finds out."""
        helped = Counter(each.arm.id for each in self.running.values())
        now = self._clock()
        arms = [
            each
            for each in stages
            if isinstance(each, AssessmentStage)
            and each.id not in self._closed
            and now - self._since.get(each.id, now) >= HELPED_AFTER_S
        ]
        left = {
            arm: self._left.get(arm.id, 0) / (1 + helped[arm.id])
            for arm in arms
            if not any(isinstance(driver, BestOf) for driver in arm.drivers)
        }
        arm = max(left, key=left.__getitem__, default=None)
        if arm is None or left[arm] <= SEGMENT_EPISODES:
            return None
        task = Help(arm=arm, number=next(self._numbers))
        self.running[task.id] = task
        return task

    def note_progress(self, event: Event) -> None:
        """A stage reports what it has done of its own work."""
        self._since.setdefault(event.stage, self._clock())
        self._left[event.stage] = event.total - event.done

    def note(self, event: Event, emit: Emit) -> None:
        """Something happened to a helper. One that crashed or failed is emitted as crashed: its arm goes on."""
        if event.kind in ("progress", "segment"):
            return
        arm = self.running.pop(event.stage).arm
        if not event.info.get("segments"):
            self._closed.add(arm.id)
        if event.kind != "done":
            emit(replace(event, kind="crashed"))


def run_stages(
    stages: Sequence[Stage],
    finished: Iterable[str],
    workers: Workers,
    emit: Emit,
    *,
    clock: Callable[[], float] = time.monotonic,
) -> None:
    """Carry out every stage that is not finished, each after the stages that it needs.

    Everything that happens is emitted; nothing is raised for a stage that fails.
    """
    schedule, crashes, helping = Schedule(stages, finished), Crashes(), _Helping(clock)
    running: dict[str, Stage] = {}

    def handle(event: Event) -> None:
        """Let schedule, crash counts and helpers follow an event, and emit it."""
        if event.stage in helping.running:
            helping.note(event, emit)
            return
        if event.kind == "segment":
            crashes.note_start(event.stage, event.done)
            return
        if event.kind == "crashed":
            event = crashes.note_crash(running[event.stage], event.message)
        emit(event)
        if event.kind == "progress":
            if not event.message:
                helping.note_progress(event)
            return
        stage = running.pop(event.stage)
        match event.kind:
            case "crashed":
                schedule.put_back(stage)
            case "failed":
                for skipped, failed in schedule.fail(stage.id).items():
                    emit(Event(kind="skipped", stage=skipped, message=f"needs {', '.join(failed)}, which failed"))
            case _:
                schedule.done(stage.id)

    def is_idle() -> bool:
        return len(running) + len(helping.running) < workers.capacity

    while True:
        while is_idle() and (stage := schedule.take()) is not None:
            running[stage.id] = stage
            workers.submit(stage, crashes.next_attempt(stage))
            emit(Event(kind="started", stage=stage.id))
        while is_idle() and (task := helping.next_help(running.values())) is not None:
            workers.submit(task, Attempt(first=False, abandoned=crashes.abandoned(task.arm)))
        if not running and not helping.running:
            return
        for event in workers.next_events():
            handle(event)
