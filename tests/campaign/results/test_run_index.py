"""The index of runs: `harness runs`, and `harness serve` of a folder of run folders."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import urllib.error
from collections.abc import Iterator
from datetime import datetime, timedelta, timezone
from itertools import cycle
from pathlib import Path

import pytest

from harness.campaign.plan.stages import AssessmentStage
from harness.campaign.results.run_index import indexed_run, runs_in
from harness.campaign.results.served_runs import ServedRuns, served
from harness.campaign.storage.locks import only_one
from harness.campaign.storage.manifest import planned
from harness.campaign.storage.run_folder import RunFolder
from harness.campaign.storage.training_curves import CHECKPOINT
from harness.errors import UsageError
from harness.evaluation.strategies import NaiveEgo, is_named_of_a_trait, is_named_of_the_naive_ego
from harness.evaluation.tables import read_csv
from tests.support.pages import Page
from tests.support.repository import REPOSITORY
from tests.support.serving import read, serving
from tests.support.tiny import harness, learned_run, sumo_run
from tests.support.work import assert_work

pytestmark = pytest.mark.slow
PUBLISHED = sorted((REPOSITORY / "reports").glob("*/manifest.json"))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a run that has ended, one that was interrupted, one that is damaged, and something else."""
    shutil.copytree(sumo_run(), tmp_path / "first")
    half = shutil.copytree(sumo_run(), tmp_path / "half")
    (half / "summary.csv").unlink()
    manifest = json.loads((half / "manifest.json").read_bytes())
    stage = next(name for name, entry in manifest["stages"].items() if entry["kind"] == "assessment")
    manifest["stages"][stage]["status"] = "pending"
    RunFolder(half).write_manifest(manifest)
    (tmp_path / "damaged").mkdir()
    (tmp_path / "damaged" / "manifest.json").write_text("{")
    (tmp_path / "else").mkdir()
    return tmp_path


def test_index__says_how_far_each_run_is_and_where_its_ego_fails_most(folder: Path) -> None:
    runs = {run.name: run for run in runs_in(folder)}
    assert {name: run.state for name, run in runs.items()} == {
        "first": "ended",
        "half": "interrupted",
        "damaged": "unreadable",
    }
    first = runs["first"]
    assert (first.ego, first.scene, first.stages_done) == ("sumo", "paper_merge", first.stages)
    assert first.naive is not None
    assert first.naive.games == 2  # of one arm and seed
    assert first.last is None  # an ego that SUMO drives is not retrained
    assert runs["half"].stages_done == runs["half"].stages - 1
    assert "is damaged" in runs["damaged"].problem
    with pytest.raises(UsageError, match="is not a folder"):
        runs_in(folder / "nowhere")


def test_index__a_run_that_a_command_holds_is_running_with_its_stage_and_the_time_left(folder: Path) -> None:
    half = folder / "half"
    manifest = json.loads((half / "manifest.json").read_bytes())
    stages = manifest["stages"]
    pending = next(name for name, entry in stages.items() if entry["status"] == "pending")
    for entry in stages.values():
        if entry["status"] == "done":
            entry["seconds"] = 10.0
    RunFolder(half).write_manifest(manifest)
    other = next(name for name, entry in stages.items() if entry["kind"] == "assessment" and name != pending)
    # one stage after the other, each 10 s: the one that is left takes 10 s
    done = [name for name in stages if name != pending]
    lines = [
        f"2026-11-25T20:{10 * place // 60:02d}:{10 * place % 60:02d}Z INFO    {what} {name}"
        for start, name in enumerate(done)
        for place, what in ((start, "started "), (start + 1, "done    "))
    ]
    assert other in done
    end = len(done)
    lines.append(f"2026-11-25T20:{10 * end // 60:02d}:{10 * end % 60:02d}Z INFO    started  {pending}")
    (half / "harness.log").write_text("\n".join(lines) + "\n")
    with only_one(RunFolder(half).lock):
        run = next(each for each in runs_in(folder) if each.name == "half")
    assert (run.state, list(run.running)) == ("running", [pending])
    assert run.left_s == pytest.approx(10.0)


def test_runs__lists_them_and_finds_them_by_a_text(folder: Path) -> None:
    listed = json.loads(of_runs(folder, "--json"))
    assert {each["name"] for each in listed} == {"first", "half", "damaged"}
    found = json.loads(of_runs(folder, "--search", "FIRST", "--json"))
    assert [each["name"] for each in found] == ["first"]
    assert "there is no run that contains 'x'" in of_runs(folder, "--search", "x")


