"""Simulations in a child process, used if libsumo of this process is in use: one message each way per call, and one
per step of all simulations of the child.

The child runs this module as a program. A user's script therefore does not have to be importable. The child's standard
input and output carry pickles; they are trusted, because the child is our own. Output that SUMO prints goes to standard
error. The child ends at the end of its input, and so with its parent.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import subprocess
import sys
import weakref
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import IO, Any, TypeAlias

from harness.errors import SimulationError
from harness.game.arrays import FloatArray
from harness.sumo.scene_games import SceneGames, can_share
from harness.sumo.simulation import Reading, Simulation


def open_simulations(parts: Sequence[SceneGames], *, seed: int) -> list[Simulation]:
    """Load SUMO with a tile for each game of several simulations.

    Simulations that can share one SUMO (`can_share`) do, and all of them place their players before one of them is
    stepped. The first one and those beside it are in this process if its libsumo is free; the others are in child
    processes, which give the same numbers. Raises SimulationError if SUMO can't load a scene.
    """
    import libsumo

    from harness.sumo.libsumo_simulation import LibsumoSimulation

    opened: dict[int, Simulation] = {}
    try:
        for numbers in _sharing(parts):
            load = SubprocessSimulation.side_by_side if libsumo.isLoaded() else LibsumoSimulation.side_by_side
            opened.update(zip(numbers, load([parts[k] for k in numbers], seed), strict=True))
    except BaseException:
        for each in opened.values():
            each.close()
        raise
    return [opened[k] for k in range(len(parts))]


def _sharing(parts: Sequence[SceneGames]) -> list[list[int]]:
    """The numbers of the parts, those together that can share one SUMO."""
    groups: list[list[int]] = []
    for number, part in enumerate(parts):
        group = next((each for each in groups if can_share(parts[each[0]], part)), None)
        if group is None:
            groups.append([number])
        else:
            group.append(number)
    return groups


_PATIENCE_S = 10.0  # time limit for a child to end
_Poses: TypeAlias = tuple[FloatArray, FloatArray, FloatArray]


class _Child:
    """The child process of simulations that share its SUMO. It ends with `close`, or with this object."""

    def __init__(self, parts: Sequence[SceneGames], seed: int) -> None:
        """Spawn the child and load SUMO in it. Raises SimulationError if either fails."""
        try:
            self.process = _spawn_child()
        except OSError as error:
            raise SimulationError(f"the process of another simulation could not be started: {error}") from error
        self._finalizer = weakref.finalize(self, _end_child, self.process)
        self.begin(len(parts))
        try:
            scenes = [replace(part.scene, folder=part.scene.folder.resolve()) for part in parts]
            self.call([replace(part, scene=scene) for part, scene in zip(parts, scenes, strict=True)], seed)
        except BaseException:
            self.close()
            raise

    def begin(self, simulations: int) -> None:
        """Forget the poses and readings of a step that was not made, or not by all simulations."""
        self.poses: list[_Poses | None] = [None] * simulations
        self._readings: dict[int, Reading] = {}

    def step(self, number: int) -> Reading:
        """The reading of a simulation after a step, which is made for all of them when the first one is stepped."""
        if number not in self._readings:
            placed = [each for each in self.poses if each is not None]
            if len(placed) < len(self.poses):
                raise SimulationError(f"{len(placed)} of {len(self.poses)} simulations have placed their players")
            readings = self.call("step", placed)
            self.begin(len(placed))
            self._readings = dict(enumerate(readings))
        return self._readings.pop(number)

    def call(self, *message: Any) -> Any:
        """The child's answer to a message. An interrupted exchange ends the child: its next answer would be old."""
        if not self._finalizer.alive:
            raise SimulationError("this simulation was closed")
        if self.process.poll() is not None:  # an old answer may still be in the pipe
            raise SimulationError(f"SUMO's process {_ending_of(self.process)}")
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        try:
            _send(self.process.stdin, message)
            answer, refusal = pickle.load(self.process.stdout)
        except (EOFError, OSError, pickle.UnpicklingError):
            raise SimulationError(f"SUMO's process {_ending_of(self.process)}") from None
        except BaseException:
            self.process.kill()
            self.process.wait()
            raise
        if refusal is not None:
            raise SimulationError(refusal)
        return answer

    def close(self) -> None:
        self._finalizer()


