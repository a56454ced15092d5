"""A program as a driver: one line of JSON per message and per answer over its standard streams, with a deadline.

The messages are those of docs/egos-by-programs.md. A program that crashes, misses a deadline or sends an invalid answer
is killed, and its game fails; the next game starts a new process. The program is killed with its driver and with the
harness.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from harness.drivers.car import Car
from harness.drivers.running_program import NoAnswer, Program
from harness.errors import DriverError
from harness.game.arrays import FloatArray, IntArray
from harness.game.cartesian_view import CartesianView
from harness.game.observation_layout import LAYOUT

PROTOCOL = 2
_LONGEST_ERROR = 600


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
        self._program: Program | None = None
        self._shown: dict[str, Any] = {}  # added to the message of a decision

    def reset(self, games: IntArray) -> None:
        """Reset games [N]. Raises DriverError if the program can't be started or does not support the protocol."""
        if self._program is None or not self._program.is_running:
            self.close()
            self._program = Program(self._command, self._folder)
            answer = self._request(self._hello, self._start_deadline_s)
            if answer.get("protocol") != PROTOCOL:
                raise self._failure(f"does not support protocol {PROTOCOL}: it answered hello with {_short(answer)}")
        self._request({"type": "reset", "games": games.tolist()}, self._start_deadline_s)

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """Actions [N, 2] from observations [N, SIZE]. Raises DriverError if the program gives no valid
        answer."""
        rows = self._car.physical(observation) if self._si else observation
        message = {"type": "decide", "games": games.tolist(), "observation": rows.tolist(), "noise": noise.tolist()}
        message |= self._shown
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
        except NoAnswer as error:
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


class PlanningProcess(ProcessDriver):
    """Drives by the answers of a program that gets views in Cartesian coordinates with its observations."""

    def __init__(self, *arguments: Any, history_s: float, **options: Any) -> None:
        """The arguments but `history_s` are those of `ProcessDriver`."""
        super().__init__(*arguments, **options)
        self.history_s = history_s
        self._told: Program | None = None  # the program that has the road

    def see(self, games: IntArray, views: Sequence[CartesianView]) -> None:
        """Keep the views [N] for the next decision. A program that has just started gets the road first. Raises
        DriverError if it does not take it."""
        if self._program is not self._told:
            self._request({"type": "road", "road": _plain(views[0].road)}, self._start_deadline_s)
            self._told = self._program
        self._shown = {"views": [_plain_view(view, with_history=self.history_s > 0.0) for view in views]}


def _plain_view(view: CartesianView, *, with_history: bool) -> dict[str, Any]:
    """A view as a message has it: without the road, which the program has."""
    own = {each.name: _plain(getattr(view, each.name)) for each in fields(view) if each.name not in ("road", "history")}
    if with_history:
        own["history"] = [_plain_view(each, with_history=False) for each in view.history]
    return own


def _plain(value: Any) -> Any:
    """A value of a road or a view, such as JSON has it."""
    if is_dataclass(value):
        return {each.name: _plain(getattr(value, each.name)) for each in fields(value)}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Mapping):
        return {key: _plain(each) for key, each in value.items()}
    return [_plain(each) for each in value] if isinstance(value, tuple) else value


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