def test_runs__those_of_a_league_are_listed_with_its_name(tmp_path: Path) -> None:
    """And where a folder has nothing but leagues, it has runs."""
    shutil.copytree(sumo_run(), tmp_path / "league-sumo" / "paper_merge")
    shutil.copytree(tmp_path / "league-sumo", tmp_path / "league-mine")
    names = ["league-mine/paper_merge", "league-sumo/paper_merge"]
    assert [each["name"] for each in json.loads(of_runs(tmp_path, "--json"))] == names
    with serving(served(tmp_path).answer) as server:
        address = f"http://127.0.0.1:{server.server_port}"
        index = read(f"{address}/")
        for link in ("league-sumo%2Fpaper_merge/", "compare/league-sumo%2Fpaper_merge/league-mine%2Fpaper_merge"):
            assert f'href="/{link}"' in index
            assert "paper_merge" in read(f"{address}/{link}")
        assert "Comparison of 2 runs" in read(f"{address}/history/league-mine%2Fpaper_merge")


def of_runs(folder: Path, *options: str) -> str:
    done = harness("runs", folder, *options)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture
def address(folder: Path) -> Iterator[str]:
    shutil.copytree(folder / "first", folder / "second")
    with serving(ServedRuns(folder).answer) as server:
        yield f"http://127.0.0.1:{server.server_port}"


def test_serve__of_a_folder_has_an_index_every_report_with_its_games_and_comparisons(address: str) -> None:
    index = read(f"{address}/")
    assert 'href="/first/"' in index
    assert "interrupted after" in index
    assert 'href="/compare/second/first"' in index  # of the same date, by name
    report = read(f"{address}/first/")
    assert "connect-src 'self'" in report
    arm, _, seed, episode, *_ = json.loads(report.split('id="elsewhere">')[1].split("</script>")[0])[0]
    assert json.loads(read(f"{address}/first/games/{arm},{seed},{episode}.json"))["arm"] == arm
    assert "no difference" in read(f"{address}/compare/second/first")
    assert "Comparison of 3 runs" in read(f"{address}/compare/second/first/second")
    assert "Comparison of 2 runs" in read(f"{address}/history/first")
    assert 'href="/second/"' not in read(f"{address}/?search=first")


def test_serve__a_run_that_has_not_ended_has_a_page_of_its_progress(tmp_path: Path) -> None:
    """The naive ego is trained: it has a checkpoint after half of its steps, 20 s after it began."""
    run = RunFolder(shutil.copytree(learned_run(), tmp_path / "going_on"))
    manifest = json.loads(run.manifest_file.read_bytes())
    for name, entry in manifest["stages"].items():
        manifest["stages"][name] = {key: entry[key] for key in ("kind", "name", "seed")} | {
            "status": "pending",
            "message": "",
        }
    run.write_manifest(manifest)
    run.results.unlink()
    (run.path / "summary.csv").unlink()
    begun = datetime.now(timezone.utc) - timedelta(seconds=30)
    (run.path / "harness.log").write_text(f"{begun:%Y-%m-%dT%H:%M:%SZ} INFO    started  naive-seed1\n")
    for table in run.path.glob(".stages/*/training.csv"):
        table.unlink()
    made = begun.timestamp() + 20.0
    os.utime(run.work("naive-seed1") / CHECKPOINT, (made, made))
    with serving(ServedRuns(tmp_path).answer) as server:
        address = f"http://127.0.0.1:{server.server_port}"
        with only_one(run.lock):
            page = read(f"{address}/going_on/")
            assert 'href="/going_on/"' in read(f"{address}/")
        stopped = read(f"{address}/going_on/")
    cells = [cell["text"] for cell in Page(page).tables["running"][1]]
    assert cells[:2] == ["naive-seed1", "training"]
    assert 30.0 <= float(cells[2].removesuffix(" s")) < 60.0
    steps, budget = (int(part.replace(",", "")) for part in cells[3].split(" of "))
    assert 0 < steps <= budget
    assert cells[4].endswith(" s")
    assert "Learning curve of naive: mean payoff and failure rate" in page
    assert "brought up to date every" in page
    assert "Interrupted after 0 of" in stopped
    assert "it goes on where it stopped" in stopped


@pytest.mark.parametrize(
    "path",
    [
        "/x/",
        "/..%2f..%2fetc/",
        "/compare/first",
        "/compare/first/..",
        "/history/second",
        "/history/x",
        "/history/.%2ffirst",
        "/first/manifest.json",
    ],
)
def test_serve__of_a_folder_nothing_else_is_there(path: str, address: str) -> None:
    with pytest.raises(urllib.error.HTTPError) as refused:
        read(f"{address}{path}")
    with refused.value:
        assert refused.value.code == 404


