"""A simulation in a child process, for when this process's libsumo is taken: one message each way per verb.

The child is this module run as a program, so that a user's script need not be one that can be imported again. Its
standard input and output carry pickles, each with its length before it; they are trusted, being our own child's.
What SUMO prints goes to standard error instead. The child ends when its input does: a parent's death leaves no orphan.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import struct
import subprocess
import sys
import weakref
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import IO, Any

from harness.errors import SimulationError
from harness.game.arrays import FloatArray
from harness.game.initial_state import InitialState
from harness.traffic.route_file import Departure
from harness.traffic.scene import OpenScene
from harness.traffic.simulation import Reading

_LENGTH = struct.Struct("<Q")
_PATIENCE_S = 10.0  # how long a child may take to end


class SubprocessSimulation:
    """A `LibsumoSimulation` of a child process. The child ends with `close`, or when nobody refers to this any more."""

    def __init__(
        self, scene: OpenScene, games: int, taken_over: Sequence[bool], seed: int, recorded: bool = False
    ) -> None:
        """Start the child and load SUMO in it. Raises SimulationError if it can't be started, or SUMO refuses."""
        try:
            self._child = _start_child()
        except OSError as error:
            raise SimulationError(f"no process could be started for another simulation: {error}") from error
        self._end = weakref.finalize(self, _end, self._child)
        try:
            self._ask(replace(scene, folder=scene.folder.resolve()), games, tuple(taken_over), seed, recorded)
        except BaseException:
            self.close()
            raise

    def reload(self, seed: int) -> None:
        """Start SUMO anew, with its random numbers from `seed`: every game has to be started again."""
        self._ask("reload", seed)

    def reset(self, game: int, start: InitialState, departures: list[Departure]) -> None:
        """Clear a game's tile and put its players at their start; others depart as time goes by."""
        self._ask("reset", game, start, departures)

    def halt(self, game: int, player: int) -> None:
        """Whoever drove a player, from now on it stands where `step` says."""
        self._ask("halt", game, player)

    def remove(self, game: int, player: int) -> None:
        """Take a player out of the traffic."""
        self._ask("remove", game, player)

    def step(self, x_m: FloatArray, y_m: FloatArray, heading_rad: FloatArray) -> Reading:
        """Place the players that are taken over at poses [G, P] of their centres, let SUMO step, read the rest."""
        reading: Reading = self._ask("step", x_m, y_m, heading_rad)
        return reading

    def close(self) -> None:
        """End the child. Closing twice is closing once."""
        self._end()

    def _ask(self, *message: Any) -> Any:
        """The child's answer to a message. A child that was interrupted halfway is of no more use, and is ended."""
        if not self._end.alive:
            raise SimulationError("this simulation was closed")
        if self._child.poll() is not None:  # or an answer that it left behind would be taken for this one's
            raise SimulationError(f"the process that SUMO ran in {_how_it_ended(self._child)}")
        assert self._child.stdin is not None
        assert self._child.stdout is not None
        try:
            _send(self._child.stdin, message)
            answer, refusal = _receive(self._child.stdout)
        except (EOFError, OSError):
            raise SimulationError(f"the process that SUMO ran in {_how_it_ended(self._child)}") from None
        except BaseException:
            self._child.kill()
            self._child.wait()
            raise
        if refusal is not None:
            raise SimulationError(refusal)
        return answer


def _start_child() -> subprocess.Popen[bytes]:
    top = Path(__file__).resolve().parents[2]  # where `python -m` looks first
    path = os.pathsep.join(str(Path(each).resolve()) for each in sys.path)
    return subprocess.Popen(
        [sys.executable, "-m", "harness.traffic.subprocess_simulation"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        cwd=top,
        env={**os.environ, "PYTHONPATH": path},
        start_new_session=True,  # Ctrl-C is the parent's to answer
    )


def _end(child: subprocess.Popen[bytes]) -> None:
    assert child.stdin is not None
    assert child.stdout is not None
    with contextlib.suppress(OSError):  # it may have died before it read everything
        child.stdin.close()
    try:
        child.wait(_PATIENCE_S)
    except subprocess.TimeoutExpired:
        child.kill()
        child.wait()
    child.stdout.close()


def _how_it_ended(child: subprocess.Popen[bytes]) -> str:
    try:
        code = child.wait(_PATIENCE_S)
    except subprocess.TimeoutExpired:
        child.kill()
        return "stopped answering"
    if code < 0:
        return f"died of {signal.Signals(-code).name}"
    return f"ended with exit code {code}"


def _send(stream: IO[bytes], message: Any) -> None:
    content = pickle.dumps(message, pickle.HIGHEST_PROTOCOL)
    stream.write(_LENGTH.pack(len(content)) + content)
    stream.flush()


def _receive(stream: IO[bytes]) -> Any:
    """The next message. Raises EOFError where the stream ends."""
    (length,) = _LENGTH.unpack(_read(stream, _LENGTH.size))
    return pickle.loads(_read(stream, length))


def _read(stream: IO[bytes], count: int) -> bytes:
    content = stream.read(count)
    if len(content) < count:
        raise EOFError
    return content


# --- in the child -----------------------------------------------------------------------------------------------------


def serve() -> None:
    """Answer the parent: its first message is what a `LibsumoSimulation` is made of, each further one a verb."""
    from harness.traffic.libsumo_simulation import LibsumoSimulation

    incoming = sys.stdin.buffer
    outgoing = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    simulation: LibsumoSimulation | None = None

    def answer(verb: Any, *arguments: Any) -> Any:
        nonlocal simulation
        if simulation is None:
            simulation = LibsumoSimulation(verb, *arguments)
            return None
        return getattr(simulation, verb)(*arguments)

    with contextlib.suppress(EOFError, BrokenPipeError):  # the parent has closed this simulation, or is gone
        while True:
            message = _receive(incoming)
            result, refusal = None, None
            try:
                result = answer(*message)
            except SimulationError as error:
                refusal = str(error)
            except Exception as error:
                refusal = f"{type(error).__name__}: {error}"
            _send(outgoing, (result, refusal))
    if simulation is not None:
        simulation.close()


if __name__ == "__main__":
    serve()
