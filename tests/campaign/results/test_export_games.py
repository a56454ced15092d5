"""Games of a real run folder as files of other programs, by the command."""

from __future__ import annotations

import csv
import shutil
from pathlib import Path
from xml.etree import ElementTree

import pytest

import tests.support.tiny as tiny
from harness.evaluation.people import judged_outcomes
from harness.evaluation.tables import read_csv
from harness.evaluation.trace_file import TraceReader
from harness.evaluation.worst_first import FAILURES


def exported(*arguments: object) -> str:
    done = tiny.harness("export", *arguments)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_game__is_exported_with_every_step_of_its_trace(tmp_path: Path) -> None:
    run, folder = tiny.learned_run(), tmp_path / "game"
    exported(run, "naive_alone", 3, "--openscenario", "--opendrive", "--csv", folder)
    assert sorted(file.name for file in folder.iterdir()) == [
        "01_recordingMeta.csv",
        "01_tracks.csv",
        "01_tracksMeta.csv",
        "games.csv",
        "naive_alone-seed1-003.xosc",
        "scene.xodr",
    ]
    trace = TraceReader().read(run / "traces" / "naive_alone-seed1.parquet", 3)
    root = ElementTree.parse(folder / "naive_alone-seed1-003.xosc").getroot()
    assert len(list(root.iter("Vertex"))) == len(trace)
    with (folder / "01_tracks.csv").open() as file:
        assert len(list(csv.DictReader(file))) == len(trace)


def test_failures__are_all_exported_worst_first(tmp_path: Path) -> None:
    run = tiny.learned_run()
    episodes = read_csv(run / "episodes.csv")
    failures = episodes[judged_outcomes(episodes).isin(FAILURES)]
    assert len(failures) > 1
    printed = exported(run, "--failures", tmp_path / "failures")
    assert f"Wrote {len(failures)} games" in " ".join(printed.split())
    with (tmp_path / "failures" / "games.csv").open() as file:
        games = list(csv.DictReader(file))
    expected = set(failures[["arm", "seed", "episode"]].itertuples(index=False, name=None))
    assert {(game["arm"], int(game["seed"]), int(game["episode"])) for game in games} == expected
    assert {f"{game['name']}.xosc" for game in games} == {file.name for file in (tmp_path / "failures").glob("*.xosc")}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("naive_alon", 3, "out"), "did you mean 'naive_alone'?"),
        (("naive_alone", 999, "out"), "has no such game"),
        (("naive_alone", "three", "out"), "is not the number of an episode"),
        (("naive_alone", 3), "is not an arm, an episode and a new folder"),
        (("naive_alone", 3, "there"), "not empty"),
        (("naive_alone", 3, "file"), "is a file"),
        (("naive_alone", 3, "no/out"), "there is no folder"),
        (("naive_alone", 3, "out", "--failures"), "is more than an arm and a new folder"),
        (("out", "--failures", "--seed", 9), "seeds are 1"),
    ],
)
def test_mistakes__are_one_line_and_write_nothing(
    arguments: tuple[object, ...], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there").mkdir()
    (tmp_path / "there" / "mine.txt").write_text("mine")
    (tmp_path / "file").write_text("mine")
    done = tiny.harness("export", tiny.learned_run(), *arguments)
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1), done.stderr
    assert message in done.stderr
    assert sorted(file.name for file in tmp_path.rglob("*")) == ["file", "mine.txt", "there"]


def test_mistakes__a_run_without_traces_is_one(tmp_path: Path) -> None:
    run = shutil.copytree(tiny.learned_run(), tmp_path / "run")
    shutil.rmtree(run / "traces")
    for arguments in (("naive_alone", 3), ("--failures",)):
        done = tiny.harness("export", run, *arguments, tmp_path / "out")
        assert (done.returncode, len(done.stderr.splitlines())) == (2, 1), done.stderr
        assert "does not contain the traces" in done.stderr
    assert not (tmp_path / "out").exists()
