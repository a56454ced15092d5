"""A program as a driver: one JSON line each way over its standard streams, each answer with a deadline.

| message | answer |
| --- | --- |
| `{"type": "hello", "protocol": 2, "units": …, "layout": […], "step_s": …, "limits": {…}}` | `{"protocol": 2}` |
| `{"type": "reset", "games": […]}` | `{}` |
| `{"type": "decide", "games": […], "observation": [[…], …], "noise": [[…], …]}` | `{"actions": [[…, …], …]}` |

The hello ends with `"parameters": {…}` where the program has any. To any of them a program may answer
`{"error": "…"}`. A program that died, is late or answers nonsense is killed and costs the game; the next game begins
with a new one. It ends with its driver, and with the harness.
"""

from __future__ import annotations

import json
import math
import os
import selectors
import signal
import subprocess
import sys
import time
import weakref
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import IO, Any

import numpy as np

from harness.drivers.car import Car
from harness.errors import DriverError
from harness.game.arrays import FloatArray, IntArray
from harness.game.observation import LAYOUT

PROTOCOL = 2
_LONGEST_ANSWER_BYTES = 10_000_000
_LAST_WORDS_BYTES, _LAST_LINES = 4_000, 5
# A child of the harness that is killed would live on, and one that never looks at its input would do so for ever:
# Linux kills the program with the thread that started it. (1 is PR_SET_PDEATHSIG.)
_LEASH = (
    "import ctypes, os, signal, sys; parent = int(sys.argv[1]); ctypes.CDLL(None).prctl(1, signal.SIGKILL)\n"
    "if os.getppid() != parent: sys.exit(1)\n"
    "os.execvp(sys.argv[2], sys.argv[2:])"
)


class ProcessDriver:
    """Drives by what a program answers. The program ends with `close`, or when nobody refers to this any more."""

    takes_over = True

    def __init__(
        self,
        command: Sequence[str],
        folder: Path,
        car: Car,
        units: str,
        deadline_s: float,
        start_deadline_s: float,
        name: str = "",
        parameters: Mapping[str, bool | int | float | str] = MappingProxyType({}),
    ) -> None:
        """The program is started when the first game begins, in `folder`, and is told its `parameters`, if it has any.
        Errors call it `name`, or as it is called."""
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
        """Games [N] start anew. Raises DriverError where the program can't be started or doesn't agree."""
        if self._program is None or not self._program.is_running:
            self.close()
            self._program = _Program(self._command, self._folder)
            answer = self._ask(self._hello, self._start_deadline_s)
            if answer.get("protocol") != PROTOCOL:
                raise self._ended(f"does not speak protocol {PROTOCOL}: it answered hello with {_short(answer)}")
        self._ask({"type": "reset", "games": games.tolist()}, self._start_deadline_s)

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """Actions [N, 2] from observations [N, SIZE]. Raises DriverError where the program has none."""
        seen = self._car.seen(observation) if self._si else observation
        message = {"type": "decide", "games": games.tolist(), "observation": seen.tolist(), "noise": noise.tolist()}
        actions = _actions(self._ask(message, self._deadline_s).get("actions"), len(games))
        if isinstance(actions, str):
            raise self._ended(f"answered with actions that are none: {actions}")
        if self._si:
            return self._car.asked(actions[:, 0], actions[:, 1], observation)
        return np.clip(actions, -1.0, 1.0)

    def close(self) -> None:
        """End the program. Closing twice is closing once."""
        if self._program is not None:
            self._program.close()
            self._program = None

    def _ask(self, message: dict[str, Any], deadline_s: float) -> dict[str, Any]:
        if self._program is None:
            raise DriverError("the program is not running: no game has begun since it ended")
        line = json.dumps(message, allow_nan=False).encode() + b"\n"
        try:
            answer = json.loads(self._program.exchange(line, deadline_s))
        except (ValueError, RecursionError) as error:
            raise self._ended(f"answered {message['type']} with what is not JSON: {error}") from None
        except _Broken as error:
            raise self._ended(f"{error} (asked: {message['type']})") from None
        if not isinstance(answer, dict):
            raise self._ended(f"answered {message['type']} with {_short(answer)}, not with an object")
        if "error" in answer:
            raise self._ended(f"reports an error: {_short(answer['error'])}")
        return answer

    def _ended(self, what: str) -> DriverError:
        """What went wrong, with the program's last words; it is of no more use, and is ended."""
        assert self._program is not None
        said = self._program.last_words()
        self.close()
        return DriverError(f"{self._name} {what}" + (f"; it said: {said}" if said else ""))


class _Broken(Exception):
    """A program gave no answer."""


