"""The command `harness` in a fork of a process that has loaded its modules, which take most of its time.

The child is a process of its own with the arguments, folder and streams that it would have, and runs the command's
`main`. It is used where nothing else of the process matters: `tests/support/tiny.py` starts the program itself where a
test changes the environment, sets limits, or sends signals.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Mapping, Sequence
from functools import cache
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, NoReturn

from tests.support.repository import REPOSITORY

PRELOADED = (
    "harness.cli.app",
    "harness.cli.documents",
    "harness.cli.runs",
    "harness.campaign.results.results",
    "harness.campaign.execution.run_campaign",
    "scipy.stats",
    "scipy.optimize",
    "matplotlib.figure",
    "matplotlib.backends.backend_svg",
)
_LONGEST = 1_000_000


def can_fork(options: Mapping[str, object]) -> bool:
    """Whether a command with these options of `subprocess.run` may run in a fork: all else of its process is ours."""
    return options.keys() <= {"cwd"} and _environment() == _ENVIRONMENT


def _environment() -> dict[str, str]:
    return {name: value for name, value in os.environ.items() if name != "PYTEST_CURRENT_TEST"}


_ENVIRONMENT = _environment()


def run_forked(
    command: Sequence[str], *, cwd: Path | str | None = None, timeout_s: float
) -> subprocess.CompletedProcess[str]:
    """Run the command to its end; its streams are captured. Raises subprocess.TimeoutExpired."""
    ours, theirs = socket.socketpair()
    with ours, theirs, open(os.devnull, "rb") as nothing, TemporaryFile() as printed, TemporaryFile() as complained:
        request = json.dumps([list(command), str(cwd or Path.cwd())]).encode()
        streams = [each.fileno() for each in (nothing, printed, complained, theirs)]
        requests, _ = _server(os.getpid())
        socket.send_fds(requests, [request], streams)
        theirs.close()
        pid = int.from_bytes(ours.recv(8), "little")
        ours.settimeout(timeout_s)
        try:
            code = ours.recv(8)
        except TimeoutError:
            os.kill(pid, signal.SIGKILL)
            raise subprocess.TimeoutExpired(list(command), timeout_s) from None
        said, wrong = (_text(each) for each in (printed, complained))
    assert code, f"{command} died: {wrong}"
    return subprocess.CompletedProcess(list(command), int.from_bytes(code, "little"), said, wrong)


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
    """Fork a child for each request, until the other end of the socket is closed."""
    for name in PRELOADED:
        import_module(name)
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # the system removes children that have ended
    with socket.socket(fileno=descriptor) as requests:
        while True:
            request, descriptors, _, _ = socket.recv_fds(requests, _LONGEST, 4)
            if not request:
                return
            if os.fork() == 0:
                requests.close()
                _carry_out(request, descriptors)
            for each in descriptors:
                os.close(each)


def _carry_out(request: bytes, descriptors: list[int]) -> NoReturn:
    from harness.cli.main import main

    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    *streams, answer = descriptors
    for number, each in enumerate(streams):
        os.dup2(each, number)
        os.close(each)
    os.set_inheritable(answer, False)
    os.write(answer, os.getpid().to_bytes(8, "little"))
    sys.argv, folder = json.loads(request)
    os.chdir(folder)
    code = 1
    try:
        main()
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        sys.excepthook(*sys.exc_info())
    finally:
        with contextlib.suppress(OSError):
            sys.stdout.flush()
            sys.stderr.flush()
        os.write(answer, code.to_bytes(8, "little"))
        os._exit(code)
