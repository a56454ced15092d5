"""A run folder with only the report and its tables, as reports/merge is published."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from tests.support.tiny import BY_SUMO, files_in, harness, sumo_run, tables, write_campaign

PUBLISHED = ("report.html", "manifest.json")
PUBLISHED += tuple(f"{name}.csv" for name in ("causes", "comparisons", "episodes", "manoeuvres", "summary", "training"))


@pytest.fixture
def published(tmp_path: Path) -> Path:
    folder = tmp_path / "run"
    folder.mkdir()
    for name in PUBLISHED:
        shutil.copy(sumo_run() / name, folder / name)
    return folder


@pytest.mark.slow
def test_published__the_campaign_runs_on_it_as_on_an_empty_folder(published: Path, tmp_path: Path) -> None:
    command = harness("campaign", write_campaign(tmp_path, **BY_SUMO), "--out", published, "--jobs", 1)
    assert command.returncode == 0, command.stdout + command.stderr
    assert "done     speedy-seed1" in command.stdout
    assert tables(published) == tables(sumo_run())
    assert (published / "policies" / "speedy-seed1" / "policy.safetensors").is_file()


@pytest.mark.slow
def test_published__report_names_what_is_missing_and_changes_nothing(published: Path) -> None:
    before = files_in(published)
    command = harness("report", published)
    assert command.returncode == 2
    (line,) = command.stderr.strip().splitlines()
    assert line.startswith(f"{published}: holds a report and its tables, but not the files that they are made from (")
    assert "report.html" in line
    assert files_in(published) == before


@pytest.mark.slow
def test_published__replay_lists_the_games(published: Path) -> None:
    command = harness("replay", published, "--list")
    assert command.returncode == 0
    assert command.stdout.count("naive_alone ") == 2


@pytest.mark.slow
@pytest.mark.parametrize("more", [[], ["--film", "film.gif"]])
def test_published__replay_of_a_game_names_the_report_that_shows_it(more: list[str], published: Path) -> None:
    command = harness("replay", published, "naive_alone", 0, *more, cwd=published.parent)
    assert command.returncode == 2
    (line,) = command.stderr.strip().splitlines()
    assert "naive_alone 0: was recorded, but this folder does not contain the traces" in line
    assert str(published / "report.html") in line
    assert not (published.parent / "film.gif").exists()


def test_gitignore__run_folders_are_ignored(repository: Path) -> None:
    if shutil.which("git") is None:
        pytest.skip("git is not installed")
    run = [f"reports/merge-demo/{name}" for name in ("report.html", "episodes.csv", "traces/naive_alone-seed1.parquet")]
    command = ["git", "check-ignore", "--no-index", *run, "reports/README.md", "policies/merge/x-seed1/README.md"]
    ignored = subprocess.run(command, cwd=repository, capture_output=True, text=True, check=False)
    if ignored.returncode not in (0, 1):
        pytest.skip("not in a git repository")
    assert ignored.stdout.splitlines() == run
