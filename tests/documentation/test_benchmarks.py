"""`make bench ARGS=--fast` measures every figure. The figures themselves differ between machines and are not tested."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.figures import KEYS, MEASUREMENTS
from tests.support.repository import REPOSITORY

NEEDS_EXTRA = {"vs_highway_env"}
"""Figures that need the extra `bench`, which requirements.lock leaves out."""


@pytest.mark.slow
@pytest.mark.parametrize("measurement", MEASUREMENTS, ids=lambda each: each.name)
def test_fast__measures_every_figure(measurement, tmp_path: Path) -> None:
    if NEEDS_EXTRA & set(measurement.keys) and importlib.util.find_spec("highway_env") is None:
        pytest.skip("the extra `bench` is not installed")
    results = tmp_path / "results.json"
    command = [sys.executable, "-m", "benchmarks", "--fast", "--out", str(results)]
    command += [part for key in measurement.keys for part in ("--only", key)]
    done = subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    figures = json.loads(results.read_text(encoding="utf-8"))
    assert [key for key in measurement.keys if figures[key] is None] == []


def test_published__every_figure_is_measured() -> None:
    published = json.loads((REPOSITORY / "benchmarks" / "results.json").read_text(encoding="utf-8"))
    assert [key for key in KEYS if published.get(key) is None] == []


@pytest.mark.slow
def test_step__times_every_part() -> None:
    command = [sys.executable, "-m", "benchmarks", "step", "--seconds", "1"]
    done = subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "contact and the rest" in done.stdout