class _Program:
    """A running program, with pipes that nobody waits on beyond a deadline."""

    def __init__(self, command: Sequence[str], folder: Path) -> None:
        leash = [sys.executable, "-I", "-S", "-c", _LEASH, str(os.getpid())] if sys.platform == "linux" else []
        pipe = subprocess.PIPE
        try:
            self._process = subprocess.Popen(
                [*leash, *command], cwd=folder, start_new_session=True, stdin=pipe, stdout=pipe, stderr=pipe
            )
        except OSError as error:
            raise DriverError(f"{command[0]} can't be started: {error}") from None
        self._kill = weakref.finalize(self, _kill, self._process)
        self._selector = selectors.DefaultSelector()
        for stream in (self._process.stdin, self._process.stdout, self._process.stderr):
            assert stream is not None
            os.set_blocking(stream.fileno(), False)
            if stream is not self._process.stdin:
                self._selector.register(stream, selectors.EVENT_READ)
        self._said = b""

    @property
    def is_running(self) -> bool:
        return self._kill.alive and self._process.poll() is None

    def exchange(self, message: bytes, deadline_s: float) -> bytes:
        """Send a line, and receive one. Raises _Broken where that does not happen in time."""
        stdin, stdout, stderr = self._process.stdin, self._process.stdout, self._process.stderr
        assert stdin is not None
        assert stdout is not None
        assert stderr is not None
        if self._waits(stdout):
            raise _Broken("answered before it was asked" if self.is_running else self._how_it_ended())
        until, left, answer = time.monotonic() + deadline_s, memoryview(message), bytearray()
        self._selector.register(stdin, selectors.EVENT_WRITE)
        try:
            while not answer.endswith(b"\n"):
                ready = [key.fileobj for key, _ in self._selector.select(max(until - time.monotonic(), 0.0))]
                if not ready and time.monotonic() >= until:
                    raise _Broken(f"did not answer within {deadline_s:g} s")
                if stderr in ready:
                    self._hear()
                if stdin in ready:
                    left = left[os.write(stdin.fileno(), left[:65536]) :]
                    if not left:
                        self._selector.unregister(stdin)
                if stdout in ready:
                    some = os.read(stdout.fileno(), 65536)
                    if not some:
                        raise _Broken(self._how_it_ended())
                    answer += some
                    if len(answer) > _LONGEST_ANSWER_BYTES:
                        raise _Broken(f"answers with more than {_LONGEST_ANSWER_BYTES:,} bytes")
        except BrokenPipeError:
            raise _Broken(self._how_it_ended()) from None
        finally:
            if stdin in [key.fileobj for key in self._selector.get_map().values()]:
                self._selector.unregister(stdin)
        if left or answer.count(b"\n") > 1:
            raise _Broken("answered before it was asked" if left else "answered with more than one line")
        return bytes(answer)

    def _waits(self, stdout: IO[bytes]) -> bool:
        return any(key.fileobj is stdout for key, _ in self._selector.select(0.0))

    def last_words(self) -> str:
        """The last lines it wrote to its standard error, as one."""
        self._hear()
        lines = self._said.decode("utf-8", "replace").split("\n")
        return " / ".join(line.strip() for line in lines if line.strip()).strip()[-1000:] if lines else ""

    def close(self) -> None:
        self._kill()
        self._selector.close()

    def _hear(self) -> None:
        stderr = self._process.stderr
        assert stderr is not None
        try:
            while some := os.read(stderr.fileno(), 65536):
                said = (self._said + some)[-_LAST_WORDS_BYTES:]
                self._said = b"\n".join(said.split(b"\n")[-_LAST_LINES - 1 :])
        except BlockingIOError:
            return
        except (OSError, ValueError):
            return
        if stderr in [key.fileobj for key in self._selector.get_map().values()]:
            self._selector.unregister(stderr)  # it closed its standard error: there is nothing more to hear

    def _how_it_ended(self) -> str:
        try:
            code = self._process.wait(1.0)
        except subprocess.TimeoutExpired:
            return "closed its standard output"
        return f"died of {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"


def _kill(process: subprocess.Popen[bytes]) -> None:
    """End a program and what it started."""
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except (ProcessLookupError, PermissionError):
        process.kill()
    for pipe in (process.stdin, process.stdout, process.stderr):
        assert pipe is not None
        try:
            pipe.close()
        except OSError:
            continue
    process.wait()


def _actions(given: Any, games: int) -> FloatArray | str:
    """Actions [N, 2], or what is wrong with them."""
    if not isinstance(given, list) or len(given) != games:
        return f"{games} pairs of numbers are needed, not {_short(given)}"
    for each in given:
        if not isinstance(each, list) or len(each) != 2 or not all(type(value) in (int, float) for value in each):
            return f"each must be a pair of numbers, not {_short(each)}"
        if not all(abs(value) < math.inf for value in each):
            return f"{_short(each)} is not finite"
    try:
        return np.array(given, dtype=np.float64)
    except OverflowError:
        return "a number is too large"


def _short(given: Any) -> str:
    return repr(given)[:200]
