"""Carrying a plan out: what is ready is submitted to workers, and what they report decides what follows.

It knows no processes: `Workers` has two implementations, the processes of this machine (`worker_pool`) and a Ray
cluster (`ray_workers`).

A worker that crashes affects no other: its stage continues from its last segment in another one. After `MOST_CRASHES`
crashes in the same segment a training has failed, by name, and the stages that don't need it continue; after as many in
the same game an arm continues without that game, which is an error.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from types import TracebackType
from typing import Protocol, TypeAlias

from harness.campaign.execution.crash_retries import Crashes
from harness.campaign.execution.run_context import RunContext
from harness.campaign.execution.schedule import Schedule
from harness.campaign.execution.stage_events import Emit, Event
from harness.campaign.execution.stage_run import Attempt
from harness.campaign.plan.stages import Stage


class Workers(Protocol):
    """What carries stages out. Workers exist inside the `with` block; none is left after it, however it ends."""

    @property
    def capacity(self) -> int:
        """Number of stages that they can carry out at a time now."""
        ...

    def submit(self, stage: Stage, attempt: Attempt) -> None:
        """Start a stage. It is called only while fewer than `capacity` stages are running."""
        ...

    def next_events(self) -> Sequence[Event]:
        """Wait until something happens to a running stage; the events in their order, possibly none.

        A stage ends with done, failed or crashed. After crashed, nothing of that attempt is reported any more.
        """
        ...

    def __enter__(self) -> Workers: ...
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None: ...


StartWorkers: TypeAlias = Callable[[RunContext, int], Workers]
"""Makes the workers of a run, from what its stages share and the number of stages that are left."""


def run_stages(stages: Sequence[Stage], finished: Iterable[str], workers: Workers, emit: Emit) -> None:
    """Carry out every stage that is not finished, each after the stages that it needs.

    Everything that happens is emitted; nothing is raised for a stage that fails. Raises PlanError where the stages
    can't all be carried out in some order.
    """
    run = _Run(stages, finished, emit)
    with workers:
        while True:
            run.dispatch(workers)
            if not run.running:
                return
            for event in workers.next_events():
                run.handle(event)


class _Run:
    """The stages that are running, and what their events mean for the others."""

    def __init__(self, stages: Sequence[Stage], finished: Iterable[str], emit: Emit) -> None:
        self.running: dict[str, Stage] = {}
        self._schedule, self._crashes, self._emit = Schedule(stages, finished), Crashes(), emit

    def dispatch(self, workers: Workers) -> None:
        """Submit what is ready, as far as the workers have room."""
        while len(self.running) < workers.capacity and (stage := self._schedule.take()) is not None:
            self.running[stage.id] = stage
            workers.submit(stage, self._crashes.next_attempt(stage))
            self._emit(Event(kind="started", stage=stage.id))

    def handle(self, event: Event) -> None:
        """Let schedule and crash counts follow an event of a running stage, and emit it."""
        match event.kind:
            case "segment":
                self._crashes.note_start(event.stage, event.done)
            case "progress":
                self._emit(event)
            case "crashed":
                self._crashed(self.running.pop(event.stage), event)
            case "failed":
                self._fail(self.running.pop(event.stage), event)
            case _:
                self._schedule.done(self.running.pop(event.stage).id)
                self._emit(event)

    def _crashed(self, stage: Stage, event: Event) -> None:
        response = self._crashes.note_crash(stage, event.message)
        if response.stage_fails:
            self._fail(stage, Event(kind="failed", stage=stage.id, message=response.message))
            return
        self._schedule.put_back(stage)
        self._emit(Event(kind="crashed", stage=stage.id, message=response.message))

    def _fail(self, stage: Stage, event: Event) -> None:
        self._emit(event)
        for each in self._schedule.fail(stage.id):
            message = f"needs {', '.join(each.failed)}, which failed"
            self._emit(Event(kind="skipped", stage=each.stage, message=message))
