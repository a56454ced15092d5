"""Drivers that are Python programs, and whether a process runs."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

from harness.drivers.car import Car
from harness.drivers.process import ProcessDriver

OBEDIENT = """
import json, os, sys, time
for number, line in enumerate(sys.stdin):
    message = json.loads(line)
    games = message.get("games", [])
    decided = {{"actions": [[1.0, 0.01]] * len(games)}}
    answer = {{"hello": {{"protocol": 2}}, "reset": {{}}, "decide": decided}}[message["type"]]
    {change}
    print(json.dumps(answer), flush=True)
"""


def driver(
    folder: Path, car: Car, change: str = "pass", units: str = "si", deadline_s: float = 5.0, **options: Any
) -> ProcessDriver:
    """A driver by a Python program that answers well, but for the change."""
    (folder / "program.py").write_text(OBEDIENT.format(change=change))
    command = [sys.executable, "program.py"]
    return ProcessDriver(command, folder, car, units=units, deadline_s=deadline_s, start_deadline_s=20.0, **options)


def is_running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def started(tmp_path: Path, car: Car, change: str = "pass") -> tuple[ProcessDriver, int]:
    """A driver whose program runs, and the program's process id."""
    mine = driver(tmp_path, car, f'open("pid", "w").write(str(os.getpid())); {change}')
    mine.reset(np.array([3, 7]))
    return mine, int((tmp_path / "pid").read_text())


def children_of(parent: int) -> list[int]:
    """The processes that a process has started and that run."""
    found = []
    for folder in Path("/proc").iterdir():
        try:
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if folder.name.isdigit() and int(fields[1]) == parent and fields[0] != "Z":
            found.append(int(folder.name))
    return found
