"""A simulation in a child process, used if libsumo of this process is in use: one message each way per call.

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
from typing import IO, Any

from harness.errors import SimulationError
from harness.game.arrays import FloatArray
from harness.sumo.scene_games import SceneGames, can_share
from harness.sumo.simulation import Reading, Simulation


def open_simulations(parts: Sequence[SceneGames], *, seed: int) -> list[Simulation]:
    """Load SUMO with a tile for each game of several simulations.

    The first simulation, and all that can share its SUMO (`can_share`), are in this process if its libsumo is free;
    each other one is in a child process of its own. Where simulations share SUMO, all of them place their players
    before one of them is stepped. A child process gives the same numbers as this one, and needs one message each way
    per call. Raises SimulationError if SUMO can't load a scene.
    """
    import libsumo

    from harness.sumo.libsumo_simulation import LibsumoSimulation

    here = [] if libsumo.isLoaded() else [k for k, part in enumerate(parts) if can_share(parts[0], part)]
    opened: dict[int, Simulation] = {}
    try:
        if here:
            opened.update(zip(here, LibsumoSimulation.side_by_side([parts[k] for k in here], seed), strict=True))
        for k, part in enumerate(parts):
            if k not in opened:
                opened[k] = SubprocessSimulation(part, seed)
    except BaseException:
        for each in opened.values():
            each.close()
        raise
    return [opened[k] for k in range(len(parts))]


_PATIENCE_S = 10.0  # time limit for a child to end


def _in_the_child(method: str) -> Any:
    """A method of a simulation that the one of the child process carries out."""
    return lambda simulation, *arguments: simulation._call(method, *arguments)


class SubprocessSimulation(Simulation):
    """A `LibsumoSimulation` in a child process. The child ends with `close`, or with this object."""

    def __init__(self, games: SceneGames, seed: int) -> None:
        """Spawn the child and load SUMO in it. Raises SimulationError if either fails."""
        try:
            self._child = _spawn_child()
        except OSError as error:
            raise SimulationError(f"the process of another simulation could not be started: {error}") from error
        self._finalizer = weakref.finalize(self, _end_child, self._child)
        try:
            scene = replace(games.scene, folder=games.scene.folder.resolve())
            self._call(replace(games, scene=scene), seed)
        except BaseException:
            self.close()
            raise

    reload, reset, halt, remove = map(_in_the_child, ("reload", "reset", "halt", "remove"))
    turn_signals = _in_the_child("turn_signals")

    def place(self, x_m: FloatArray, y_m: FloatArray, heading_rad: FloatArray) -> None:
        self._poses = x_m, y_m, heading_rad  # sent with the next step: a message takes longer than placing

    def step(self) -> Reading:
        reading: Reading = self._call("step", *self._poses)
        return reading

    def close(self) -> None:
        self._finalizer()

    def _call(self, *message: Any) -> Any:
        """The child's answer to a message. An interrupted exchange ends the child: its next answer would be old."""
        if not self._finalizer.alive:
            raise SimulationError("this simulation was closed")
        if self._child.poll() is not None:  # an old answer may still be in the pipe
            raise SimulationError(f"SUMO's process {_ending_of(self._child)}")
        assert self._child.stdin is not None
        assert self._child.stdout is not None
        try:
            _send(self._child.stdin, message)
            answer, refusal = pickle.load(self._child.stdout)
        except (EOFError, OSError, pickle.UnpicklingError):
            raise SimulationError(f"SUMO's process {_ending_of(self._child)}") from None
        except BaseException:
            self._child.kill()
            self._child.wait()
            raise
        if refusal is not None:
            raise SimulationError(refusal)
        return answer


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
    """Serve the parent: the first message has the arguments of a `LibsumoSimulation`, each other one a method call."""
    from harness.sumo.libsumo_simulation import LibsumoSimulation

    incoming = sys.stdin.buffer
    outgoing = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    simulation: LibsumoSimulation | None = None
    # the parent has closed this simulation, or has ended
    with contextlib.suppress(EOFError, BrokenPipeError, pickle.UnpicklingError):
        while True:
            first, *arguments = pickle.load(incoming)
            result, refusal = None, None
            try:
                if simulation is None:
                    [simulation] = LibsumoSimulation.side_by_side([first], *arguments)
                elif first == "step":
                    simulation.place(*arguments)
                    result = simulation.step()
                else:
                    result = getattr(simulation, first)(*arguments)
            except SimulationError as error:
                refusal = str(error)
            except Exception as error:
                refusal = f"{type(error).__name__}: {error}"
            _send(outgoing, (result, refusal))
    if simulation is not None:
        simulation.close()


if __name__ == "__main__":
    serve()
