"""The process of a worker: starting it, what it runs, and the events that it sends to the pool.

Workers ignore Ctrl-C, which the parent handles, and end when the parent ends, however it ends.
"""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from multiprocessing.connection import Connection
from pathlib import Path

from harness.campaign.execution.run_context import RunContext
from harness.campaign.execution.stage_events import StageJob
from harness.campaign.execution.stage_run import Work
from harness.campaign.storage.locks import register_worker
from harness.campaign.storage.run_folder import RunFolder
from harness.files import make_folder

_TERMINATING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
_PROGRAM = "import json, sys; sys.path[:] = json.loads(sys.argv[2]); from {0} import serve; serve(int(sys.argv[1]))"


def start_process(work: Work, context: RunContext) -> tuple[subprocess.Popen[bytes], Connection]:
    """Start a worker. It receives (stage, attempt) and sends events until the connection is closed.

    Its standard input stays open as long as this process lives. `multiprocessing` starts no worker here: its child
    prints a traceback if the parent is killed before it has sent what the child needs.
    """
    ours, theirs = socket.socketpair()
    program = _PROGRAM.format(__name__)
    path = json.dumps([os.path.abspath(each) for each in sys.path])
    arguments = [sys.executable, "-c", program, str(theirs.fileno()), path]
    with theirs, _signals_delayed():
        process = subprocess.Popen(arguments, stdin=subprocess.PIPE, pass_fds=(theirs.fileno(),))
    connection = Connection(ours.detach())
    with suppress(OSError):  # it died: the pool finds that out
        connection.send((work, context))
    return process, connection


@contextmanager
def _signals_delayed() -> Iterator[None]:
    """Delay Ctrl-C and termination signals until a process has started. The process ignores Ctrl-C from its start."""
    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "pthread_sigmask"):
        yield
        return
    received: list[int] = []
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


def serve(descriptor: int) -> None:
    """Carry out the stages that a connection asks for. What a worker's process runs."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.set_inheritable(descriptor, False)
    threading.Thread(target=_end_with_parent, args=(_taken_input(),), daemon=True).start()
    connection = Connection(descriptor)
    try:
        work, context = connection.recv()
        while True:
            stage, attempt = connection.recv()
            job = StageJob(stage=stage, attempt=attempt, context=context, work=work)
            connection.send(job.carry_out(connection.send, _registered(context.folder)))
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


def _taken_input() -> int:
    """The standard input as another descriptor: the worker's own programs read nothing."""
    taken = os.dup(0)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    return taken


def _end_with_parent(its_input: int) -> None:
    os.read(its_input, 1)  # nothing is ever written: it returns when the parent has ended
    os._exit(1)
