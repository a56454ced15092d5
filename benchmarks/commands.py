"""How long the command line makes its user wait."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.budget import Budget
from benchmarks.games import REPOSITORY
from benchmarks.sides import Tell

_COMMANDS = {"help_seconds": ["--help"], "check_seconds": ["check", "campaigns/merge.toml"]}


def waiting(budget: Budget, tell: Tell) -> tuple[dict[str, float], dict[str, Any]]:
    """Wall time of commands in seconds, the median of several starts after a first one."""
    program = str(Path(sys.executable).with_name("harness"))
    taken: dict[str, list[float]] = {name: [] for name in _COMMANDS}
    for done in range(budget.starts + 1):
        for name, arguments in _COMMANDS.items():
            began = time.perf_counter()
            subprocess.run([program, *arguments], cwd=REPOSITORY, check=True, capture_output=True)
            taken[name].append(time.perf_counter() - began)
        tell((done + 1) / (budget.starts + 1))
    return {name: median(each[1:]) for name, each in taken.items()}, {"unit": "s", "seconds": taken}
