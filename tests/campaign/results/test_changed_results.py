"""Commands that read a run refuse what was changed since the run wrote it, and say what is not there."""

from __future__ import annotations

import io
import json
import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest
from rich.console import Console

from harness.campaign.execution.pinned_games import PinnedGames
from harness.campaign.execution.run_players import RunPlayers
from harness.campaign.results.compare_runs import compare_runs
from harness.campaign.results.replay_game import GameList, game_table, played_game
from harness.campaign.results.results import write_results
from harness.campaign.results.served_report import ServedReport
from harness.campaign.storage.run_folder import RunFolder
from harness.errors import UsageError
from harness.evaluation.tables import read_csv, write_csv
from harness.library import load
from tests.support.shipped import SPEEDY, stage
from tests.support.tiny import harness, untrained_run

pytestmark = pytest.mark.slow


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """A run folder that may be changed."""
    return shutil.copytree(untrained_run(), tmp_path / "run")


def pinned(run: Path) -> PinnedGames:
    return PinnedGames(RunFolder(run), RunPlayers(RunFolder(run)), run / "pinned")


def report(run: Path) -> object:
    return write_results(RunFolder(run), Console(file=io.StringIO()))


READERS: dict[str, Callable[[Path], object]] = {
    "compare": lambda run: compare_runs([run, run], ["", ""]),
    "replay --list": lambda run: game_table(run, GameList()),
    "replay": lambda run: played_game(run, "naive_alone", 0, None),
    "serve": lambda run: ServedReport(RunFolder(run)),
    "minimise": pinned,
    "load": lambda run: load(run).episodes,
}


def refusal(reader: Callable[[Path], object], run: Path) -> str:
    with pytest.raises(UsageError) as error:
        reader(run)
    (problem,) = error.value.problems
    return str(problem)


def edited(file: Path, old: str, new: str) -> None:
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new), encoding="utf-8")


def unfinished(run: Path) -> None:
    """As a campaign leaves its folder that has begun, and finished no stage."""
    manifest = json.loads((run / "manifest.json").read_text(encoding="utf-8"))
    for entry in manifest["stages"].values():
        entry["status"] = "pending"
    RunFolder(run).write_manifest(manifest)
    RunFolder(run).results.unlink()


@pytest.mark.parametrize("reader", READERS.values(), ids=READERS)
def test_read__games_that_were_edited_are_refused_with_the_command_that_writes_them(
    reader: Callable[[Path], object], run: Path
) -> None:
    before = (run / "episodes.csv").read_bytes()
    games = read_csv(run / "episodes.csv")
    write_csv(games.assign(ego_failed=1.0), run / "episodes.csv")
    expected = f"{run / 'episodes.csv'}: is missing, or is not what the campaign wrote ("
    assert refusal(reader, run).startswith(expected)
    assert f"harness report {run}" in refusal(reader, run)
    report(run)
    assert (run / "episodes.csv").read_bytes() == before
    reader(run)


@pytest.mark.parametrize("reader", [*READERS.values(), report], ids=[*READERS, "report"])
def test_read__a_manifest_that_was_edited_is_refused(reader: Callable[[Path], object], run: Path) -> None:
    edited(run / "manifest.json", '"significance": 0.01', '"significance": 0.2')
    said = refusal(reader, run)
    assert said == f"{run / 'manifest.json'}: is missing, or is not what the campaign wrote (run the campaign again)"


def test_report__a_manifest_that_was_edited_before_the_first_results_is_refused(run: Path) -> None:
    unfinished(run)
    edited(run / "manifest.json", '"significance": 0.01', '"significance": 0.2')
    said = refusal(report, run)
    assert said == f"{run / 'manifest.json'}: is missing, or is not what the campaign wrote (run the campaign again)"


@pytest.mark.parametrize("reader", READERS.values(), ids=READERS)
def test_read__a_campaign_that_has_not_ended_has_no_results_and_then_no_games(
    reader: Callable[[Path], object], run: Path
) -> None:
    unfinished(run)
    assert refusal(reader, run).startswith(f"{run}: has no results: its campaign has not ended (")
    report(run)
    if reader is READERS["load"]:
        assert reader(run).empty  # type: ignore[attr-defined]
    else:
        assert refusal(reader, run).startswith(f"{run}: has no games: none of its arms is finished (")


def test_replay__a_game_whose_traces_or_scene_were_changed_is_refused(run: Path) -> None:
    read = partial(played_game, arm="naive_alone", episode=0, seed=None)
    edited(run / "scene" / "paper_merge.rou.xml", "</routes>", "<!-- mine --></routes>")
    assert "merge.rou.xml: is missing, or is not what" in refusal(read, run)
    shutil.copy(untrained_run() / "scene" / "paper_merge.rou.xml", run / "scene")
    traces, alone = run / "traces", stage("naive_alone")
    shutil.copy(traces / f"{stage(SPEEDY + '_alone')}.parquet", traces / f"{alone}.parquet")
    assert f"{alone}.parquet: is missing, or is not what" in refusal(read, run)


def test_minimise__a_run_without_failures_has_nothing_to_pin(run: Path) -> None:
    assert pinned(run).failures("naive_alone") == []
    done = harness("minimise", run, "naive_alone", "--all")
    assert (done.returncode, done.stdout, done.stderr) == (0, "Nothing to pin: the ego fails in no game.\n", "")


def test_compare__published_folders_are_read_and_said_to_be_unchecked(run: Path) -> None:
    shutil.rmtree(run / ".stages")
    done = harness("compare", run, untrained_run(), "--out", run / "page.html")
    assert done.returncode == 0, done.stderr
    assert f"{run}: has no checksums, as published; whether its files were changed is not known" in done.stdout
    assert f"{untrained_run()}: has no" not in done.stdout
    assert "naive ego" in done.stdout
    alone = harness("compare", run)
    assert (alone.returncode, "name at least two" in alone.stderr) == (2, True)
