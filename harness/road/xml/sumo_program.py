"""Running a program of SUMO in a process of its own."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Sequence
from pathlib import Path

import sumo


def run_program(
    name: str, options: Sequence[str], folder: str | Path, patience_s: float
) -> subprocess.CompletedProcess[str] | None:
    """Run a program of the installed SUMO in a folder to its end; None if it takes longer than `patience_s`."""
    environment = {**os.environ, "SUMO_HOME": sumo.SUMO_HOME}
    try:
        return subprocess.run(
            [str(Path(sumo.SUMO_HOME) / "bin" / name), *options],
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=patience_s,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return None
