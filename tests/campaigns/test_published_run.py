"""A run folder with only the report and its tables, as reports/paper_merge is published."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from tests.support.tiny import carried_out, files_in, harness, numbers, untrained_run

PUBLISHED = ("report.html", "manifest.json")
PUBLISHED += tuple(f"{name}.csv" for name in ("causes", "comparisons", "episodes", "manoeuvres", "summary", "training"))


@pytest.fixture
def published(tmp_path: Path) -> Path:
    folder = tmp_path / "run"
    folder.mkdir()
    for name in PUBLISHED:
        shutil.copy(untrained_run() / name, folder / name)
    return folder


@pytest.mark.slow
def test_published__the_campaign_runs_on_it_as_on_an_empty_folder(published: Path) -> None:
    printed = carried_out(untrained_run().with_suffix(".toml"), published)
    assert printed.count("done     ") == len(list((untrained_run() / "traces").iterdir()))
    assert numbers(published) == numbers(untrained_run())


@pytest.mark.slow
def test_published__lists_its_games_but_report_and_replay_name_what_is_missing(published: Path) -> None:
    before = files_in(published)
    listed = harness("replay", published, "--list")
    assert listed.returncode == 0
    assert listed.stdout.count("naive_alone ") == 2
    replay = ("replay", published, "naive_alone", 0)
    no_traces = "naive_alone 0: was recorded, but this folder does not contain the traces"
    for command, words in (
        (("report", published), "holds a report and its tables, but not the files that they are made from ("),
        (replay, no_traces),
        ((*replay, "--film", "film.gif"), no_traces),
    ):
        refused = harness(*command, cwd=published.parent)
        assert refused.returncode == 2
        (line,) = refused.stderr.strip().splitlines()
        assert words in line
        assert "report.html" in line
    assert files_in(published) == before
    assert list(published.parent.iterdir()) == [published]


def test_gitignore__run_folders_are_ignored(repository: Path) -> None:
    if shutil.which("git") is None:
        pytest.skip("git is not installed")
    run = [f"reports/demo/{name}" for name in ("report.html", "episodes.csv", "traces/naive_alone-seed1.parquet")]
    command = ["git", "check-ignore", "--no-index", *run, "reports/README.md", "policies/paper_merge/x-seed1/README.md"]
    ignored = subprocess.run(command, cwd=repository, capture_output=True, text=True, check=False)
    if ignored.returncode not in (0, 1):
        pytest.skip("not in a git repository")
    assert ignored.stdout.splitlines() == run
