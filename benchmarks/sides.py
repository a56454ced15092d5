"""The sides of a comparison, each in a process of its own, that take turns: while one runs, the others wait.

A process has room for one libsumo, and a machine's mood changes within seconds: so every side is opened and warmed up
once, and then short stretches of all sides follow each other, again and again.
"""

from __future__ import annotations

import multiprocessing
import signal
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from statistics import median
from typing import Any

_CONTEXT = multiprocessing.get_context("spawn")
_ENDS_WITHIN_S = 20.0

Tell = Callable[[float], None]
"""Told how much of a measurement is done, 0 to 1."""


class SideFailed(Exception):
    """A side of a comparison raised; its traceback is the message."""


class Finished(BaseException):
    """Raised in a side when nothing more is asked of it. No Exception: nobody on the way is to take it for an error."""


@dataclass(frozen=True)
class Lap:
    """What a side did in one turn."""

    units: float
    seconds: float
    own_cpu_s: float
    """Of the side's process alone: less than `seconds` where it had to wait for a core, or for other processes."""
    values: Mapping[str, Any] = field(default_factory=dict)

    @property
    def per_s(self) -> float:
        return self.units / self.seconds


class Pace:
    """The side's end of the line: when to run, when to let the others run."""

    def __init__(self, connection: Connection, stretch_s: float) -> None:
        self._connection, self._stretch_s = connection, stretch_s
        self._began = self._cpu = 0.0

    def begin(self) -> None:
        """The side is open and warm; returns when it is its turn."""
        self._connection.send("ready")
        self._wait()

    def due(self) -> bool:
        """Whether the side has had its stretch of time."""
        return time.perf_counter() - self._began >= self._stretch_s

    def start_clock(self) -> None:
        """What was done in this turn until now was preparation: it is not counted."""
        self._began, self._cpu = time.perf_counter(), time.process_time()

    def tell(self, share: float) -> None:
        """Say how much of a long turn is done."""
        self._connection.send(share)

    def lap(self, units: float, **values: Any) -> None:
        """A turn is over: so much was done in it. Returns at the next; raises Finished if there is none."""
        seconds, cpu = time.perf_counter() - self._began, time.process_time() - self._cpu
        self._connection.send(Lap(units, seconds, cpu, values))
        self._wait()

    def _wait(self) -> None:
        try:
            go = self._connection.recv()
        except EOFError:
            go = False
        if not go:
            raise Finished
        self.start_clock()


@dataclass(frozen=True)
class Side:
    """A function `run(pace, *arguments)` of a module, which opens, warms up, begins, and runs lap after lap."""

    run: Callable[..., None]
    arguments: Sequence[Any] = ()


class Runner:
    """The parent's end of the line."""

    def __init__(self, side: Side, stretch_s: float) -> None:
        self._connection, theirs = _CONTEXT.Pipe()
        self._process: BaseProcess = _CONTEXT.Process(target=_serve, args=(theirs, side, stretch_s))
        self._process.start()
        theirs.close()

    def ready(self) -> None:
        """Wait until the side is open and warm. Raises SideFailed."""
        self._receive(lambda share: None)

    def lap(self, tell: Tell = lambda share: None) -> Lap:
        """Give the side a turn. Raises SideFailed."""
        self._connection.send(True)
        lap = self._receive(tell)
        assert isinstance(lap, Lap)
        return lap

    def stop(self) -> None:
        """Have the side drop what it is at."""
        self._process.terminate()

    def end(self) -> None:
        """Let the side go, by force if it lingers."""
        with suppress(OSError):
            self._connection.send(False)
        self._process.join(_ENDS_WITHIN_S)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        self._connection.close()

    def _receive(self, tell: Tell) -> Any:
        while True:
            try:
                message = self._connection.recv()
            except (EOFError, OSError):
                self._process.join(_ENDS_WITHIN_S)
                raise SideFailed(f"a side ended with exit code {self._process.exitcode}") from None
            if isinstance(message, _Failure):
                raise SideFailed(message.traceback)
            if not isinstance(message, float):
                return message
            tell(message)


@dataclass(frozen=True)
class _Failure:
    traceback: str


def _serve(connection: Connection, side: Side, stretch_s: float) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to answer
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(1))  # what is open is closed
    try:
        side.run(Pace(connection, stretch_s), *side.arguments)
    except Finished:
        pass
    except Exception:
        connection.send(_Failure(traceback.format_exc()))
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)  # it is ending


@contextmanager
def opened(sides: Mapping[str, Side], stretch_s: float) -> Iterator[dict[str, Runner]]:
    """The sides, open and warm, one opened after the other."""
    runners: dict[str, Runner] = {}
    try:
        for name, side in sides.items():
            runners[name] = Runner(side, stretch_s)
            runners[name].ready()
        yield runners
    except BaseException:
        for runner in runners.values():
            runner.stop()
        raise
    finally:
        for runner in runners.values():
            runner.end()


def take_turns(sides: Mapping[str, Side], repeats: int, stretch_s: float, tell: Tell) -> dict[str, list[Lap]]:
    """Laps of all sides, taken in turns: there and back, so that none always follows the same other."""
    laps: dict[str, list[Lap]] = {name: [] for name in sides}
    with opened(sides, stretch_s) as runners:
        for repeat in range(repeats):
            for name in list(runners)[:: -1 if repeat % 2 else 1]:
                laps[name].append(runners[name].lap())
            tell((repeat + 1) / repeats)
    return laps


def best(laps: Sequence[Lap]) -> float:
    """Units a second of the lap that was disturbed least."""
    return max(lap.per_s for lap in laps)


def described(laps: Mapping[str, Sequence[Lap]]) -> dict[str, Any]:
    """The raw numbers of sides, for the details: rates are units a second."""
    return {
        name: {
            "best_per_s": best(each),
            "median_per_s": median(lap.per_s for lap in each),
            "best_per_own_cpu_s": max(lap.units / max(lap.own_cpu_s, 1e-9) for lap in each),
            "laps": [asdict(lap) for lap in each],
        }
        for name, each in laps.items()
    }
