"""The sides of a comparison: each runs in its own process, and the sides take turns.

A process has room for one libsumo, and the speed of a machine changes within seconds. So each side is opened and
warmed up once; then short laps of all sides alternate many times. While one side runs, the others wait.
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
_END_TIMEOUT_S = 20.0

OnProgress = Callable[[float], None]
"""Called with the finished share of a measurement, 0 to 1."""


class SideFailed(Exception):
    """A side of a comparison raised an exception; its traceback is the message."""


class Finished(BaseException):
    """Raised in a side when there is no further lap. Not an `Exception`, so that no code in between catches it."""


@dataclass(frozen=True, kw_only=True)
class Lap:
    """What a side did in one turn."""

    units: float
    """Work done, in the unit of the measurement: game-steps, steps or episodes."""
    seconds: float
    own_cpu_s: float
    """CPU time of the side's process alone: less than `seconds` if it waited for a core or for other processes."""
    values: Mapping[str, Any] = field(default_factory=dict)

    @property
    def per_s(self) -> float:
        """Units per second."""
        return self.units / self.seconds


class LapTimer:
    """The side's end of the connection: says when to run, measures laps and sends them to the parent."""

    def __init__(self, connection: Connection, lap_s: float) -> None:
        self._connection, self._lap_s = connection, lap_s
        self._start_s = self._start_cpu_s = 0.0

    def ready(self) -> None:
        """Report that the side is open and warm, and wait for its first turn."""
        self._connection.send("ready")
        self._wait()

    def lap_is_over(self) -> bool:
        """Whether the lap has lasted as long as it should."""
        return time.perf_counter() - self._start_s >= self._lap_s

    def restart_clock(self) -> None:
        """Start timing the lap now: what this turn did before was preparation."""
        self._start_s, self._start_cpu_s = time.perf_counter(), time.process_time()

    def progress(self, share: float) -> None:
        """Report the finished share of a long lap."""
        self._connection.send(share)

    def finish_lap(self, units: float, **values: Any) -> None:
        """Send the lap and wait for the next turn. Raises Finished if there is none."""
        seconds, cpu_s = time.perf_counter() - self._start_s, time.process_time() - self._start_cpu_s
        self._connection.send(Lap(units=units, seconds=seconds, own_cpu_s=cpu_s, values=values))
        self._wait()

    def _wait(self) -> None:
        try:
            proceed = self._connection.recv()
        except EOFError:
            proceed = False
        if not proceed:
            raise Finished
        self.restart_clock()


@dataclass(frozen=True, kw_only=True)
class Side:
    """A function `run(timer, *arguments)`, which opens, warms up, calls `timer.ready()` and runs lap after lap."""

    run: Callable[..., None]
    arguments: Sequence[Any] = ()


class Runner:
    """The parent's end of the connection to one side."""

    def __init__(self, side: Side, lap_s: float) -> None:
        self._connection, child_end = _CONTEXT.Pipe()
        self._process: BaseProcess = _CONTEXT.Process(target=_serve, args=(child_end, side, lap_s))
        self._process.start()
        child_end.close()

    def wait_until_ready(self) -> None:
        """Wait until the side is open and warm. Raises SideFailed."""
        self._receive(lambda share: None)

    def lap(self, on_progress: OnProgress = lambda share: None) -> Lap:
        """Run one lap of the side. Raises SideFailed."""
        self._connection.send(True)
        lap = self._receive(on_progress)
        assert isinstance(lap, Lap)
        return lap

    def terminate(self) -> None:
        """Interrupt the side."""
        self._process.terminate()

    def close(self) -> None:
        """End the side's process; kill it if it does not end in time."""
        with suppress(OSError):
            self._connection.send(False)
        self._process.join(_END_TIMEOUT_S)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        self._connection.close()

    def _receive(self, on_progress: OnProgress) -> Any:
        while True:
            try:
                message = self._connection.recv()
            except (EOFError, OSError):
                self._process.join(_END_TIMEOUT_S)
                raise SideFailed(f"a side ended with exit code {self._process.exitcode}") from None
            if isinstance(message, _Failure):
                raise SideFailed(message.traceback)
            if not isinstance(message, float):
                return message
            on_progress(message)


@dataclass(frozen=True)
class _Failure:
    traceback: str


def _serve(connection: Connection, side: Side, lap_s: float) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles Ctrl-C
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(1))  # so that `finally` blocks run
    try:
        side.run(LapTimer(connection, lap_s), *side.arguments)
    except Finished:
        pass
    except Exception:
        connection.send(_Failure(traceback.format_exc()))
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)  # the process is ending already


@contextmanager
def running_sides(sides: Mapping[str, Side], lap_s: float) -> Iterator[dict[str, Runner]]:
    """The sides, open and warm. They are opened one after the other."""
    runners: dict[str, Runner] = {}
    try:
        for name, side in sides.items():
            runners[name] = Runner(side, lap_s)
            runners[name].wait_until_ready()
        yield runners
    except BaseException:
        for runner in runners.values():
            runner.terminate()
        raise
    finally:
        for runner in runners.values():
            runner.close()


def take_turns(
    sides: Mapping[str, Side], *, repeats: int, lap_s: float, on_progress: OnProgress
) -> dict[str, list[Lap]]:
    """Laps of all sides in turns. The order is reversed every time, so that no side always follows the same other."""
    laps: dict[str, list[Lap]] = {name: [] for name in sides}
    with running_sides(sides, lap_s) as runners:
        for repeat in range(repeats):
            for name in list(runners)[:: -1 if repeat % 2 else 1]:
                laps[name].append(runners[name].lap())
            on_progress((repeat + 1) / repeats)
    return laps


def best_rate(laps: Sequence[Lap]) -> float:
    """Units per second of the least disturbed lap."""
    return max(lap.per_s for lap in laps)


def raw_numbers(laps: Mapping[str, Sequence[Lap]]) -> dict[str, Any]:
    """The raw numbers of the sides, for the details of the results. Rates are units per second."""
    return {
        name: {
            "best_per_s": best_rate(of_side),
            "median_per_s": median(lap.per_s for lap in of_side),
            "best_per_own_cpu_s": max(lap.units / max(lap.own_cpu_s, 1e-9) for lap in of_side),
            "laps": [asdict(lap) for lap in of_side],
        }
        for name, of_side in laps.items()
    }
