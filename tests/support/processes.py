"""Drivers that are Python programs, and the processes that run."""

from __future__ import annotations

import sys
from collections.abc import Iterator
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


def started(tmp_path: Path, car: Car, change: str = "pass") -> tuple[ProcessDriver, int]:
    """A driver whose program runs, and the program's process id."""
    mine = driver(tmp_path, car, f'open("pid", "w").write(str(os.getpid())); {change}')
    mine.reset(np.array([3, 7]))
    return mine, int((tmp_path / "pid").read_text())


def is_running(pid: int) -> bool:
    return any(pid == running for running, _, _ in _running())


def children_of(parent: int) -> list[int]:
    """The processes that a process has started and that run."""
    return [pid for pid, started_by, _ in _running() if started_by == parent]


def in_session(leader: int) -> list[int]:
    """The processes of a session that run."""
    return [pid for pid, _, session in _running() if session == leader]


def command_of(pid: int) -> bytes:
    """The command line of a process; empty if it has ended."""
    return _read(f"/proc/{pid}/cmdline")


def name_of(pid: int) -> str:
    """The name that a process goes by; empty if it has ended."""
    return _read(f"/proc/{pid}/comm").decode().strip()


def _running() -> Iterator[tuple[int, int, int]]:
    """Each process that has not ended, its parent and its session."""
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit() and (stat := _read(f"{folder}/stat")):
            state, parent, _, session, *_ = stat.decode().rpartition(")")[2].split()
            if state != "Z":
                yield int(folder.name), int(parent), int(session)


def _read(path: str) -> bytes:
    try:
        return Path(path).read_bytes()
    except OSError:
        return b""
