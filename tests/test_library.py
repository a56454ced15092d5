"""Campaigns from Python: the same run folder as by the command, and its tables as DataFrames."""

from __future__ import annotations

from pathlib import Path

import pytest

import harness
from tests.support.repository import REPOSITORY
from tests.support.tiny import BY_SUMO, tables, write_campaign
from tests.support.tiny import harness as command


def test_run__gives_the_tables_of_the_command(tmp_path: Path) -> None:
    file = write_campaign(tmp_path, **BY_SUMO)
    results = harness.run(file, out=tmp_path / "by_python", jobs=1)
    assert results.complete
    assert results.accepted is None
    assert command("campaign", file, "--out", tmp_path / "by_command").returncode == 0
    assert tables(tmp_path / "by_python") == tables(tmp_path / "by_command")
    assert set(results.episodes["arm"]) == set(results.summary["arm"])
    again = harness.load(tmp_path / "by_python")
    assert again.comparisons.equals(results.comparisons)
    assert [verdict["persona"] for verdict in again.verdicts] == [verdict["persona"] for verdict in results.verdicts]


def test_run__prints_nothing(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    harness.run(write_campaign(tmp_path, **BY_SUMO), out=tmp_path / "run", jobs=1)
    assert capfd.readouterr() == ("", "")


def test_table__a_name_that_the_run_has_not_is_refused(tmp_path: Path) -> None:
    with pytest.raises(harness.UsageError, match=r"none\.csv"):
        harness.Results(tmp_path).table("none")


def test_policies__are_shown_by_their_names_and_shapes(tmp_path: Path) -> None:
    (tmp_path / "policies").symlink_to(REPOSITORY / "policies" / "merge")
    policies = harness.Results(tmp_path).policies
    assert [*policies][:2] == ["distracted-seed1", "naive-seed1"]
    shown = repr(policies["naive-seed1"])
    assert shown.startswith("Policy(naive-seed1: actor.0.bias [64], actor.0.weight [64, 98],")
    assert len(shown) < 500
