"""A program as a driver: one line of JSON per message and per answer over its standard streams, with a deadline.

| message | answer |
| --- | --- |
| `{"type": "hello", "protocol": 2, "units": …, "layout": […], "step_s": …, "limits": {…}}` | `{"protocol": 2}` |
| `{"type": "reset", "games": […]}` | `{}` |
| `{"type": "decide", "games": […], "observation": [[…], …], "noise": [[…], …]}` | `{"actions": [[…, …], …]}` |

If the program has parameters, `hello` ends with `"parameters": {…}`. A program may answer any message with
`{"error": "…"}`. A program that crashes, misses a deadline or sends an invalid answer is killed, and its game fails;
the next game starts a new process. The program is killed with its driver and with the harness.
"""

from __future__ import annotations

import json
import os
import selectors
import signal
import subprocess
import sys
import time
import weakref
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import MappingProxyType
from typing import IO, Any

import numpy as np

from harness.drivers.car import Car
from harness.errors import DriverError
from harness.game.arrays import FloatArray, IntArray
from harness.game.observation_layout import LAYOUT

PROTOCOL = 2
_LONGEST_ANSWER_BYTES = 10_000_000
_LONGEST_ERROR = 600
_STDERR_TAIL_BYTES, _STDERR_TAIL_LINES = 4_000, 5
# If the harness is killed, a program that never reads its input would keep running. On Linux the kernel kills the
# program with the thread that started it. (1 is PR_SET_PDEATHSIG.)
_DIE_WITH_PARENT = (
    "import ctypes, os, signal, sys; parent = int(sys.argv[1]); ctypes.CDLL(None).prctl(1, signal.SIGKILL)\n"
    "if os.getppid() != parent: sys.exit(1)\n"
    "os.execvp(sys.argv[2], sys.argv[2:])"
)


class ProcessDriver:
    """Drives by the answers of a program. `close` ends it, and so does the garbage collection of the driver."""

    takes_over = True

    def __init__(
        self,
        command: Sequence[str],
        folder: Path,
        car: Car,
        *,
        units: str,
        deadline_s: float,
        start_deadline_s: float,
        name: str = "",
        parameters: Mapping[str, bool | int | float | str] = MappingProxyType({}),
    ) -> None:
        """The program is started in `folder` at the first reset, and receives `parameters` in the first message.

        `units`: "si" or "scaled". `deadline_s` applies to decisions, `start_deadline_s` to the other messages. Error
        messages use `name`, or else the name of the command.
        """
        self._command, self._folder, self._car, self._name = tuple(command), folder, car, name or command[0]
        self._si = units == "si"
        self._deadline_s, self._start_deadline_s = deadline_s, start_deadline_s
        self._hello = {
            **{"type": "hello", "protocol": PROTOCOL, "units": units, "layout": list(LAYOUT), "step_s": car.step_s},
            "limits": {**car.limits, "length_m": car.length_m, "width_m": car.width_m},
        }
        if parameters:
            self._hello["parameters"] = dict(parameters)
        self._program: _Program | None = None

    def reset(self, games: IntArray) -> None:
        """Reset games [N]. Raises DriverError if the program can't be started or does not support the protocol."""
        if self._program is None or not self._program.is_running:
            self.close()
            self._program = _Program(self._command, self._folder)
            answer = self._request(self._hello, self._start_deadline_s)
            if answer.get("protocol") != PROTOCOL:
                raise self._failure(f"does not support protocol {PROTOCOL}: it answered hello with {_short(answer)}")
        self._request({"type": "reset", "games": games.tolist()}, self._start_deadline_s)

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """Actions [N, 2] from observations [N, SIZE]. Raises DriverError if the program gives no valid
        answer."""
        rows = self._car.physical(observation) if self._si else observation
        message = {"type": "decide", "games": games.tolist(), "observation": rows.tolist(), "noise": noise.tolist()}
        actions = _actions(self._request(message, self._deadline_s).get("actions"), len(games))
        if isinstance(actions, str):
            raise self._failure(f"answered with invalid actions: {actions}")
        try:
            return self._car.answered(actions, observation, si=self._si)
        except DriverError as error:
            raise self._failure(f"gave an implausible answer: {error}") from None

    def close(self) -> None:
        """End the program. A second call does nothing."""
        if self._program is not None:
            self._program.close()
            self._program = None

    def _request(self, message: dict[str, Any], deadline_s: float) -> dict[str, Any]:
        if self._program is None:
            raise DriverError("the program is not running: no game was reset since it ended")
        line = json.dumps(message, allow_nan=False).encode() + b"\n"
        try:
            answer = json.loads(self._program.request(line, deadline_s))
        except (ValueError, RecursionError) as error:
            raise self._failure(f"sent an answer to {message['type']} that is not JSON: {error}") from None
        except _NoAnswer as error:
            raise self._failure(f"{error} (message: {message['type']})") from None
        if not isinstance(answer, dict):
            raise self._failure(f"answered {message['type']} with {_short(answer)}, not with an object")
        if "error" in answer:
            raise self._failure(f"reports an error: {_short(answer['error'], _LONGEST_ERROR)}")
        return answer

    def _failure(self, what: str) -> DriverError:
        """End the program, and return the error: `what` went wrong, and the end of the program's standard error."""
        assert self._program is not None
        tail = self._program.stderr_tail()
        self.close()
        return DriverError(f"{self._name} {what}" + (f"; on its standard error: {tail}" if tail else ""))


