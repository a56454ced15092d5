"""Carrying the plan out in processes: independent stages side by side, libsumo only ever in a worker.

A worker that dies takes nothing with it: its stage goes on from its last segment in another. After `TRIES` deaths in
the same segment a training has failed, by name, while stages that don't need it go on; after as many in the same game
an arm goes on without that game, which is an error. Workers end when the parent does, however it ends.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import tempfile
import threading
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache, partial
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, Literal

from harness.campaign.execution.crash_retries import Attempt, Crashes, OnProgress, OnStart
from harness.campaign.execution.run_context import RunContext
from harness.campaign.execution.run_stage import carry_out
from harness.campaign.plan.stages import Stage
from harness.campaign.storage.locks import share
from harness.campaign.storage.run_folder import RunFolder
from harness.errors import HarnessError, is_of_memory
from harness.files import make_folder

_REPORT_EVERY_S = 0.25
_REQUESTS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
_CONTEXT = multiprocessing.get_context("spawn")


Work = Callable[[Stage, RunContext, OnProgress, OnStart, Attempt], dict[str, Any]]


@dataclass(frozen=True)
class Event:
    """Something that happened to a stage."""

    kind: Literal["started", "progress", "began", "done", "failed", "died", "skipped"]
    """began: a segment of a training or a game of an arm, whose number is `done`; this is told to nobody."""
    stage: str
    done: int = 0
    total: int = 0
    message: str = ""
    info: dict[str, Any] = field(default_factory=dict)


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
    conditions: RunContext,
    jobs: int,
    emit: Callable[[Event], None],
    work: Work = carry_out,
) -> None:
    """Carry out every stage that is not finished, at most `jobs` at a time, each after what it needs.

    Everything that happens is told; nothing is raised for a stage that fails. `work` does a stage, in a worker.
    """
    done, lost = set(finished), set[str]()
    waiting = [stage for stage in stages if stage.id not in done]
    deaths = Crashes()
    spawn = partial(_start, work, conditions)
    with _workers(min(jobs, len(waiting)), spawn) as workers:
        while waiting or any(worker.stage for worker in workers):
            _skip_what_cannot_be(waiting, lost, emit)
            _dispatch(waiting, workers, done, deaths, spawn, emit)
            busy = [worker for worker in workers if worker.stage]
            if not busy:
                continue
            ready = wait([*(w.connection for w in busy), *(w.process.sentinel for w in busy)])
            for worker in busy:
                if worker.connection not in ready and worker.process.sentinel not in ready:
                    continue
                event = _receive(worker)
                if event is None or worker.stage is None:
                    continue
                if event.kind == "began":
                    deaths.note_begin(event.stage, event.done)
                    continue
                if event.kind == "died":
                    verdict = deaths.note(worker.stage, event.message)
                    event = Event("failed" if verdict.stage_fails else "died", event.stage, message=verdict.message)
                    if not verdict.stage_fails:
                        waiting.insert(0, worker.stage)
                    _replace(worker, spawn)
                if event.kind == "done":
                    done.add(event.stage)
                if event.kind == "failed":
                    lost.add(event.stage)
                if event.kind != "progress":
                    worker.stage = None
                emit(event)


def _skip_what_cannot_be(waiting: list[Stage], lost: set[str], emit: Callable[[Event], None]) -> None:
    for stage in list(waiting):
        missing = [name for name in stage.needs if name in lost]
        if missing:
            waiting.remove(stage)
            lost.add(stage.id)
            emit(Event("skipped", stage.id, message=f"needs {', '.join(missing)}, which failed"))


def _dispatch(
    waiting: list[Stage],
    workers: list[_Worker],
    done: set[str],
    deaths: Crashes,
    spawn: Spawn,
    emit: Callable[[Event], None],
) -> None:
    for worker in workers:
        ready = [stage for stage in waiting if set(stage.needs) <= done]
        if worker.stage is None and ready:
            # what others wait for goes first
            stage = max(ready, key=lambda one: sum(one.id in other.needs for other in waiting))
            waiting.remove(stage)
            worker.stage = stage
            task = (stage, deaths.attempt_at(stage))
            try:
                worker.connection.send(task)
            except OSError:  # it died while it had nothing to do
                _replace(worker, spawn)
                worker.connection.send(task)
            emit(Event("started", stage.id))


def _receive(worker: _Worker) -> Event | None:
    """What a worker has to say; its death if it died without a word."""
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
    return Event("died", worker.stage.id, message=f"the worker died of {_cause(worker.process.exitcode)}")


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


def _start(work: Work, conditions: RunContext) -> _Worker:
    ours, theirs = _CONTEXT.Pipe()
    process = _CONTEXT.Process(target=_work, args=(theirs, work, conditions), daemon=True)
    with _interrupts_held_back():
        process.start()
    theirs.close()
    return _Worker(process, ours)


@contextmanager
def _interrupts_held_back() -> Iterator[None]:
    """Ctrl-C and requests to end wait until a process is started whole; it is deaf to Ctrl-C from its first moment."""
    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "pthread_sigmask"):
        yield
        return
    came: list[int] = []
    resource_tracker.ensure_running()  # starting it would undo the mask
    before = {each: signal.signal(each, lambda number, frame: came.append(number)) for each in _REQUESTS}
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # which the process inherits
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        for number, handler in before.items():
            signal.signal(number, handler)
    for number in came:
        signal.raise_signal(number)


def _replace(worker: _Worker, spawn: Spawn) -> None:
    worker.connection.close()
    fresh = spawn()
    worker.process, worker.connection = fresh.process, fresh.connection


# --- in the worker's process -----------------------------------------------------------------------------------------


def _work(connection: Connection, work: Work, conditions: RunContext) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        while True:
            stage, attempt = connection.recv()
            connection.send(_carry_out(stage, attempt, connection, work, conditions))
    except (EOFError, OSError):  # the parent is gone
        return


@cache
def _register(run: Path) -> None:
    """Be known as a worker in a run folder, and make temporary files in it: of a worker that was killed they are taken
    away by the next command."""
    folder = RunFolder(run)
    make_folder(folder.scratch)
    os.environ["TMPDIR"] = str(folder.scratch.resolve())
    tempfile.tempdir = None
    share(folder.workers_lock)


def _carry_out(stage: Stage, attempt: Attempt, connection: Connection, work: Work, conditions: RunContext) -> Event:
    last = 0.0

    def on_progress(done: int, total: int) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= _REPORT_EVERY_S or done >= total:
            last = now
            connection.send(Event("progress", stage.id, done, total))

    def on_start(place: int) -> None:
        connection.send(Event("began", stage.id, place))

    try:
        _register(conditions.folder)
        return Event("done", stage.id, info=work(stage, conditions, on_progress, on_start, attempt))
    except (HarnessError, OSError) as error:
        return Event("failed", stage.id, message=str(error))
    except Exception as error:
        if is_of_memory(error):
            return Event("failed", stage.id, message=f"the machine is short of memory: {error or 'none is left'}")
        return Event("failed", stage.id, message=traceback.format_exc())  # a bug: its traceback is the message


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
