"""A figure that can't be measured is null and makes `make bench` fail. `make bench ARGS=--fast` tries every figure in
minutes; no test does, and none tests the figures, which differ between machines."""

from __future__ import annotations

import json
from pathlib import Path
from subprocess import CalledProcessError
from unittest.mock import Mock

import pytest
from typer.testing import CliRunner

from benchmarks.__main__ import app
from benchmarks.figures import KEYS, Measurement
from benchmarks.sides import SideFailed
from tests.support.repository import REPOSITORY


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
