"""The process of a worker: starting it, what it runs, and the events that it sends to the pool.

Workers ignore Ctrl-C, which the parent handles, and end when the parent ends, however it ends.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path

from harness.campaign.execution.run_context import RunContext
from harness.campaign.execution.stage_events import Work, carry_out_with_events
from harness.campaign.storage.locks import register_worker
from harness.campaign.storage.run_folder import RunFolder
from harness.files import make_folder

_TERMINATING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
_CONTEXT = multiprocessing.get_context("spawn")


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
            connection.send(
                carry_out_with_events(stage, attempt, context, work, connection.send, _registered(context.folder))
            )
    except (EOFError, OSError):  # the parent is gone
        return


@contextmanager
def _registered(run: Path) -> Iterator[None]:
    """This process is registered as a worker of a run folder, from the first time until it ends."""
    _register(run)
    yield


@cache
def _register(run: Path) -> None:
    put_scratch_into(run)
    register_worker(RunFolder(run).workers)


@cache
def put_scratch_into(run: Path) -> None:
    """Put the temporary files of this process into a run folder: the next command removes those of a worker that was
    killed."""
    folder = RunFolder(run)
    make_folder(folder.scratch)
    os.environ["TMPDIR"] = str(folder.scratch.resolve())
    tempfile.tempdir = None


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
