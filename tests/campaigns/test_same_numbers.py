"""The same campaign is the same numbers: however many workers, in whatever order, whoever looks on, from wherever."""

from __future__ import annotations

import os
import pty
import subprocess
import threading
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from harness.evaluation.tables import read_csv
from tests.support.tiny import BY_SUMO, HARNESS, PATIENCE_S, SPEEDY, TABLES, harness, write_campaign, write_persona

pytestmark = pytest.mark.slow


def campaign_in(folder: Path, *personas: Path) -> Path:
    changes: dict[str, Any] = {**BY_SUMO, "personas": [str(each) for each in personas]}
    return write_campaign(folder, **changes)


def numbers(run: Path) -> dict[str, bytes]:
    policies = {file.relative_to(run).as_posix(): file for file in sorted((run / "policies").rglob("policy.*"))}
    return {name: (run / name).read_bytes() for name in (*TABLES, "training.csv")} | {
        name: file.read_bytes() for name, file in policies.items()
    }


def on_a_terminal(*arguments: object) -> tuple[int, str]:
    """Run the command where it shows its progress as bars; its exit code and what it showed."""
    ours, theirs = pty.openpty()
    environment = {**os.environ, "TERM": "xterm-256color"}
    process = subprocess.Popen(
        [HARNESS, *map(str, arguments)], stdin=theirs, stdout=theirs, stderr=theirs, env=environment
    )
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


def test_numbers__one_worker_or_four_with_a_display_or_without_from_anywhere(tmp_path: Path) -> None:
    personas = (SPEEDY, write_persona(tmp_path, "anna"))
    campaign = campaign_in(tmp_path / "here", *personas)
    (tmp_path / "cwd").mkdir()
    one = harness("campaign", campaign, "--out", tmp_path / "one", "--jobs", 1)
    code, shown = on_a_terminal("campaign", campaign, "--out", tmp_path / "four", "--jobs", 4)
    assert (one.returncode, code) == (0, 0), one.stderr + shown
    assert "\x1b[" in shown  # it did draw bars
    assert "\x1b[" not in one.stdout
    assert numbers(tmp_path / "one") == numbers(tmp_path / "four")

    other_order = campaign_in(tmp_path / "there", *reversed(personas))
    done = harness("campaign", other_order, "--out", "../reversed", "--jobs", 2, cwd=tmp_path / "cwd")
    assert done.returncode == 0, done.stderr
    for name in (*TABLES, "training.csv"):
        tables = [read_csv(tmp_path / run / name) for run in ("one", "reversed")]
        columns = ("persona", "arm", "stage", "seed", "episode", "steps", "question", "metric")
        keys = [key for key in columns if key in tables[0]]
        first, second = (table.sort_values(keys, kind="stable").reset_index(drop=True) for table in tables)
        pd.testing.assert_frame_equal(first, second, check_exact=True)
