"""Tiny campaigns for tests: written to a folder, and run by the real command in a process of its own."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import pytest

from harness.campaign.storage.run_log import LOG
from harness.cli.main import CONTINUES
from harness.config.training import Training
from harness.errors import NOT_ACCEPTED
from tests.support import shipped
from tests.support.forked_command import WORKER, Forked, begin_forked, can_fork, run_forked
from tests.support.processes import children_of, command_of, in_session, name_of
from tests.support.repository import REPOSITORY
from tests.support.shared import built_once

PAPER_MERGE = REPOSITORY / "networks" / "paper_merge"  # a short road: its games take a moment
CAREFUL, SPEEDY, TEXTING = (REPOSITORY / "personas" / f"{name}.toml" for name in ("careful", "speedy", "texting"))
PAPER_SPEEDY, PAPER_DISTRACTED = (REPOSITORY / "personas" / f"{name}.toml" for name in shipped.PERSONAS)
HARNESS = Path(sys.executable).with_name("harness")
TABLES = ("episodes.csv", "summary.csv", "comparisons.csv")
PATIENCE_S = 600.0  # a bound on waiting: on a busy machine a second of work takes many; only a hang takes this long

TRAINING: dict[str, Any] = {
    "steps": 2048,
    "segment_steps": 1024,
    "games": 8,
    "buffer": 512,
    "minibatch": 128,
    "epochs": 2,
    "network": [8],
}
Process: TypeAlias = "subprocess.Popen[str] | Forked"
UNGATED: dict[str, Any] = {"ego_goal_share": 0.0, "non_ego_goal_share": 0.0, "non_ego_like_people": False}
"""Bounds that every player meets: tiny trainings learn nothing, and most tests are about what comes after them."""
PERSONA = """\
name = "{name}"
description = "Somebody who wants to get there."
[[sources]]
statistic = "Nobody has counted them."
citation = "nobody, nowhere"
[operational.terms]
goal = {goal}
progress = 1.0
[safety.terms]
collision = 1.0
"""


def settings(**changes: Any) -> Training:
    """The tiny training's settings."""
    return Training.model_validate({**TRAINING, **changes})


def write_persona(folder: Path, name: str, goal: float = 2.0) -> Path:
    """A persona of a few lines of TOML."""
    file = folder / f"{name}.toml"
    file.write_text(PERSONA.format(name=name, goal=goal), encoding="utf-8")
    return file


def write_campaign(folder: Path, **changes: Any) -> Path:
    """A campaign that ends within seconds; `changes` replaces its tables and keys, None leaves one out."""
    document: dict[str, Any] = {
        "name": "tiny",
        "scene": str(PAPER_MERGE),
        "personas": [str(SPEEDY)],
        "ego": {"persona": str(CAREFUL)},
        "training": TRAINING,
        "assessment": {"episodes": 4},
        "competence": UNGATED,
    }
    document |= changes
    document["assessment"] = {"reference_drivers": False, **document["assessment"]}
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / f"{document['name']}.toml"
    file.write_text(toml({key: value for key, value in document.items() if value is not None}), encoding="utf-8")
    return file


def toml(document: dict[str, Any]) -> str:
    """Plain values first, then a section for each table."""
    plain = [f"{key} = {_inline(value)}" for key, value in document.items() if not isinstance(value, dict)]
    sections = [f"[{key}]\n{toml(value)}" for key, value in document.items() if isinstance(value, dict)]
    return "\n".join([*plain, *sections]) + "\n"


