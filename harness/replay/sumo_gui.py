"""Opening a replay in SUMO-GUI, on the screen or on a virtual one (Xvfb)."""

from __future__ import annotations

import contextlib
import os
import re
import select
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from harness.errors import HarnessError, Problem, UsageError
from harness.sumo.gui import WindowClosed, end_process, steered_gui

FOLLOWED_M = (80.0, 40.0)  # of road around the ego: a car of 4.6 m is then 73 pixels long
_EGO = "ego"
_END = re.compile(r'<(end|step-length) value="([0-9.]+)"')


def follow_in_sumo_gui(folder: Path, opened: Callable[[], None]) -> None:
    """Play a replay folder in SUMO-GUI with the view following the ego; return when the user closes SUMO-GUI.

    `opened` is called when the window is open. SUMO-GUI has no setting for the followed vehicle in a file, only a
    command over TraCI. Raises UsageError, with the remedy, when the folder is not a replay, or when there is no
    screen; SimulationError if SUMO-GUI can't start.
    """
    configuration, problems = folder / "scene.sumocfg", list[Problem]()
    if not configuration.is_file():
        remedy = "`harness replay RUN --list` lists the games"
        problems.append(Problem(str(folder), "", "is not a replay: it has no scene.sumocfg", remedy))
    remedy = f"film it: --film game.gif; or on a computer with a desktop and SUMO: sumo-gui -c {configuration}"
    if no_screen := screen_problem(remedy):
        problems.append(no_screen)
    if problems:
        raise UsageError(problems)
    options = dict(_END.findall(configuration.read_text(encoding="utf-8")))
    steps = round(float(options["end"]) / float(options["step-length"]))
    with steered_gui(["-c", str(configuration)]) as window:
        opened()
        try:
            following = False
            for _ in range(steps):
                window.step()
                if not following and window.has(_EGO):
                    window.look_at(0.0, 0.0, *FOLLOWED_M)
                    window.follow(_EGO)
                    following = True
        except WindowClosed:
            return
        window.release()
        window.process.wait()


def screen_problem(remedy: str) -> Problem | None:
    """The problem that there is no screen for SUMO-GUI; None if there is one."""
    if sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
        return Problem("sumo-gui", "DISPLAY", "there is no screen for it", remedy)
    return None


_STARTS_WITHIN_S = 30.0


def find_xvfb() -> Path | None:
    """The path of Xvfb, the X server without a screen; None if it is not installed."""
    found = shutil.which("Xvfb")
    return Path(found) if found else None


@contextlib.contextmanager
def virtual_screen(program: Path, size_px: tuple[int, int]) -> Iterator[str]:
    """The name of a new screen, such as ":1". Raises HarnessError with Xvfb's message if it can't start."""
    read, write = os.pipe()
    screen = f"{size_px[0]}x{size_px[1]}x24"
    # Xvfb chooses a free number and writes it when it is ready
    command = [
        str(program),
        "-displayfd",
        str(write),
        "-screen",
        "0",
        screen,
        "-noreset",
        "-nolisten",
        "tcp",
        "+extension",
        "GLX",
    ]
    with tempfile.TemporaryFile() as log:
        try:
            server = subprocess.Popen(command, pass_fds=(write,), stdout=log, stderr=log)
        finally:
            os.close(write)
        try:
            ready, _, _ = select.select([read], [], [], _STARTS_WITHIN_S)
            number = os.read(read, 16).decode().strip() if ready else ""
            if not number:
                log.seek(0)
                raise HarnessError(f"{program} can't start: {log.read().decode(errors='replace').strip()}")
            yield f":{number}"
        finally:
            os.close(read)
            end_process(server)
