"""The command `harness` in a fork of a process that has loaded its modules, which takes most of its time.

The child is a process of its own with the arguments, folder and streams that it would have, and runs the command's
`main`; its workers are forks of it. It is used where nothing else of the process matters: `tests/support/tiny.py`
starts the program itself, which starts its workers itself, where a test changes the environment or sets limits.
"""

from __future__ import annotations

import contextlib
import gc
import json
import os
import selectors
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from multiprocessing.connection import Connection
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Any, NoReturn

from tests.support.repository import REPOSITORY

PRELOADED = (
    "harness.cli.app",
    "harness.cli.documents",
    "harness.cli.runs",
    "harness.campaign.results.results",
    "harness.campaign.execution.run_campaign",
    "harness.campaign.execution.training_stage",
    "harness.campaign.execution.assessment_stage",
    "scipy.stats",
    "scipy.optimize",
    "matplotlib.figure",
    "matplotlib.backends.backend_svg",
)
_LONGEST = 1_000_000
_POLL_S = 0.01
WORKER = "worker_pool"  # the name of a worker's process
_TERMINATING = (signal.SIGINT, signal.SIGHUP, signal.SIGTERM)


def can_fork(options: Mapping[str, object]) -> bool:
    """Whether a command with these options of `subprocess.run` may run in a fork: all else of its process is ours."""
    return options.keys() <= {"cwd"} and _environment() == _ENVIRONMENT


def remember_environment() -> None:
    """Let commands be forks until the environment changes: what libraries have set in it by now does not matter."""
    _ENVIRONMENT.clear()
    _ENVIRONMENT.update(_environment())


def _environment() -> dict[str, str]:
    return {name: value for name, value in os.environ.items() if name != "PYTEST_CURRENT_TEST"}


_ENVIRONMENT: dict[str, str] = _environment()


@dataclass
class Forked:
    """A process that was forked, as `subprocess.Popen` gives one that was started."""

    args: list[str]
    pid: int
    answers: socket.socket
    stdout: IO[str] | None = None
    returncode: int | None = None

    def poll(self) -> int | None:
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.wait(0.0)
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        if self.returncode is None:
            self.answers.settimeout(timeout)
            try:
                status = self.answers.recv(8)
            except (TimeoutError, BlockingIOError):
                raise subprocess.TimeoutExpired(self.args, timeout or 0.0) from None
            assert status, "the server of forks has ended"
            self.returncode = os.waitstatus_to_exitcode(int.from_bytes(status, "little"))
            self.answers.close()
        return self.returncode

    def communicate(self, timeout: float | None = None) -> tuple[str, None]:
        """What it has printed when it has ended."""
        self.wait(timeout)
        assert self.stdout is not None
        with self.stdout:
            self.stdout.seek(0)
            return self.stdout.read(), None

    def send_signal(self, number: int) -> None:
        if self.poll() is None:
            os.kill(self.pid, number)


def begin_forked(command: Sequence[str]) -> Forked:
    """Start the command as the leader of a session. What it prints and complains of are one stream."""
    printed = TemporaryFile("w+", encoding="utf-8")  # noqa: SIM115 - open until what it has printed is read
    with open(os.devnull, "rb") as nothing:
        forked = _fork(command, Path.cwd(), (nothing, printed, printed))
    forked.stdout = printed
    return forked


def run_forked(
    command: Sequence[str], *, cwd: Path | str | None = None, timeout_s: float
) -> subprocess.CompletedProcess[str]:
    """Run the command to its end; its streams are captured. Raises subprocess.TimeoutExpired."""
    with open(os.devnull, "rb") as nothing, TemporaryFile() as printed, TemporaryFile() as complained:
        forked = _fork(command, cwd or Path.cwd(), (nothing, printed, complained))
        try:
            code = forked.wait(timeout_s)
        except subprocess.TimeoutExpired:
            os.kill(forked.pid, signal.SIGKILL)
            raise
        said, wrong = (_text(each) for each in (printed, complained))
    return subprocess.CompletedProcess(list(command), code, said, wrong)


def _fork(command: Sequence[str], folder: Path | str, streams: Sequence[IO[Any]]) -> Forked:
    ours, theirs = socket.socketpair()
    with theirs:
        request = json.dumps([list(command), str(folder), _environment()]).encode()
        requests, _ = _server(os.getpid())
        socket.send_fds(requests, [request], [*(each.fileno() for each in streams), theirs.fileno()])
    return Forked(list(command), int.from_bytes(ours.recv(8), "little"), ours)


def _text(file: IO[bytes]) -> str:
    file.seek(0)
    return file.read().decode()


