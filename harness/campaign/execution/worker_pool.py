"""Workers in processes of this machine: libsumo only ever runs in a worker.

The pools of `concurrent.futures` and loky can't replace this one: there, one worker that dies ends the stages of all
others and the pool. Ray can, but takes seconds to start and reports no signal (`ray_workers`).
"""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from types import TracebackType

from harness.campaign.execution.run_context import RunContext
from harness.campaign.execution.run_stage import carry_out
from harness.campaign.execution.stage_events import Event
from harness.campaign.execution.stage_run import Attempt, Work
from harness.campaign.execution.worker_process import start_process
from harness.campaign.plan.stages import Stage

_END_S = 5.0


def cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@dataclass
class _Worker:
    process: subprocess.Popen[bytes]
    connection: Connection
    stage: Stage | None = None


class WorkerPool:
    """Processes of this machine, at most `jobs` and no more than `stages_left`; see `run_stages.Workers`.

    `work` carries out a stage, in a worker.
    """

    def __init__(self, context: RunContext, stages_left: int, jobs: int, work: Work = carry_out) -> None:
        self._context, self._work = context, work
        self._count = min(jobs, stages_left)
        self._workers: list[_Worker] = []

    @property
    def capacity(self) -> int:
        """The number of processes."""
        return self._count

    def submit(self, stage: Stage, attempt: Attempt) -> None:
        """Give a stage to an idle worker."""
        worker = next(each for each in self._workers if each.stage is None)
        worker.stage = stage
        try:
            worker.connection.send((stage, attempt))
        except OSError:  # it died while it was idle
            self._replace(worker)
            worker.connection.send((stage, attempt))

    def next_events(self) -> Sequence[Event]:
        """Wait for the busy workers: at most one event of each."""
        busy = [worker for worker in self._workers if worker.stage]
        ready = wait([worker.connection for worker in busy])
        return [self._event_of(worker) for worker in busy if worker.connection in ready]

    def __enter__(self) -> WorkerPool:
        try:
            while len(self._workers) < self._count:
                self._workers.append(self._spawn())
        except BaseException:
            self._end()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._end()

    def _event_of(self, worker: _Worker) -> Event:
        event = _receive(worker)
        if event.kind == "crashed":
            self._replace(worker)
        if event.kind in ("crashed", "done", "failed"):
            worker.stage = None
        return event

    def _spawn(self) -> _Worker:
        return _Worker(*start_process(self._work, self._context))

    def _replace(self, worker: _Worker) -> None:
        _wait_for(worker)
        fresh = self._spawn()
        worker.process, worker.connection = fresh.process, fresh.connection

    def _end(self) -> None:
        for worker in self._workers:
            worker.process.terminate()
        for worker in self._workers:
            _wait_for(worker)


def _receive(worker: _Worker) -> Event:
    """The next event of a worker; its crash, if it ended without one."""
    assert worker.stage is not None
    try:
        event: Event = worker.connection.recv()
    except (EOFError, OSError):  # it closed the connection, so it is ending
        cause = _cause(_wait_for(worker))
        return Event(kind="crashed", stage=worker.stage.id, message=f"the worker died of {cause}")
    return event


def _wait_for(worker: _Worker) -> int:
    """Wait for a worker that is ending; its exit code."""
    try:
        worker.process.wait(_END_S)
    except subprocess.TimeoutExpired:
        worker.process.kill()
        worker.process.wait()
    worker.connection.close()
    if worker.process.stdin is not None:
        worker.process.stdin.close()
    return worker.process.returncode


def _cause(exitcode: int) -> str:
    if exitcode < 0:
        return signal.Signals(-exitcode).name
    return f"exit code {exitcode}"