def _in_the_child(method: str) -> Any:
    """A method of a simulation that the one of the child process carries out."""
    return lambda simulation, *arguments: simulation.child.call(method, simulation._number, *arguments)


class SubprocessSimulation(Simulation):
    """A `LibsumoSimulation` in a child process, alone or beside others (`side_by_side`). The child ends with `close`,
    or with the last of these objects."""

    @classmethod
    def side_by_side(cls, parts: Sequence[SceneGames], seed: int) -> list[SubprocessSimulation]:
        """Load SUMO in a child process, as `LibsumoSimulation.side_by_side` does in this one. Raises SimulationError if
        the child can't be started, or SUMO refuses."""
        child = _Child(parts, seed)
        return [cls(child, number) for number in range(len(parts))]

    def __init__(self, child: _Child, number: int) -> None:
        """The simulation of this number in a child."""
        self.child, self._number = child, number

    reset, halt, remove, turn_signals = map(_in_the_child, ("reset", "halt", "remove", "turn_signals"))

    def reload(self, seed: int) -> None:
        self.child.begin(len(self.child.poses))
        self.child.call("reload", self._number, seed)

    def place(self, x_m: FloatArray, y_m: FloatArray, heading_rad: FloatArray) -> None:
        # sent with the next step: a message takes longer than placing
        self.child.poses[self._number] = x_m, y_m, heading_rad

    def step(self) -> Reading:
        return self.child.step(self._number)

    def close(self) -> None:
        self.child.close()


def _spawn_child() -> subprocess.Popen[bytes]:
    top = Path(__file__).resolve().parents[2]  # where `python -m` looks first
    path = os.pathsep.join(str(Path(each).resolve()) for each in sys.path)
    return subprocess.Popen(
        [sys.executable, "-m", "harness.sumo.subprocess_simulation"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        cwd=top,
        env={**os.environ, "PYTHONPATH": path},
        start_new_session=True,  # only the parent handles Ctrl-C
    )


def _end_child(child: subprocess.Popen[bytes]) -> None:
    assert child.stdin is not None
    assert child.stdout is not None
    with contextlib.suppress(OSError):  # the child may have died with input left
        child.stdin.close()
    try:
        child.wait(_PATIENCE_S)
    except subprocess.TimeoutExpired:
        child.kill()
        child.wait()
    child.stdout.close()


def _ending_of(child: subprocess.Popen[bytes]) -> str:
    try:
        code = child.wait(_PATIENCE_S)
    except subprocess.TimeoutExpired:
        child.kill()
        return "stopped answering"
    if code < 0:
        return f"died of {signal.Signals(-code).name}"
    return f"ended with exit code {code}"


def _send(stream: IO[bytes], message: Any) -> None:
    pickle.dump(message, stream, pickle.HIGHEST_PROTOCOL)
    stream.flush()


# --- in the child -----------------------------------------------------------------------------------------------------


def serve() -> None:
    """Serve the parent: the first message has the arguments of `LibsumoSimulation.side_by_side`, each other one a step
    of all simulations, or a method call of one."""
    from harness.sumo.libsumo_simulation import LibsumoSimulation

    incoming = sys.stdin.buffer
    outgoing = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    simulations: list[LibsumoSimulation] = []
    # the parent has closed this simulation, or has ended
    with contextlib.suppress(EOFError, BrokenPipeError, pickle.UnpicklingError):
        while True:
            first, *arguments = pickle.load(incoming)
            result, refusal = None, None
            try:
                if not simulations:
                    simulations = LibsumoSimulation.side_by_side(first, *arguments)
                elif first == "step":
                    for simulation, poses in zip(simulations, *arguments, strict=True):
                        simulation.place(*poses)
                    result = [simulation.step() for simulation in simulations]
                else:
                    number, *arguments = arguments
                    result = getattr(simulations[number], first)(*arguments)
            except SimulationError as error:
                refusal = str(error)
            except Exception as error:
                refusal = f"{type(error).__name__}: {error}"
            _send(outgoing, (result, refusal))
    if simulations:
        simulations[0].close()


if __name__ == "__main__":
    serve()