class _NoAnswer(Exception):
    """A program gave no answer in time, or more than one."""


class _Program:
    """A running program. No read or write on its pipes blocks beyond a deadline."""

    def __init__(self, command: Sequence[str], folder: Path) -> None:
        wrapper = [sys.executable, "-I", "-S", "-c", _DIE_WITH_PARENT, str(os.getpid())]
        prefix = wrapper if sys.platform == "linux" else []
        pipe = subprocess.PIPE
        try:
            self._process = subprocess.Popen(
                [*prefix, *command], cwd=folder, start_new_session=True, stdin=pipe, stdout=pipe, stderr=pipe
            )
        except OSError as error:
            raise DriverError(f"{command[0]} can't be started: {error}") from None
        self._kill = weakref.finalize(self, _kill, self._process)
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
        """Send a line, and receive one. Raises _NoAnswer if the program does not answer within `deadline_s`."""
        if self._stdout in self._ready(0.0):
            raise _NoAnswer("answered before the message was sent" if self.is_running else self._exit_description())
        until, left, answer = time.monotonic() + deadline_s, memoryview(message), bytearray()
        self._selector.register(self._stdin, selectors.EVENT_WRITE)
        try:
            while not answer.endswith(b"\n"):
                ready = self._ready(until - time.monotonic())
                if not ready and time.monotonic() >= until:
                    raise _NoAnswer(f"did not answer within {deadline_s:g} s")
                if self._stderr in ready:
                    self._read_stderr()
                if self._stdin in ready:
                    left = left[os.write(self._stdin.fileno(), left[:65536]) :]
                    if not left:
                        self._unregister(self._stdin)
                if self._stdout in ready:
                    some = os.read(self._stdout.fileno(), 65536)
                    if not some:
                        raise _NoAnswer(self._exit_description())
                    answer += some
                    if len(answer) > _LONGEST_ANSWER_BYTES:
                        raise _NoAnswer(f"answers with more than {_LONGEST_ANSWER_BYTES:,} bytes")
        except BrokenPipeError:
            raise _NoAnswer(self._exit_description()) from None
        finally:
            self._unregister(self._stdin)
        if left or answer.count(b"\n") > 1:
            raise _NoAnswer("answered before the message was sent" if left else "answered with more than one line")
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


def _kill(process: subprocess.Popen[bytes]) -> None:
    """End a program and its child processes."""
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except (ProcessLookupError, PermissionError):
        process.kill()
    for pipe in _pipes(process):
        with suppress(OSError):
            pipe.close()
    process.wait()


def _actions(answer: Any, games: int) -> FloatArray | str:
    """Actions [N, 2], or a message if they are invalid."""
    if not isinstance(answer, list) or len(answer) != games:
        return f"{games} pairs of numbers are needed, not {_short(answer)}"
    for each in answer:
        if not isinstance(each, list) or len(each) != 2 or not all(type(value) in (int, float) for value in each):
            return f"each must be a pair of numbers, not {_short(each)}"
        if not all(abs(value) <= sys.float_info.max for value in each):
            return f"{_short(each)} is not finite, or too large"
    return np.array(answer, dtype=np.float64)


def _short(value: Any, longest: int = 200) -> str:
    return repr(value)[:longest]
