"""The program that runs an FMU as a driver: one instance per game, one step per decision.

`python -m harness.drivers.fmu_program SPEC` implements the protocol of `harness.drivers.process`. A decision at time t
sets the inputs from the observation, does the step from t to t + step, and answers with the outputs.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
import tempfile
from collections.abc import Mapping, Sequence
from typing import Any

import fmpy
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

from harness.drivers.process import PROTOCOL

_ONE_GAME = "give the campaign training.games = 1 and reconfiguration.games_at_once = 1"


class _Instance:
    """The FMU's instance for one game."""

    def __init__(self, spec: Mapping[str, Any], description: Any, folder: str, game: int) -> None:
        self._is_fmi2 = str(description.fmiVersion).startswith("2.")
        self._wiring, self._step_s, self._steps = spec["wiring"], spec["step_s"], 0
        slave = FMU2Slave if self._is_fmi2 else FMU3Slave
        self._fmu = slave(
            guid=description.guid,
            unzipDirectory=folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=f"game{game}",
        )
        self._fmu.instantiate()
        start = self._wiring[2]
        self._set([vr for vr, _ in start], [value for _, value in start])
        if self._is_fmi2:
            self._fmu.setupExperiment(startTime=0.0)
            self._fmu.enterInitializationMode()
        else:
            self._fmu.enterInitializationMode(startTime=0.0)
        self._fmu.exitInitializationMode()

    def decide(self, observation: Sequence[float]) -> list[float]:
        inputs, outputs, _ = self._wiring
        self._set([vr for vr, _ in inputs], [observation[entry] for _, entry in inputs])
        now_s = self._steps * self._step_s
        result = self._fmu.doStep(currentCommunicationPoint=now_s, communicationStepSize=self._step_s)
        if not self._is_fmi2 and result[1]:
            raise RuntimeError("the FMU requests the end of the simulation")
        self._steps += 1
        return [float(value) for value in (self._fmu.getReal if self._is_fmi2 else self._fmu.getFloat64)(outputs)]

    def close(self) -> None:
        self._fmu.terminate()
        self._fmu.freeInstance()

    def _set(self, references: list[int], values: list[float]) -> None:
        if references:
            (self._fmu.setReal if self._is_fmi2 else self._fmu.setFloat64)(references, values)


def main() -> None:
    """Answer messages until the input ends."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what the FMU prints must not reach the stream of answers
    spec = json.loads(sys.argv[1])
    folder = tempfile.mkdtemp(prefix="harness-fmu-")
    try:
        fmpy.extract(spec["file"], unzipdir=folder)
        description = fmpy.read_model_description(folder)
        instances: dict[int, _Instance] = {}
        for line in sys.stdin:
            try:
                answer = _answer(json.loads(line), spec, description=description, folder=folder, instances=instances)
            except Exception as error:  # FMPy and ctypes may raise any exception
                answer = {"error": f"{type(error).__name__}: {error}"}
            answers.write(json.dumps(answer) + "\n")
            answers.flush()
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _answer(
    message: Mapping[str, Any], spec: Mapping[str, Any], description: Any, folder: str, instances: dict[int, _Instance]
) -> dict[str, Any]:
    if message["type"] == "hello":
        return {"protocol": PROTOCOL}
    games = message["games"]
    if message["type"] == "reset":
        for game in games:
            if game in instances:
                instances.pop(game).close()
            if instances and description.coSimulation.canBeInstantiatedOnlyOncePerProcess:
                raise RuntimeError(f"the FMU can play one game at a time only: {_ONE_GAME}")
            instances[game] = _Instance(spec, description, folder, game)
        return {}
    return {"actions": [instances[game].decide(row) for game, row in zip(games, message["observation"], strict=True)]}


if __name__ == "__main__":
    main()