@cache
def _server(owner: int) -> tuple[socket.socket, subprocess.Popen[bytes]]:
    """The server of the process `owner`, with which it ends, behind its socket."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with theirs:
        program = f"from {__name__} import serve; serve({theirs.fileno()})"
        command = [sys.executable, "-c", program]
        server = subprocess.Popen(command, cwd=REPOSITORY, pass_fds=(theirs.fileno(),), stdin=subprocess.DEVNULL)
    return ours, server


def serve(descriptor: int) -> None:
    """Fork a child for each request and tell how it ended, until the other end of the socket is closed."""
    for name in PRELOADED:
        import_module(name)
    _play()
    gc.freeze()  # a collection would copy the memory that children share
    requests, sources = socket.socket(fileno=descriptor), selectors.DefaultSelector()
    sources.register(requests, selectors.EVENT_READ)
    while True:
        for ready, _ in sources.select():
            if ready.fileobj is not requests:
                _tell_end(*ready.data)
                sources.unregister(ready.fileobj)
                os.close(ready.fd)
                continue
            request, descriptors, _, _ = socket.recv_fds(requests, _LONGEST, 4)
            if not request:
                return
            *streams, answer = descriptors
            pid = os.fork()
            if pid == 0:
                command, folder, environment = json.loads(request)
                _carry_out(command, folder, environment, streams)
            for each in streams:
                os.close(each)
            os.write(answer, pid.to_bytes(8, "little"))
            sources.register(os.pidfd_open(pid), selectors.EVENT_READ, (pid, answer))


def _play() -> None:
    """Play a game, which loads the compiled functions that most games take."""
    from harness.road.scene.open_scene import open_scene
    from tests.support.rollouts import Steady, arm, play
    from tests.support.tiny import PAPER_MERGE

    play(arm(open_scene(PAPER_MERGE), Steady(), Steady()), 1)


def _tell_end(pid: int, answer: int) -> None:
    _, status = os.waitpid(pid, 0)
    with contextlib.suppress(OSError):  # who began it no longer wants to know
        os.write(answer, status.to_bytes(8, "little"))
    os.close(answer)


def _carry_out(command: list[str], folder: str, environment: dict[str, str], streams: Sequence[int]) -> NoReturn:
    from harness.campaign.execution import worker_pool
    from harness.cli.main import main

    os.setsid()
    _keep_only(streams)
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    sys.argv = command
    worker_pool.start_process = _start_worker  # type: ignore[assignment]
    code = 1
    try:
        main()
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        sys.excepthook(*sys.exc_info())
    finally:
        _end(code)


def _keep_only(streams: Sequence[int], *others: int) -> None:
    """Make these descriptors the standard streams, lead all others nowhere but those that are named, and heed signals.

    The numbers of the others stay taken: an object that closes its own must close no file of this process.
    """
    for each in _TERMINATING:
        signal.signal(each, signal.SIG_DFL)
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
    nowhere = os.open(os.devnull, os.O_RDWR)
    for descriptor in map(int, os.listdir("/proc/self/fd")):
        if descriptor > 2 and descriptor not in (nowhere, *others):
            with contextlib.suppress(OSError):  # the listing's own
                os.dup2(nowhere, descriptor, inheritable=False)


def _end(code: int) -> NoReturn:
    with contextlib.suppress(OSError):
        sys.stdout.flush()
        sys.stderr.flush()
    os._exit(code)


@dataclass
class _Worker:
    """What a worker pool asks of the process of a worker."""

    pid: int
    stdin: IO[bytes]
    returncode: int | None = None

    def wait(self, timeout: float | None = None) -> int:
        until = time.monotonic() + (float("inf") if timeout is None else timeout)
        while self.returncode is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                self.returncode = os.waitstatus_to_exitcode(status)
            elif time.monotonic() > until:
                raise subprocess.TimeoutExpired(WORKER, timeout or 0.0)
            else:
                time.sleep(_POLL_S)
        return self.returncode

    def terminate(self, number: int = signal.SIGTERM) -> None:
        if self.returncode is None:
            os.kill(self.pid, number)

    def kill(self) -> None:
        self.terminate(signal.SIGKILL)


def _start_worker(work: object) -> tuple[_Worker, Connection]:
    """Start a worker, as `worker_pool.start_process` does."""
    ours, theirs = socket.socketpair()
    its_input, stays_open = os.pipe()
    sys.stdout.flush()
    sys.stderr.flush()
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, _TERMINATING)
    pid = os.fork()
    if pid == 0:
        _serve_pool(its_input, theirs.fileno(), mask)
    signal.pthread_sigmask(signal.SIG_SETMASK, mask)
    os.close(its_input)
    theirs.close()
    connection = Connection(ours.detach())
    with contextlib.suppress(OSError):  # it died: the pool finds that out
        connection.send(work)
    return _Worker(pid, os.fdopen(stays_open, "wb")), connection


def _serve_pool(its_input: int, tasks: int, mask: set[int]) -> NoReturn:
    from harness.campaign.execution.worker_pool import serve as serve_pool

    code = 1
    try:
        _keep_only((its_input, 1, 2), tasks)
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        Path("/proc/self/comm").write_text(WORKER, encoding="utf-8")
        serve_pool(tasks)
        code = 0
    except BaseException:
        sys.excepthook(*sys.exc_info())
    finally:
        _end(code)