@pytest.mark.parametrize("name", sorted(file.parent.name for file in PUBLISHED))
def test_index__finds_the_worst_arms_by_their_names_as_the_plan_has_them(name: str) -> None:
    """The arms of a naive ego and of later egos, without those of traits, by the plan of the run."""
    folder = REPOSITORY / "reports" / name
    stages = planned(RunFolder(folder).manifest())
    arms = {each.name: each.arm for each in stages if isinstance(each, AssessmentStage)}
    summary = read_csv(folder / "summary.csv")
    assert {*summary["arm"]} <= {*arms}
    for arm, rows in summary.groupby("arm"):
        planned_arm = arms[str(arm)]
        assert (planned_arm.ego is not None) == rows["failure_rate"].notna().any()
        assert is_named_of_a_trait(str(arm), rows["persona"].iloc[0]) == planned_arm.is_of_a_trait
        assert is_named_of_the_naive_ego(str(arm)) == isinstance(planned_arm.ego, NaiveEgo)
    run = indexed_run(folder)
    for cell, is_naive in ((run.naive, True), (run.last, False)):
        own = [each for each, arm in arms.items() if arm.ego is not None and not arm.is_of_a_trait]
        of_ego = [each for each in own if isinstance(arms[each].ego, NaiveEgo) == is_naive]
        games = summary[summary["arm"].isin(of_ego)]
        failed = games[["collisions", "rails", "timeouts"]].sum(axis=1).groupby(games["arm"]).sum()
        played = (games["episodes"] - games["errors"]).groupby(games["arm"]).sum()
        worst = (failed / played).max()
        assert cell is not None if len(games) else cell is None
        if cell is not None:
            assert cell.failures / cell.games == pytest.approx(worst)
            assert (cell.failures, cell.games) == (failed[cell.arm], played[cell.arm])


OPEN_INDEX = """
import sys, time
from pathlib import Path
from harness.campaign.results.run_index import runs_in
from harness.reports.index_page import render_index
for _ in range(2):
    begun = time.process_time()
    page = render_index("reports", runs_in(Path(sys.argv[1])))
    print(time.process_time() - begun, len(page), "200 of 200 runs" in page)
"""


def test_index__of_200_runs_takes_a_second_of_processor_time(tmp_path: Path) -> None:
    """Copies of the published runs, in turn; the first time in a process, with all that it loads then, and later."""
    for number, manifest in zip(range(200), cycle(PUBLISHED), strict=False):
        run = tmp_path / f"run{number}"
        run.mkdir()
        for name in ("manifest.json", "summary.csv", "result.json"):
            shutil.copy(manifest.parent / name, run / name)
    command = [sys.executable, "-c", OPEN_INDEX, str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=600.0)
    for line in done.stdout.splitlines():
        took_s, size, has_all = line.split()
        assert_work(float(took_s), 1.0)
        assert int(size) < 200_000
        assert has_all == "True"


def test_index__does_not_look_at_the_other_files_of_a_run(tmp_path: Path) -> None:
    """A run folder has thousands of files. A link among them is refused where the run is read, not in the list."""
    shutil.copytree(sumo_run(), tmp_path / "runs" / "first")
    outside = tmp_path / "outside"
    outside.write_text("")
    (tmp_path / "runs" / "first" / "traces" / "other").symlink_to(outside)
    (found,) = runs_in(tmp_path / "runs")
    assert found.state == "ended"
    with pytest.raises(UsageError, match="is a link that leads out"):
        RunFolder(tmp_path / "runs" / "first").manifest()


@pytest.mark.parametrize("name", ["manifest.json", "summary.csv", "result.json"])
def test_index__a_file_that_is_a_link_to_elsewhere_is_not_read(name: str, tmp_path: Path) -> None:
    run = shutil.copytree(sumo_run(), tmp_path / "runs" / "first")
    outside = shutil.move(run / name, tmp_path / name)
    (run / name).symlink_to(outside)
    (found,) = runs_in(tmp_path / "runs")
    assert found.state == "unreadable"
    assert "is a link that leads out" in found.problem


@pytest.mark.parametrize("content", ["", "arm\n", "arm,persona,failure_rate\nnaive_alone\n"])
def test_index__a_damaged_summary_is_a_run_that_cant_be_read(content: str, tmp_path: Path) -> None:
    run = shutil.copytree(sumo_run(), tmp_path / "first")
    (run / "summary.csv").write_text(content)
    (found,) = runs_in(tmp_path)
    assert found.state == "unreadable"
