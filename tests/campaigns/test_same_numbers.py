"""The same campaign is the same numbers: however many workers, in whatever order, whoever looks on, from wherever."""

from __future__ import annotations

import os
import pty
import shutil
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pandas as pd
import platformdirs
import pytest

from harness.evaluation.tables import read_csv
from tests.support import shipped
from tests.support.shipped import stage
from tests.support.tiny import (
    BY_SUMO,
    CAREFUL,
    HARNESS,
    PATIENCE_S,
    SHIPPED,
    SPEEDY,
    TABLES,
    carried_out,
    learned_run,
    numbers,
    sumo_run,
    write_campaign,
    write_persona,
)

pytestmark = pytest.mark.slow


def on_a_terminal(*arguments: object, environment: dict[str, str], cwd: Path) -> tuple[int, str]:
    """Run the command where it shows its progress as bars; its exit code and what it showed."""
    ours, theirs = pty.openpty()
    command = [HARNESS, *map(str, arguments)]
    process = subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs, env=environment, cwd=cwd)
    os.close(theirs)
    shown: list[bytes] = []

    def read() -> None:
        try:
            while piece := os.read(ours, 65536):
                shown.append(piece)
        except OSError:  # the terminal is closed
            pass

    reader = threading.Thread(target=read)
    reader.start()
    code = process.wait(timeout=PATIENCE_S)
    reader.join()
    os.close(ours)
    return code, b"".join(shown).decode(errors="replace")


def test_numbers__of_four_workers_with_a_display_elsewhere_are_those_of_one_without(tmp_path: Path) -> None:
    """And nothing is written anywhere else."""
    folders = {name: tmp_path / name for name in ("cwd", "home", "tmp", "out")}
    for folder in folders.values():
        folder.mkdir()
    compiled = folders["home"] / "cache" / "harness" / "compiled"  # machine code as on any machine after its first run
    compiled.parent.mkdir(parents=True)
    compiled.symlink_to(Path(platformdirs.user_cache_dir("harness")) / "compiled")
    environment = {
        **os.environ,
        "TERM": "xterm-256color",
        "HOME": str(folders["home"]),
        "XDG_CACHE_HOME": str(folders["home"] / "cache"),
        "TMPDIR": str(folders["tmp"]),
    }
    campaign, again = write_campaign(folders["out"] / "campaign", name="learned"), folders["out"] / "again"
    command = ("campaign", campaign, "--out", again, "--jobs", 4)
    code, shown = on_a_terminal(*command, environment=environment, cwd=folders["cwd"])
    assert code == 0, shown
    assert "\x1b[" in shown  # it did draw bars
    assert "\x1b[" not in (learned_run().parent / "printed").read_text(encoding="utf-8")
    assert numbers(again) == numbers(learned_run())
    assert list(folders["cwd"].iterdir()) == []
    left = {each.name for each in folders["tmp"].iterdir() if not each.name.startswith("torchinductor")}  # torch's
    assert left == set()
    assert {each.name for each in folders["home"].iterdir()} <= {"cache", ".config"}  # .config: matplotlib
    assert {each.name for each in folders["out"].iterdir()} == {"campaign", "again"}


def rows_of(run: Path, persona: str) -> pd.DataFrame:
    """The games of a persona, and those without one."""
    episodes = read_csv(run / "episodes.csv")
    return episodes[episodes["persona"].isin(["", persona])].reset_index(drop=True)


def test_numbers__neither_another_persona_nor_the_order_of_personas_changes_a_row(tmp_path: Path) -> None:
    anna = write_persona(tmp_path, "anna")
    runs = [tmp_path / "first" / "run", tmp_path / "second" / "run"]
    for run, personas, jobs in zip(runs, ([SPEEDY, anna], [anna, SPEEDY]), (1, 2), strict=True):
        changes: dict[str, Any] = {**BY_SUMO, "personas": [str(each) for each in personas]}
        carried_out(write_campaign(run.parent, **changes), run, "--jobs", jobs)
    for name in (*TABLES, "training.csv"):
        tables = [read_csv(run / name) for run in runs]
        columns = ("persona", "arm", "stage", "seed", "episode", "steps", "question", "metric")
        keys = [key for key in columns if key in tables[0]]
        first, second = (table.sort_values(keys, kind="stable").reset_index(drop=True) for table in tables)
        pd.testing.assert_frame_equal(first, second, check_exact=True)
    pd.testing.assert_frame_equal(rows_of(runs[0], "speedy"), rows_of(sumo_run(), "speedy"))
    assert set(rows_of(runs[0], "anna")["arm"]) == {"naive_alone", "naive_vs_sumo", "anna_alone", "naive_vs_anna"}


TOGETHER = """
import json, os, sys, time
games = 0
for line in sys.stdin:
    message = json.loads(line)
    if message["type"] == "reset":
        games += 1
        if games == 2:
            open(f"playing/{os.getpid()}", "w").close()
        while games == 2 and len(os.listdir("playing")) < int(open("players").read()):
            time.sleep(0.01)
    rows = len(message.get("games", ()))
    print(json.dumps({"protocol": 2, "actions": [[0.0, 0.0]] * rows}), flush=True)
"""
"""A driver that waits in its second game until as many of its processes as `players` says play at the same time."""


def test_numbers__of_an_arm_that_two_workers_play_are_those_of_one(tmp_path: Path) -> None:
    """The arm is the only stage that is left; its ego is a program."""
    ego, runs = tmp_path / "ego", [tmp_path / "one", tmp_path / "two"]
    (ego / "playing").mkdir(parents=True)
    (ego / "drive.py").write_text(TOGETHER)
    (ego / "ego.toml").write_text(
        f'kind = "process"\ncommand = [{sys.executable!r}, "drive.py"]\nstart_deadline_s = {PATIENCE_S}\n'
    )
    changes: dict[str, Any] = {**SHIPPED, "assessment": {"episodes": 10}}
    campaign = write_campaign(tmp_path, ego={"driver": "ego/ego.toml", "persona": str(CAREFUL)}, **changes)
    (ego / "players").write_text("1")
    carried_out(campaign, runs[0], "--allow-code")
    shutil.copytree(runs[0], runs[1])
    (runs[1] / ".stages" / stage(f"naive_vs_{shipped.SPEEDY}") / "done.json").unlink()
    for each in (ego / "playing").iterdir():
        each.unlink()
    (ego / "players").write_text("2")
    carried_out(campaign, runs[1], "--allow-code", "--jobs", 2)
    assert len(list((ego / "playing").iterdir())) == 2
    assert numbers(runs[1]) == numbers(runs[0])
    assert set(read_csv(runs[1] / "episodes.csv")["error"]) == {""}
