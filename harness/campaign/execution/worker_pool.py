"""Carrying a plan out in worker processes: independent stages at the same time, libsumo only ever in a worker.

A worker that crashes affects no other: its stage continues from its last segment in a new one. After `MOST_CRASHES`
crashes in the same segment a training has failed, by name, and the stages that don't need it continue; after as many in
the same game an arm continues without that game, which is an error.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

from harness.campaign.execution.crash_retries import Crashes
from harness.campaign.execution.run_context import RunContext
from harness.campaign.execution.run_stage import carry_out
from harness.campaign.execution.schedule import Schedule
from harness.campaign.execution.worker_process import Event, Work, start_process
from harness.campaign.plan.stages import Stage

Emit = Callable[[Event], None]


@dataclass
class _Worker:
    process: BaseProcess
    connection: Connection
    stage: Stage | None = None


Spawn = Callable[[], _Worker]


def cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def run_stages(
    stages: Sequence[Stage],
    finished: Iterable[str],
    context: RunContext,
    jobs: int,
    emit: Emit,
    work: Work = carry_out,
) -> None:
    """Carry out every stage that is not finished, at most `jobs` at a time, each after the stages that it needs.

    Everything that happens is emitted; nothing is raised for a stage that fails. `work` carries out a stage, in a
    worker. Raises PlanError where the stages can't all be carried out in some order.
    """
    finished = set(finished)
    schedule, crashes = Schedule(stages, finished), Crashes()
    spawn = partial(_spawn, work, context)
    with _workers(min(jobs, sum(stage.id not in finished for stage in stages)), spawn) as workers:
        while True:
            _dispatch(schedule, workers, crashes, spawn, emit)
            busy = [worker for worker in workers if worker.stage]
            if not busy:
                return
            ready = wait([*(w.connection for w in busy), *(w.process.sentinel for w in busy)])
            for worker in busy:
                if worker.connection in ready or worker.process.sentinel in ready:
                    _handle(worker, schedule, crashes, spawn, emit)


def _dispatch(schedule: Schedule[Stage], workers: list[_Worker], crashes: Crashes, spawn: Spawn, emit: Emit) -> None:
    """Give every idle worker a stage, as long as there are any."""
    for worker in workers:
        if worker.stage is not None or (stage := schedule.take()) is None:
            continue
        worker.stage = stage
        task = (stage, crashes.next_attempt(stage))
        try:
            worker.connection.send(task)
        except OSError:  # it died while it was idle
            _replace(worker, spawn)
            worker.connection.send(task)
        emit(Event(kind="started", stage=stage.id))


def _handle(worker: _Worker, schedule: Schedule[Stage], crashes: Crashes, spawn: Spawn, emit: Emit) -> None:
    """Receive one event of a busy worker, and let schedule and crash counts follow."""
    event, stage = _receive(worker), worker.stage
    if event is None or stage is None:
        return
    match event.kind:
        case "segment":
            crashes.note_start(event.stage, event.done)
            return
        case "progress":
            emit(event)
            return
        case "crashed":
            response = crashes.note_crash(stage, event.message)
            event = Event(
                kind="failed" if response.stage_fails else "crashed", stage=stage.id, message=response.message
            )
            if not response.stage_fails:
                schedule.put_back(stage)
            _replace(worker, spawn)
        case "done":
            schedule.done(stage.id)
    worker.stage = None
    emit(event)
    if event.kind == "failed":
        for each in schedule.fail(stage.id):
            message = f"needs {', '.join(each.failed)}, which failed"
            emit(Event(kind="skipped", stage=each.stage, message=message))


def _receive(worker: _Worker) -> Event | None:
    """The next event of a worker; its crash, if it ended without one."""
    assert worker.stage is not None
    try:
        if worker.connection.poll():
            event: Event = worker.connection.recv()
            return event
    except (EOFError, OSError):
        pass
    worker.process.join(5.0)
    if worker.process.is_alive():
        return None
    return Event(kind="crashed", stage=worker.stage.id, message=f"the worker died of {_cause(worker.process.exitcode)}")


def _cause(exitcode: int | None) -> str:
    if exitcode is not None and exitcode < 0:
        return signal.Signals(-exitcode).name
    return f"exit code {exitcode}"


@contextmanager
def _workers(count: int, spawn: Spawn) -> Iterator[list[_Worker]]:
    workers: list[_Worker] = []
    try:
        for _ in range(count):
            workers.append(spawn())
        yield workers
    finally:
        for worker in workers:
            worker.process.terminate()
        for worker in workers:
            worker.process.join(5.0)
            if worker.process.is_alive():
                worker.process.kill()
            worker.connection.close()


def _spawn(work: Work, context: RunContext) -> _Worker:
    process, connection = start_process(work, context)
    return _Worker(process, connection)


def _replace(worker: _Worker, spawn: Spawn) -> None:
    worker.connection.close()
    fresh = spawn()
    worker.process, worker.connection = fresh.process, fresh.connection
