"""Workers in processes of this machine: libsumo only ever runs in a worker.

Workers ignore Ctrl-C, which the parent handles, and end when the parent ends, however it ends. The pools of
`concurrent.futures` and loky can't replace this one: there, one worker that dies ends the stages of all others and the
pool. Ray can, but takes seconds to start and reports no signal (`ray_workers`).
"""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait

from harness.campaign.execution.run_stage import carry_out
from harness.campaign.execution.stage_run import Attempt, Event, RunContext, Task, Work, carry_out_in_worker
from harness.errors import limited_memory

_TERMINATING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
_PROGRAM = "import json, sys; sys.path[:] = json.loads(sys.argv[2]); from {0} import serve; serve(int(sys.argv[1]))"


def start_process(work: Work) -> tuple[subprocess.Popen[bytes], Connection]:
    """Start a worker. It receives (context, task, attempt) and sends events until the connection is closed.

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
        connection.send(work)
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
    """Carry out the tasks that a connection asks for. What a worker's process runs."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.set_inheritable(descriptor, False)
    threading.Thread(target=_end_with_parent, args=(_taken_input(),), daemon=True).start()
    connection = Connection(descriptor)
    try:
        work = connection.recv()
        while True:
            context, task, attempt = connection.recv()
            last = carry_out_in_worker(task, attempt, context=context, work=work, send=connection.send)
            connection.send(last)
    except (EOFError, OSError):  # the parent is gone
        return


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


_END_S = 5.0
_POLL_S = 1.0


def cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@dataclass
class _Worker:
    process: subprocess.Popen[bytes]
    connection: Connection
    task: Task | None = None


class WorkerPool:
    """Processes of this machine, at most `jobs` (None: one per core), each started when it is needed; see
    `run_stages.Workers`.

    `context` is what the stages of the run share; None: `of_run` tells it. `work` carries out a task, in a worker.
    """

    def __init__(self, context: RunContext | None, jobs: int | None, work: Work = carry_out) -> None:
        self._context, self._work = context, work
        self.capacity = jobs or cores()
        self._workers: list[_Worker] = []

    def submit(self, task: Task, attempt: Attempt) -> None:
        """Give a task to an idle worker, or to a new one."""
        worker = next((each for each in self._workers if each.task is None), None)
        if worker is None:
            worker = _Worker(*start_process(self._work))
            self._workers.append(worker)
        worker.task = task
        try:
            worker.connection.send((self._context, task, attempt))
        except OSError:  # it died while it was idle
            self._replace(worker)
            worker.connection.send((self._context, task, attempt))

    def next_events(self) -> Sequence[Event]:
        """Wait a moment for the busy workers: at most one event of each."""
        busy = [worker for worker in self._workers if worker.task]
        ready = wait([worker.connection for worker in busy], _POLL_S)
        return [self._event_of(worker) for worker in busy if worker.connection in ready]

    def of_run(self, context: RunContext) -> AbstractContextManager[WorkerPool]:
        """The same processes as the workers of another run, after whose block they go on."""
        self._context = context
        return nullcontext(self)

    def __enter__(self) -> WorkerPool:
        return self

    def __exit__(self, *exception: object) -> None:
        for worker in self._workers:
            worker.process.terminate()
        for worker in self._workers:
            _wait_for(worker)

    def _event_of(self, worker: _Worker) -> Event:
        """The next event of a worker; its crash, if it ended without one."""
        assert worker.task is not None
        try:
            event: Event = worker.connection.recv()
        except (EOFError, OSError):  # it closed the connection, so it is ending
            code = self._replace(worker)
            cause = signal.Signals(-code).name if code < 0 else f"exit code {code}"
            limit = f" ({words})" if (words := limited_memory()) else ""  # libraries abort where memory runs out
            event = Event(kind="crashed", stage=worker.task.id, message=f"the worker died of {cause}{limit}")
        if event.kind in ("crashed", "done", "failed"):
            worker.task = None
        return event

    def _replace(self, worker: _Worker) -> int:
        """Wait for a worker that is ending, and start another one in its place. Returns its exit code."""
        code = _wait_for(worker)
        worker.process, worker.connection = start_process(self._work)
        return code


def _wait_for(worker: _Worker) -> int:
    try:
        worker.process.wait(_END_S)
    except subprocess.TimeoutExpired:
        worker.process.kill()
        worker.process.wait()
    worker.connection.close()
    if worker.process.stdin is not None:
        worker.process.stdin.close()
    return worker.process.returncode
