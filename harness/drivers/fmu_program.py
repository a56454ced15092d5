"""The program that runs an FMU as a driver: one instance per game, one step per decision.

`python -m harness.drivers.fmu_program SPEC` implements the protocol of `harness.drivers.process`. A decision at time t
sets the inputs from the observation, does the step from t to t + step, and answers with the outputs.
"""

from __future__ import annotations

import ctypes
import json
import os
import shutil
import sys
import tempfile
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Any

import fmpy
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

from harness.drivers.fmu_variables import entry_as, setter_of
from harness.drivers.process import PROTOCOL
from harness.errors import DriverError

_LOG_LINES, _LOG_CHARACTERS = 3, 160
_ONE_GAME = "give the campaign training.games = 1 and reconfiguration.games_at_once = 1"
_log: deque[str] = deque(maxlen=_LOG_LINES)
"""The last messages of the FMU's log that are at least warnings."""


class _Instance:
    """The FMU's instance for one game."""

    def __init__(self, spec: Mapping[str, Any], description: Any, folder: str, game: int) -> None:
        version = str(description.fmiVersion)
        self._is_fmi2 = version.startswith("2.")
        self.is_only_one = bool(description.coSimulation.canBeInstantiatedOnlyOncePerProcess)
        inputs, self._outputs, start = spec["wiring"][:3]
        self._step_s, self._steps = spec["step_s"], 0
        self._inputs: dict[str, list[tuple[int, int, str]]] = {}  # by the function that sets them
        for reference, entry, kind in inputs:
            self._inputs.setdefault(setter_of(version, kind), []).append((reference, entry, kind))
        slave = FMU2Slave if self._is_fmi2 else FMU3Slave
        self._fmu = slave(
            guid=description.guid,
            unzipDirectory=folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=f"game{game}",
        )
        if self._is_fmi2:
            self._callbacks = fmi2_callbacks(_note)
            self._fmu.instantiate(callbacks=self._callbacks, loggingOn=True)
        else:
            self._fmu.instantiate(loggingOn=True, logMessage=_note)
        for reference, value, kind in start:
            getattr(self._fmu, setter_of(version, kind))([reference], [value])
        if self._is_fmi2:
            self._fmu.setupExperiment(startTime=0.0)
            self._fmu.enterInitializationMode()
        else:
            self._fmu.enterInitializationMode(startTime=0.0)
        self._fmu.exitInitializationMode()

    def decide(self, observation: Sequence[float]) -> list[float]:
        for setter, inputs in self._inputs.items():
            values = [entry_as(kind, observation[entry]) for _, entry, kind in inputs]
            getattr(self._fmu, setter)([reference for reference, _, _ in inputs], values)
        now_s = self._steps * self._step_s
        result = self._fmu.doStep(currentCommunicationPoint=now_s, communicationStepSize=self._step_s)
        if not self._is_fmi2 and result[1]:
            raise DriverError("the FMU requests the end of the simulation")
        self._steps += 1
        outputs = (self._fmu.getReal if self._is_fmi2 else self._fmu.getFloat64)(self._outputs)
        return [float(value) for value in outputs]

    def close(self) -> None:
        self._fmu.terminate()
        self._fmu.freeInstance()


def _note(environment: Any, *message: Any) -> None:
    """Keep a message of the FMU's log. FMI 2.0 tells the instance's name first."""
    status, _, text = message[-3:]
    if status:
        _log.append(" ".join(text.decode("utf-8", "replace").split())[:_LOG_CHARACTERS] if text else "")


def fmi2_callbacks(note: Callable[..., None]) -> Any:
    """The callbacks of FMI 2.0 with a logger of ours."""
    from fmpy import fmi2

    callbacks = fmi2.fmi2CallbackFunctions()
    callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(note)
    callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmi2.calloc)
    callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmi2.free)
    with suppress(Exception):  # the formatting of variadic messages is a library for some platforms only
        from fmpy.logging import addLoggerProxy

        addLoggerProxy(ctypes.byref(callbacks))
    return callbacks


def main() -> None:
    """Answer messages until the input ends."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what the FMU prints must not reach the stream of answers
    spec = json.loads(sys.argv[1])
    folder = tempfile.mkdtemp(prefix="harness-fmu-")
    try:
        fmpy.extract(spec["file"], unzipdir=folder)
        new_instance = partial(_Instance, spec, fmpy.read_model_description(folder), folder)
        instances: dict[int, _Instance] = {}
        for line in sys.stdin:
            try:
                answer = _answer(json.loads(line), instances, new_instance)
            except Exception as error:  # FMPy and ctypes may raise any exception
                in_words = isinstance(error, DriverError | FMICallException)
                told = str(error).rstrip(".") if in_words else f"{type(error).__name__}: {error}"
                answer = {"error": f"{told}; its log: {' / '.join(_log)}" if _log else told}
                _log.clear()
            answers.write(json.dumps(answer) + "\n")
            answers.flush()
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _answer(
    message: Mapping[str, Any], instances: dict[int, _Instance], new_instance: Callable[[int], _Instance]
) -> dict[str, Any]:
    if message["type"] == "hello":
        return {"protocol": PROTOCOL}
    games = message["games"]
    if message["type"] == "reset":
        for game in games:
            if game in instances:
                instances.pop(game).close()
            if any(each.is_only_one for each in instances.values()):
                raise DriverError(f"the FMU can play one game at a time only: {_ONE_GAME}")
            instances[game] = new_instance(game)
        return {}
    return {"actions": [instances[game].decide(row) for game, row in zip(games, message["observation"], strict=True)]}


if __name__ == "__main__":
    main()
