"""Control of SUMO-GUI by TraCI: it plays a replay folder, follows a vehicle, takes screenshots.

The user can't close SUMO-GUI 1.28 while a connected client does not step. This module therefore never waits between
steps. SUMO-GUI itself waits for its delay, at breakpoints, and when its user pauses it.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import sumo
import traci
from sumolib.miscutils import getFreeSocketPort
from traci.exceptions import FatalTraCIError, TraCIException

from harness.errors import SimulationError

SUMO_GUI = Path(sumo.SUMO_HOME) / "bin" / "sumo-gui"
"""That of the installed package `eclipse-sumo`, the version of the game."""
_CONNECTS_WITHIN_S = 60.0
_RETRIES_EVERY_S = 0.1
_ANSWERS_WITHIN_S = 60.0
_ENDS_WITHIN_S = 10.0


_STAYS_FOR, _LOOKS_EVERY_S, _CENTRED_M = 5, 0.05, 0.1  # looks in a row at which the view is where it should be


class WindowClosed(SimulationError):
    """SUMO-GUI has ended, or its user closed it."""


class GuiWindow:
    """A running SUMO-GUI that waits for steps. Every method but `release` raises WindowClosed if SUMO-GUI has ended."""

    def __init__(self, connection: Any, process: subprocess.Popen[bytes], *, patient: bool) -> None:
        self._connection, self.process = connection, process
        # traci has no option for a timeout; a SUMO-GUI that shows an error dialogue never answers
        connection._socket.settimeout(_ANSWERS_WITHIN_S)
        self._view = self._call(connection.gui.getIDList)[0]
        if patient:
            connection._socket.settimeout(None)

    def step(self) -> None:
        """Play one step, at the pace of SUMO-GUI."""
        self._call(self._connection.simulationStep)

    def has(self, vehicle: str) -> bool:
        """Whether a vehicle is in the traffic."""
        return vehicle in self._call(self._connection.vehicle.getIDList)

    def follow(self, vehicle: str) -> None:
        """Keep a vehicle of the traffic in the centre of the view."""
        self._call(self._connection.gui.trackVehicle, self._view, vehicle)

    def look_at(self, x_m: float, y_m: float, width_m: float, height_m: float) -> None:
        """Show an area around a point."""
        half_width, half_height = 0.5 * width_m, 0.5 * height_m
        corners = (x_m - half_width, y_m - half_height, x_m + half_width, y_m + half_height)
        self._call(self._connection.gui.setBoundary, self._view, *corners)

    def wait_until_it_looks_at(self, x_m: float, y_m: float, width_m: float, height_m: float) -> None:
        """Show an area and wait until the view stays there: while SUMO-GUI starts, it still applies its own view.

        Raises WindowClosed if the view does not stay there.
        """
        stays, until = 0, time.monotonic() + _ANSWERS_WITHIN_S
        while stays < _STAYS_FOR:
            if time.monotonic() > until:
                raise WindowClosed("SUMO-GUI does not show the requested area")
            self.look_at(x_m, y_m, width_m, height_m)
            time.sleep(_LOOKS_EVERY_S)
            (left, bottom), (right, top) = self._call(self._connection.gui.getBoundary, self._view)
            centred = abs(0.5 * (left + right) - x_m) < _CENTRED_M and abs(0.5 * (bottom + top) - y_m) < _CENTRED_M
            stays = stays + 1 if centred else 0

    def photograph_next(self, file: Path, size_px: tuple[int, int]) -> None:
        """Take a screenshot of the next step. The file exists after that step."""
        self._call(self._connection.gui.screenshot, self._view, str(file), *size_px)

    def release(self) -> None:
        """End the simulation. The window stays open until its user closes it."""
        with contextlib.suppress(TraCIException, FatalTraCIError, OSError):
            self._connection.close(wait=False)

    def _call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return function(*arguments)
        except (FatalTraCIError, OSError) as error:
            raise WindowClosed(f"SUMO-GUI has ended: {error}") from error


@contextlib.contextmanager
def steered_gui(options: list[str], *, display: str | None = None, patient: bool = True) -> Iterator[GuiWindow]:
    """Start SUMO-GUI with options on the screen `display` (None: the user's), and end it at the end of the block.

    With `patient`, a step has no time limit, because the user may pause SUMO-GUI. Raises SimulationError, with the
    output of SUMO-GUI, if it can't start.
    """
    environment = os.environ | {"SUMO_HOME": sumo.SUMO_HOME} | ({"DISPLAY": display} if display else {})
    port = getFreeSocketPort()
    with tempfile.TemporaryDirectory(prefix="harness-gui-") as folder, tempfile.TemporaryFile() as output:
        errors = Path(folder) / "errors"
        command = [str(SUMO_GUI), *options, "--remote-port", str(port), "--error-log", str(errors)]
        process = subprocess.Popen(command, env=environment, stdout=output, stderr=output)
        try:
            try:
                window = GuiWindow(_connect(port, process), process, patient=patient)
            except (OSError, WindowClosed) as error:
                output.seek(0)
                logged = errors.read_bytes() if errors.is_file() else b""
                message = (logged or output.read()).decode(errors="replace").strip() or str(error)
                raise SimulationError(f"SUMO-GUI can't start: {message}") from None
            yield window
        finally:
            end_process(process)


def _connect(port: int, process: subprocess.Popen[bytes]) -> Any:
    until = time.monotonic() + _CONNECTS_WITHIN_S
    while True:
        # retries by traci print to the user's terminal
        with contextlib.suppress(FatalTraCIError, TraCIException, OSError):
            return traci.connect(port, numRetries=0, proc=process)
        if process.poll() is not None:
            raise OSError(f"it ended with exit code {process.returncode}")
        if time.monotonic() > until:
            raise OSError(f"it did not answer within {_CONNECTS_WITHIN_S:.0f} s")
        time.sleep(_RETRIES_EVERY_S)


def end_process(process: subprocess.Popen[bytes]) -> None:
    """Terminate a program, and kill it if it does not end in time."""
    process.terminate()
    try:
        process.wait(timeout=_ENDS_WITHIN_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
