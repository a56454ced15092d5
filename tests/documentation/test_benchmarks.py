"""`make bench ARGS=--fast` measures every figure. The figures themselves differ between machines and are not tested."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from pathlib import Path
from subprocess import CalledProcessError
from unittest.mock import Mock

import pytest
from typer.testing import CliRunner

from benchmarks.__main__ import app
from benchmarks.figures import KEYS, MEASUREMENTS, Measurement
from benchmarks.sides import SideFailed
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


@pytest.mark.parametrize("error", [SideFailed("a side ended"), OSError("no room"), CalledProcessError(1, "harness")])
def test_measure__a_figure_that_fails_is_null_and_the_exit_code_is_1(
    error: Exception, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Measurement, "measure", Mock(side_effect=error))
    ended = CliRunner().invoke(app, ["--fast", "--only", "help_seconds", "--out", str(tmp_path / "results.json")])
    assert ended.exit_code == 1
    assert f"commands failed: {error}" in ended.output
    results = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert (results["help_seconds"], results["details"]["commands"]) == (None, {"failed": str(error)})


def test_measure__without_highway_env_its_figure_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    ended = CliRunner().invoke(app, ["--fast", "--only", "vs_highway_env", "--out", str(tmp_path / "results.json")])
    assert ended.exit_code == 1
    assert "highway-env failed: highway-env is not installed" in ended.output


def test_published__every_figure_is_measured() -> None:
    published = json.loads((REPOSITORY / "benchmarks" / "results.json").read_text(encoding="utf-8"))
    assert [key for key in KEYS if published.get(key) is None] == []


@pytest.mark.slow
def test_step__times_every_part() -> None:
    command = [sys.executable, "-m", "benchmarks", "step", "--seconds", "1"]
    done = subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "contact and the rest" in done.stdout
