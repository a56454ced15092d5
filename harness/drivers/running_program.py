"""A program that runs beside the harness and answers lines by lines, each within a deadline.

It is killed with the object that stands for it, and with the harness.
"""

from __future__ import annotations

import os
import selectors
import signal
import subprocess
import sys
import tempfile
import time
import weakref
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO, Any

from harness.errors import DriverError

_LONGEST_ANSWER_BYTES = 10_000_000
_STDERR_TAIL_BYTES, _STDERR_TAIL_LINES = 4_000, 5
# If the harness is killed, a program that never reads its input would keep running. On Linux the kernel kills the
# program with the thread that started it. (1 is PR_SET_PDEATHSIG.)
_DIE_WITH_PARENT = (
    "import ctypes, os, signal, sys; parent = int(sys.argv[1]); ctypes.CDLL(None).prctl(1, signal.SIGKILL)\n"
    "if os.getppid() != parent: sys.exit(1)\n"
    "os.execvp(sys.argv[2], sys.argv[2:])"
)


class NoAnswer(Exception):
    """A program gave no answer in time, or more than one."""


class Program:
    """A running program. No read or write on its pipes blocks beyond a deadline."""

    def __init__(self, command: Sequence[str], folder: Path) -> None:
        """Start `command` in `folder`. Its temporary files are removed with it: a killed program can't do so."""
        temporary = tempfile.TemporaryDirectory(prefix="harness-program-", ignore_cleanup_errors=True)
        wrapper = [sys.executable, "-I", "-S", "-c", _DIE_WITH_PARENT, str(os.getpid())]
        prefix = wrapper if sys.platform == "linux" else []
        pipe = subprocess.PIPE
        try:
            self._process = subprocess.Popen(
                [*prefix, *command],
                cwd=folder,
                env=os.environ | {"TMPDIR": temporary.name},
                start_new_session=True,
                stdin=pipe,
                stdout=pipe,
                stderr=pipe,
            )
        except OSError as error:
            temporary.cleanup()
            raise DriverError(f"{command[0]} can't be started: {error}") from None
        self._kill = weakref.finalize(self, _kill, self._process, temporary)
        self._stdin, self._stdout, self._stderr = _pipes(self._process)
        self._selector = selectors.DefaultSelector()
        for stream in (self._stdin, self._stdout, self._stderr):
            os.set_blocking(stream.fileno(), False)
        self._selector.register(self._stdout, selectors.EVENT_READ)
        self._selector.register(self._stderr, selectors.EVENT_READ)
        self._told = b""

    @property
    def is_running(self) -> bool:
        return self._kill.alive and self._process.poll() is None

    def request(self, message: bytes, deadline_s: float) -> bytes:
        """Send a line, and receive one. Raises NoAnswer if the program does not answer within `deadline_s`."""
        if self._stdout in self._ready(0.0):
            raise NoAnswer("answered before the message was sent" if self.is_running else self._exit_description())
        until, left, answer = time.monotonic() + deadline_s, memoryview(message), bytearray()
        self._selector.register(self._stdin, selectors.EVENT_WRITE)
        try:
            while not answer.endswith(b"\n"):
                ready = self._ready(until - time.monotonic())
                if not ready and time.monotonic() >= until:
                    raise NoAnswer(f"did not answer within {deadline_s:g} s")
                if self._stderr in ready:
                    self._read_stderr()
                if self._stdin in ready:
                    left = left[os.write(self._stdin.fileno(), left[:65536]) :]
                    if not left:
                        self._unregister(self._stdin)
                if self._stdout in ready:
                    some = os.read(self._stdout.fileno(), 65536)
                    if not some:
                        raise NoAnswer(self._exit_description())
                    answer += some
                    if len(answer) > _LONGEST_ANSWER_BYTES:
                        raise NoAnswer(f"answers with more than {_LONGEST_ANSWER_BYTES:,} bytes")
        except BrokenPipeError:
            raise NoAnswer(self._exit_description()) from None
        finally:
            self._unregister(self._stdin)
        if left or answer.count(b"\n") > 1:
            raise NoAnswer("answered before the message was sent" if left else "answered with more than one line")
        return bytes(answer)

    def _ready(self, within_s: float) -> list[Any]:
        return [key.fileobj for key, _ in self._selector.select(max(within_s, 0.0))]

    def _unregister(self, stream: IO[bytes]) -> None:
        if stream in self._selector.get_map():
            self._selector.unregister(stream)

    def stderr_tail(self) -> str:
        """The last lines of its standard error, joined to one line."""
        self._read_stderr()
        lines = (line.strip() for line in self._told.decode("utf-8", "replace").split("\n"))
        return " / ".join(line for line in lines if line)[-1000:]

    def close(self) -> None:
        self._kill()
        self._selector.close()

    def _read_stderr(self) -> None:
        try:
            while some := os.read(self._stderr.fileno(), 65536):
                tail = (self._told + some)[-_STDERR_TAIL_BYTES:]
                self._told = b"\n".join(tail.split(b"\n")[-_STDERR_TAIL_LINES - 1 :])
            self._unregister(self._stderr)  # closed by the program
        except (OSError, ValueError):  # nothing to read now, or closed
            return

    def _exit_description(self) -> str:
        try:
            code = self._process.wait(1.0)
        except subprocess.TimeoutExpired:
            return "closed its standard output"
        return f"was killed by {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"


def _pipes(process: subprocess.Popen[bytes]) -> list[IO[bytes]]:
    return [each for each in (process.stdin, process.stdout, process.stderr) if each is not None]


def _kill(process: subprocess.Popen[bytes], temporary: tempfile.TemporaryDirectory[str]) -> None:
    """End a program and its child processes, and remove its temporary files."""
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except (ProcessLookupError, PermissionError):
        process.kill()
    for pipe in _pipes(process):
        with suppress(OSError):
            pipe.close()
    process.wait()
    temporary.cleanup()
