"""The process of a worker: starting it, what it runs, and the events that it sends to the pool.

Workers ignore Ctrl-C, which the parent handles, and end when the parent ends, however it ends.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import tempfile
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, Literal

from harness.campaign.execution.crash_retries import Attempt, OnProgress, OnStart
from harness.campaign.execution.preparation import preparations_reported
from harness.campaign.execution.run_context import RunContext
from harness.campaign.plan.stages import Stage
from harness.campaign.storage.locks import register_worker
from harness.campaign.storage.run_folder import RunFolder
from harness.errors import HarnessError, is_of_memory
from harness.files import make_folder

_PROGRESS_EVERY_S = 0.25
_TERMINATING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
_CONTEXT = multiprocessing.get_context("spawn")

Work = Callable[[Stage, RunContext, OnProgress, OnStart, Attempt], dict[str, Any]]


@dataclass(frozen=True, kw_only=True)
class Event:
    """Something that happened to a stage."""

    kind: Literal["started", "progress", "segment", "done", "failed", "crashed", "skipped"]
    """segment: a segment of a training, a game of an arm or a trial of a search starts, and `done` is its number. It is
    for the pool alone and is not emitted. progress with a message: what the stage waits for before its own work."""
    stage: str
    done: int = 0
    total: int = 0
    message: str = ""
    info: dict[str, Any] = field(default_factory=dict)


def start_process(work: Work, context: RunContext) -> tuple[BaseProcess, Connection]:
    """Start a worker. It receives (stage, attempt) and sends events until the connection is closed."""
    ours, theirs = _CONTEXT.Pipe()
    process = _CONTEXT.Process(target=_work, args=(theirs, work, context), daemon=True)
    with _signals_delayed():
        process.start()
    theirs.close()
    return process, ours


@contextmanager
def _signals_delayed() -> Iterator[None]:
    """Delay Ctrl-C and termination signals until a process has started. The process ignores Ctrl-C from its start."""
    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "pthread_sigmask"):
        yield
        return
    received: list[int] = []
    resource_tracker.ensure_running()  # starting it would undo the mask
    before = {each: signal.signal(each, lambda number, frame: received.append(number)) for each in _TERMINATING}
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # which the process inherits
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        for number, handler in before.items():
            signal.signal(number, handler)
    for number in received:
        signal.raise_signal(number)


def _work(connection: Connection, work: Work, context: RunContext) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        while True:
            stage, attempt = connection.recv()
            connection.send(_carry_out(stage, attempt, connection, work, context))
    except (EOFError, OSError):  # the parent is gone
        return


@cache
def _register(run: Path) -> None:
    """Register this process as a worker of a run folder, and put its temporary files into it: the next command removes
    those of a worker that was killed."""
    folder = RunFolder(run)
    make_folder(folder.scratch)
    os.environ["TMPDIR"] = str(folder.scratch.resolve())
    tempfile.tempdir = None
    register_worker(folder.workers)


def _carry_out(stage: Stage, attempt: Attempt, connection: Connection, work: Work, context: RunContext) -> Event:
    last = 0.0

    def on_progress(done: int, total: int) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= _PROGRESS_EVERY_S or done >= total:
            last = now
            connection.send(Event(kind="progress", stage=stage.id, done=done, total=total))

    def on_start(place: int) -> None:
        connection.send(Event(kind="segment", stage=stage.id, done=place))

    def on_preparation(what: str, done: int, total: int) -> None:
        connection.send(Event(kind="progress", stage=stage.id, done=done, total=total, message=what))

    try:
        _register(context.folder)
        with preparations_reported(on_preparation):
            return Event(kind="done", stage=stage.id, info=work(stage, context, on_progress, on_start, attempt))
    except (HarnessError, OSError) as error:
        return Event(kind="failed", stage=stage.id, message=str(error))
    except Exception as error:
        if is_of_memory(error):
            return Event(
                kind="failed", stage=stage.id, message=f"the machine is short of memory: {error or 'none is left'}"
            )
        return Event(
            kind="failed", stage=stage.id, message=traceback.format_exc()
        )  # a bug: its traceback is the message


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
