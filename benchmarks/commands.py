"""Wall time of the commands that a user waits for."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path
from statistics import median

from benchmarks.budget import Budget
from benchmarks.figures import Measured
from benchmarks.games import REPOSITORY
from benchmarks.sides import OnProgress

_COMMANDS = {"help_seconds": ["--help"], "check_seconds": ["check", "campaigns/merge.toml"]}


def command_seconds(budget: Budget, on_progress: OnProgress) -> Measured:
    """Wall time of commands in seconds: the median of several starts, without the first."""
    program = str(Path(sys.executable).with_name("harness"))
    seconds: dict[str, list[float]] = {name: [] for name in _COMMANDS}
    for done in range(budget.starts + 1):
        for name, arguments in _COMMANDS.items():
            start_s = time.perf_counter()
            subprocess.run([program, *arguments], cwd=REPOSITORY, check=True, capture_output=True)
            seconds[name].append(time.perf_counter() - start_s)
        on_progress((done + 1) / (budget.starts + 1))
    return {name: median(of_command[1:]) for name, of_command in seconds.items()}, {
        "unit": "s",
        "seconds": seconds,
    }