def _inline(value: Any) -> str:
    """JSON's plain values are TOML's."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_inline(each)}" for key, each in value.items()) + " }"
    return f"[{', '.join(map(_inline, value))}]" if isinstance(value, list | tuple) else json.dumps(value)


def harness(*arguments: object, timeout_s: float = PATIENCE_S, **options: Any) -> subprocess.CompletedProcess[str]:
    """Run the command to its end."""
    command = [str(HARNESS), *map(str, arguments)]
    if can_fork(options):
        return run_forked(command, timeout_s=timeout_s, **options)
    return subprocess.run(command, capture_output=True, text=True, timeout=timeout_s, check=False, **options)


def without(folder: Path, *packages: str) -> dict[str, str]:
    """An environment for the command and its workers in which packages are not installed."""
    blocked = f"import sys\nsys.modules.update(dict.fromkeys({packages!r}))\n"
    (folder / "sitecustomize.py").write_text(blocked, encoding="utf-8")
    return {**os.environ, "PYTHONPATH": os.pathsep.join([str(folder), *sys.path])}


def begin(*arguments: object) -> Process:
    """Start the command as the leader of a session, as a terminal does, whatever is ignored where the tests run."""
    return begin_forked([str(HARNESS), *map(str, arguments)]) if can_fork({}) else begin_program(*arguments)


def begin_program(*arguments: object) -> subprocess.Popen[str]:
    """As `begin`, by the program itself, for tests of how it starts."""
    command = [str(HARNESS), *map(str, arguments)]
    return subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
        preexec_fn=_heed_all,
    )


def _heed_all() -> None:
    for each in (signal.SIGINT, signal.SIGHUP, signal.SIGTERM):
        signal.signal(each, signal.SIG_DFL)


def end(process: Process) -> str:
    """Wait for the command; what it printed. Whatever is left of it is killed, so that a failed test leaves nothing."""
    try:
        return process.communicate(timeout=PATIENCE_S)[0]
    finally:
        if left := in_session(process.pid):
            for each in left:
                os.kill(each, signal.SIGKILL)
            process.wait()


def workers_of(parent: int) -> list[int]:
    return [pid for pid in children_of(parent) if WORKER in command_of(pid).decode() or name_of(pid) == WORKER]


def wait_for(condition: Callable[[], object], what: str) -> None:
    """Wait until the condition holds; fails, naming it, if it does not in time."""
    until = time.monotonic() + PATIENCE_S
    while not condition():
        if time.monotonic() > until:
            pytest.fail(f"waited {PATIENCE_S:g} s in vain for: {what}")
        time.sleep(0.02)


def wait_until_nothing_is_left(process: Process) -> None:
    """Wait until no process of a command runs."""
    wait_for(lambda: not in_session(process.pid), "no process of it is left")


def assert_interrupted(process: Process, code: int) -> None:
    """The command ends with this exit code and one message, and leaves no process."""
    printed = process.communicate(timeout=PATIENCE_S)[0]
    assert process.returncode == code, printed
    assert printed.splitlines()[-1] == CONTINUES
    assert "Traceback" not in printed, printed
    wait_until_nothing_is_left(process)


def tables(run: Path) -> dict[str, bytes]:
    """The bytes of a run's tables."""
    return {name: (run / name).read_bytes() for name in TABLES}


def files_in(run: Path) -> dict[str, bytes]:
    """The bytes of every file of a run but its log, to which each command adds."""
    files = (each for each in run.rglob("*") if each.is_file() and each.name != LOG)
    return {each.relative_to(run).as_posix(): each.read_bytes() for each in files}


def numbers(run: Path) -> dict[str, bytes]:
    """The bytes of all that a run's numbers are in: its tables, policies and traces."""
    return {
        name: content
        for name, content in files_in(run).items()
        if name.startswith(("policies/", "traces/")) or ("/" not in name and name.endswith(".csv"))
    }


def carried_out(campaign: Path, run: Path, *options: object, **settings: Any) -> str:
    """Carry a campaign out by the real command, which must succeed and complain of nothing; what it printed. It has one
    worker unless the options say otherwise: each loads PyTorch, and tests run in as many processes as there are cores.
    """
    jobs = () if "--jobs" in options else ("--jobs", 1)
    done = harness("campaign", campaign, "--out", run, *jobs, *options, **settings)
    assert done.returncode in (0, NOT_ACCEPTED), done.stdout + done.stderr
    assert done.stderr == ""
    return done.stdout


def finished(*options: object, **changes: Any) -> Path:
    """The run folder of a finished campaign, beside its document and `printed`, what the command printed. Built once
    for the whole test session, by the campaign's name: tests read it, and none may change it."""
    name = changes["name"]

    def build(folder: Path) -> None:
        campaign = write_campaign(folder, **changes)
        printed = carried_out(campaign, campaign.with_suffix(""), *options)
        (folder / "printed").write_text(printed, encoding="utf-8")

    return built_once(name, build) / name


def learned_run() -> Path:
    """The run folder of a finished campaign with a learned ego."""
    return finished(name="learned")


def sumo_run() -> Path:
    """The run folder of a finished campaign whose ego SUMO drives."""
    return finished(**BY_SUMO)


def untrained_run() -> Path:
    """The run folder of a finished campaign of a person that was trained before and an ego that SUMO drives."""
    return finished(**UNTRAINED)


BY_SUMO: dict[str, Any] = {
    "name": "left_to_sumo",
    "ego": {"driver": "sumo", "persona": str(CAREFUL)},
    "assessment": {"episodes": 2},
}
SHIPPED: dict[str, Any] = {
    "personas": [str(PAPER_SPEEDY)],
    "seeds": [shipped.SEED],
    "policies": str(shipped.POLICIES),
    "training": None,
}
"""The shipped policies: nothing is trained."""
UNTRAINED: dict[str, Any] = {**BY_SUMO, **SHIPPED, "name": "untrained"}
"""Nothing is trained: workers do not load PyTorch, and the command takes half of the time."""
