"""Campaigns from Python: the same run folder as by the command, and its tables as DataFrames."""

from __future__ import annotations

from pathlib import Path

import pytest

import harness
from harness.evaluation.trace_columns import TRACE_COLUMNS
from tests.support import shipped
from tests.support.repository import REPOSITORY
from tests.support.tiny import BY_SUMO, sumo_run, tables, write_campaign
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
    for name in ("episodes", "summary"):
        (tmp_path / f"{name}.csv").touch()
    refusal = "is none of this run .tables: episodes, summary"
    for wrong in ("epsiodes", "../other/episodes"):
        with pytest.raises(harness.UsageError, match=f"table '{wrong}': {refusal}"):
            harness.Results(tmp_path).table(wrong)


def test_trace__is_the_recording_of_one_game() -> None:
    results = harness.load(sumo_run())
    trace = results.trace("naive_vs_speedy", 1, 1)
    assert trace.columns.tolist() == [column.name for column in TRACE_COLUMNS]
    assert set(trace["episode"]) == {1}
    ends = trace[trace["player"].isin(["ego", "non_ego"])].groupby("player").last()["outcome"]
    (game,) = results.episodes.query("arm == 'naive_vs_speedy' and episode == 1").itertuples()
    assert ends.to_dict() == {"ego": game.ego_outcome, "non_ego": game.non_ego_outcome}
    assert trace["time_s"].max() == game.duration_s
    for wrong, remedy in ((("naive_vs_sppedy", 1, 1), "naive_vs_speedy"), (("naive_vs_speedy", 1, 2), "0 to 1")):
        with pytest.raises(harness.UsageError, match=remedy):
            results.trace(*wrong)


def test_trace__a_published_run_without_traces_is_refused() -> None:
    results = harness.load(REPOSITORY / "reports" / "merge")
    seed = int(results.episodes["seed"].iloc[0])
    with pytest.raises(harness.UsageError, match="this folder does not contain the traces"):
        results.trace("naive_vs_speedy", seed, 23)


def test_policies__are_shown_by_their_names_and_shapes(tmp_path: Path) -> None:
    (tmp_path / "policies").symlink_to(shipped.POLICIES)
    policies = harness.Results(tmp_path).policies
    assert [*policies] == sorted(shipped.ALL)
    shown = repr(policies[shipped.NAIVE])
    assert shown.startswith(f"Policy({shipped.NAIVE}: actor.0.bias [64], actor.0.weight [64, 98],")
    assert len(shown) < 500
