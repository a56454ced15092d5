"""What commands print for programs and for people who want less or more, and the log of a run."""

from __future__ import annotations

import json
import math
import os
import re
import shutil
from pathlib import Path
from typing import Any

import pytest

from harness.campaign.storage.run_folder import RunFolder
from harness.campaign.storage.run_log import LOG
from harness.evaluation.tables import read_csv
from harness.reports.human_ranges import comparable, headline
from tests.support.tiny import BY_SUMO, PAPER_MERGE, harness, sumo_run, write_campaign

LINE = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ (DEBUG|INFO|WARNING|ERROR) +\S.*|    .*")


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """A finished run that a test may change."""
    return shutil.copytree(sumo_run(), tmp_path / "run")


def as_json(*arguments: object) -> Any:
    done = harness(*arguments, "--json")
    return json.loads(done.stdout)


# --- JSON -------------------------------------------------------------------------------------------------------------


def test_check__json_has_the_stages(tmp_path: Path) -> None:
    checked = as_json("check", write_campaign(tmp_path, **BY_SUMO))
    assert (checked["campaign"], checked["in_order"]) == ("left_to_sumo", True)
    stages = {each["stage"]: each for each in checked["stages"]}
    assert stages["naive_vs_speedy-seed1"]["after"] == ["speedy-seed1"]
    assert {each["kind"] for each in checked["stages"]} == {"training", "assessment"}
    (family,) = checked["planned_tests"]
    assert family == {
        "about": "this trained pair",
        "tests": [{"question": "RQ1", "persona": "speedy", "seeds": [1]}],
    }
    assert as_json("check", PAPER_MERGE)["scene"] == str(PAPER_MERGE)


def test_realism__prints_its_table_and_json_has_every_row(run: Path) -> None:
    table = read_csv(run / "realism.csv")
    said = harness("realism", run)
    assert said.returncode == 0, said.stderr
    assert headline(table) in said.stdout
    assert f"Not comparable: {len(table) - len(comparable(table))} more figures" in said.stdout
    assert [(row["player"], row["figure"], row["value"]) for row in as_json("realism", run)] == [
        (row["player"], row["figure"], None if math.isnan(row["value"]) else pytest.approx(row["value"]))
        for row in table.to_dict("records")
    ]
    (run / "realism.csv").write_text("player\n")
    assert harness("realism", run).returncode == 2


def test_check__json_has_the_problems(tmp_path: Path) -> None:
    file = write_campaign(tmp_path, seeds=[-1])
    done = harness("check", file, "--json")
    (problem,) = json.loads(done.stdout)["problems"]
    assert done.returncode == 2
    assert (problem["file"], problem["key"]) == (str(file), "seeds[0]")
    assert problem["message"] in done.stderr


def test_campaign__json_is_the_result_and_nothing_else_is_on_stdout(tmp_path: Path, run: Path) -> None:
    done = harness("campaign", write_campaign(tmp_path, **BY_SUMO), "--out", run, "--json")
    told = json.loads(done.stdout)
    written = json.loads((run / "result.json").read_text(encoding="utf-8"))
    assert told == {"run": str(run), "report": str(run / "report.html"), **written}
    assert done.returncode == told["exit_code"]
    assert "Report: " in done.stderr


def test_replay__json_lists_the_games_that_the_table_lists(run: Path) -> None:
    listed = as_json("replay", run, "--list", "--rows", 3)
    assert listed["number"] == len(read_csv(run / "episodes.csv")) > 3
    assert listed["pages"] == -(-listed["number"] // 3)
    assert len(listed["games"]) == 3
    names = {"arm", "seed", "episode", "ego_outcome", "non_ego_outcome", "ego_min_ttc_s", "severity", "cause"}
    assert set(listed["games"][0]) == names


def test_replay__one_game_has_no_json(run: Path) -> None:
    done = harness("replay", run, "naive_alone", 0, "--json")
    assert done.returncode == 2
    assert "lists games" in done.stderr


# --- less and more ----------------------------------------------------------------------------------------------------


def test_report__quiet_prints_nothing_if_nothing_failed(run: Path) -> None:
    done = harness("report", run, "--quiet")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_report__quiet_prints_what_failed(run: Path) -> None:
    manifest = json.loads((run / "manifest.json").read_text(encoding="utf-8"))
    manifest["stages"]["naive_alone-seed1"] |= {"status": "failed", "message": "a.parquet: No space left on device"}
    RunFolder(run).write_manifest(manifest)
    RunFolder(run).results.unlink()  # they are of the manifest before
    done = harness("report", run, "-q")
    assert (done.returncode, done.stdout) == (
        1,
        "Not finished: naive_alone-seed1\n  a.parquet: No space left on device\n",
    )


def test_report__verbose_prints_the_log(run: Path) -> None:
    before = (run / LOG).read_text(encoding="utf-8")
    printed = harness("report", run, "--verbose").stdout
    added = (run / LOG).read_text(encoding="utf-8").removeprefix(before).splitlines()
    assert any("wrote the results" in line for line in added)
    assert [line for line in printed.splitlines() if LINE.fullmatch(line) and line[0] != " "] == added


def test_quiet_and_verbose__are_refused_together(run: Path) -> None:
    assert harness("report", run, "-q", "-v").returncode == 2


# --- the log ----------------------------------------------------------------------------------------------------------


def test_log__tells_of_each_stage() -> None:
    lines = (sumo_run() / LOG).read_text(encoding="utf-8").splitlines()
    manifest = json.loads((sumo_run() / "manifest.json").read_text(encoding="utf-8"))
    assert all(LINE.fullmatch(line) for line in lines)
    for stage in manifest["stages"]:
        assert sum(f"started  {stage}" in line for line in lines) == 1
        assert sum(f"done     {stage}:" in line for line in lines) == 1
    assert "ended after" in lines[-1]


# --- a terminal without a character -----------------------------------------------------------------------------------


@pytest.mark.parametrize("command", [["new", "FOLDER"], ["check", "FOLDER"], ["runs", "FOLDER"]])
def test_command__replaces_what_the_terminal_has_no_character_for(tmp_path: Path, command: list[str]) -> None:
    folder = tmp_path / "\N{GREEK SMALL LETTER MU}" / "mine"
    folder.parent.mkdir()
    if command[0] == "check":
        shutil.copytree(PAPER_MERGE, folder)
    if command[0] == "runs":
        folder.mkdir()
    words = [str(folder) if word == "FOLDER" else word for word in command]
    said = harness(*words, env={**os.environ, "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"})
    assert (said.returncode, said.stderr) == (0, "")
    assert "?/mine" in said.stdout
