"""Opening a replay in SUMO-GUI."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

from harness.errors import Problem, UsageError


def open_in_sumo_gui(folder: Path) -> subprocess.Popen[bytes]:
    """Start SUMO-GUI on a replay folder and return without waiting for it.

    Raises UsageError, naming the remedy, when the folder is no replay, when there is no SUMO-GUI or when
    there is no screen to show it on.
    """
    configuration = folder / "scene.sumocfg"
    program = find_sumo_gui()
    problems = []
    if not configuration.is_file():
        problems.append(
            Problem(
                str(folder),
                "",
                "is not a replay: it has no scene.sumocfg",
                "`harness replay RUN --list` names them",
            )
        )
    if program is None:
        problems.append(
            Problem(
                "sumo-gui",
                "",
                "is not installed",
                "pip install eclipse-sumo, or put SUMO's bin folder on PATH",
            )
        )
    if sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
        problems.append(
            Problem(
                "sumo-gui",
                "DISPLAY",
                "there is no screen to show it on",
                f"on a computer with a desktop and SUMO: sumo-gui -c {configuration}; over a network: ssh -X",
            )
        )
    if problems or program is None:
        raise UsageError(problems)
    environment = os.environ | {"SUMO_HOME": str(_home_of(program))}
    return subprocess.Popen([program, "-c", str(configuration)], env=environment)


def find_sumo_gui() -> Path | None:
    """SUMO-GUI of the installed `eclipse-sumo`, the one the game was played with; else the one on PATH."""
    package = importlib.util.find_spec("sumo")  # not imported: that would change the environment
    for location in (package.submodule_search_locations or []) if package else []:
        found = shutil.which("sumo-gui", path=str(Path(location) / "bin"))
        if found:
            return Path(found)
    found = shutil.which("sumo-gui")
    return Path(found) if found else None


def _home_of(program: Path) -> Path:
    """SUMO's own folder, where it finds its data: the one above `bin`, but for a distribution's layout."""
    home = program.resolve().parent.parent
    return home if (home / "data").is_dir() else Path(os.environ.get("SUMO_HOME", "/usr/share/sumo"))
