"""Wall time of the commands that a user waits for.

`first_line_seconds` is measured on a pseudo-terminal, which is what a user sees; resuming and reporting take a run of
tiny trainings with 100 arms.
"""

from __future__ import annotations

import os
import pty
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from statistics import median

from benchmarks.budget import Budget
from benchmarks.figures import Measured
from benchmarks.games import MERGE, REPOSITORY, persona_file
from benchmarks.sides import OnProgress

_COMMANDS = {"help_seconds": ["--help"], "check_seconds": ["check", "campaigns/merge.toml"]}

_PROGRAM = str(Path(sys.executable).with_name("harness"))
_CONTROL = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")
_PERSONAS = ("speedy", "texting", "cautious", "drowsy", "impaired", "late_merger", "tailgater", "careful")
_EPISODES = 20
_MANY_ARMS = """name = "many-arms"
scene = "{scene}"
personas = {personas}
seeds = {seeds}
[ego]
persona = "{careful}"
[training]
steps = 2048
segment_steps = 1024
games = 8
buffer = 512
minibatch = 128
network = [8]
[assessment]
episodes = {episodes}
"""


def _seconds(arguments: Sequence[str]) -> float:
    start_s = time.perf_counter()
    subprocess.run([_PROGRAM, *arguments], cwd=REPOSITORY, check=True, capture_output=True)
    return time.perf_counter() - start_s


def command_seconds(budget: Budget, on_progress: OnProgress) -> Measured:
    """Wall time of commands in seconds: the median of several starts, without the first."""
    seconds: dict[str, list[float]] = {name: [] for name in _COMMANDS}
    for done in range(budget.starts + 1):
        for name, arguments in _COMMANDS.items():
            seconds[name].append(_seconds(arguments))
        on_progress((done + 1) / (budget.starts + 1))
    return {name: median(of_command[1:]) for name, of_command in seconds.items()}, {
        "unit": "s",
        "seconds": seconds,
    }


def first_line_seconds(budget: Budget, on_progress: OnProgress) -> Measured:
    """Seconds from the start of a campaign to the first text on the terminal: the median of several starts, without the
    first."""
    seconds = []
    for done in range(budget.starts + 1):
        with tempfile.TemporaryDirectory(prefix="benchmark-") as scratch:
            seconds.append(_first_line_s(["campaign", "campaigns/merge.toml", "--out", f"{scratch}/run"]))
        on_progress((done + 1) / (budget.starts + 1))
    return {"first_line_seconds": median(seconds[1:])}, {"unit": "s", "seconds": seconds}


def _first_line_s(arguments: Sequence[str]) -> float:
    """Start the command on a terminal of its own, and end it as Ctrl-C does when it has shown something."""
    terminal, theirs = pty.openpty()
    start_s = time.perf_counter()
    process = subprocess.Popen(
        [_PROGRAM, *arguments], cwd=REPOSITORY, stdin=theirs, stdout=theirs, stderr=theirs, start_new_session=True
    )
    os.close(theirs)
    try:
        while not any(character.isalpha() for character in _CONTROL.sub("", os.read(terminal, 65_536).decode())):
            pass
        return time.perf_counter() - start_s
    finally:
        process.kill()
        process.wait()
        os.close(terminal)


def many_arms_seconds(budget: Budget, on_progress: OnProgress) -> Measured:
    """Seconds to resume a finished campaign of 100 arms, and to write its report; one time each."""
    with tempfile.TemporaryDirectory(prefix="benchmark-") as scratch:
        file, run = _write_document(Path(scratch), budget), f"{scratch}/run"
        seconds = {}
        for place, (name, arguments) in enumerate(
            {
                "first_s": ["campaign", str(file), "--out", run],
                "resume_seconds": ["campaign", str(file), "--out", run],
                "report_100_arms_seconds": ["report", run],
            }.items()
        ):
            seconds[name] = _seconds([*arguments])
            on_progress((place + 1) / 3)
        arms = len((Path(run) / "summary.csv").read_text(encoding="utf-8").splitlines()) - 1
    first_s = seconds.pop("first_s")
    return seconds, {"unit": "s", "arms": arms, "episodes": _EPISODES, "first_s": first_s}


def _write_document(folder: Path, budget: Budget) -> Path:
    """A campaign with many arms of `_EPISODES` games, and trainings of a few seconds."""
    personas = [persona_file(name).as_posix() for name in ("careful", *_PERSONAS[: budget.personas])]
    file = folder / "many-arms.toml"
    file.write_text(
        _MANY_ARMS.format(
            scene=MERGE.as_posix(), personas=personas[1:], careful=personas[0], seeds=list(range(budget.seeds)),
            episodes=_EPISODES,
        ),
        encoding="utf-8",
    )  # fmt: skip
    return file
