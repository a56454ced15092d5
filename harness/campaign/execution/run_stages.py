"""Carrying a plan out: what is ready is submitted to workers, and what they report decides what follows.

It knows no processes: `Workers` has two implementations, the processes of this machine (`worker_pool`) and a Ray
cluster (`ray_workers`).

A worker that crashes affects no other: its stage continues from its last segment in another one. After `MOST_CRASHES`
crashes in the same segment a training has failed, by name, and the stages that don't need it continue; after as many in
the same game an arm continues without that game, which is an error.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Protocol, TypeAlias

from harness.campaign.execution.crash_retries import Crashes
from harness.campaign.execution.schedule import Schedule
from harness.campaign.execution.stage_events import Emit, Event
from harness.campaign.execution.stage_run import Attempt, RunContext
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
    def __exit__(self, *exception: object) -> None: ...


StartWorkers: TypeAlias = Callable[[RunContext, int], Workers]
"""Makes the workers of a run, from what its stages share and the number of stages that are left."""


def run_stages(stages: Sequence[Stage], finished: Iterable[str], workers: Workers, emit: Emit) -> None:
    """Carry out every stage that is not finished, each after the stages that it needs.

    Everything that happens is emitted; nothing is raised for a stage that fails. Raises PlanError where the stages
    can't all be carried out in some order.
    """
    schedule, crashes, running = Schedule(stages, finished), Crashes(), dict[str, Stage]()

    def handle(event: Event) -> None:
        """Let schedule and crash counts follow an event of a running stage, and emit it."""
        if event.kind == "segment":
            crashes.note_start(event.stage, event.done)
            return
        if event.kind == "crashed":
            event = crashes.note_crash(running[event.stage], event.message)
        emit(event)
        if event.kind == "progress":
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

    with workers:
        while True:
            while len(running) < workers.capacity and (stage := schedule.take()) is not None:
                running[stage.id] = stage
                workers.submit(stage, crashes.next_attempt(stage))
                emit(Event(kind="started", stage=stage.id))
            if not running:
                return
            for event in workers.next_events():
                handle(event)
