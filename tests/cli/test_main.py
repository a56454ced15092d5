"""The command line: it teaches, and what is wrong is said once, clearly, with nothing written."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from harness.cli import main as cli
from harness.errors import SimulationError
from tests.support.tiny import CAREFUL, MERGE, TABLES, harness, learned_run, tables, write_campaign, write_persona


class Said:
    """What a command said and how it ended."""

    def __init__(self, code: int, out: str, err: str) -> None:
        self.code, self.out, self.err = code, out, err


@pytest.fixture
def run_command(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Said]:
    """The command in this process, as the console script calls it: quicker than one of its own."""
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setenv("TERMINAL_WIDTH", "200")

    def run(*arguments: object) -> Said:
        monkeypatch.setattr("sys.argv", ["harness", *map(str, arguments)])
        with pytest.raises(SystemExit) as stopped:
            cli.main()
        code = stopped.value.code
        return Said(0 if code is None else int(code), *capsys.readouterr())

    return run


# --- help -------------------------------------------------------------------------------------------------------------

HELP: dict[str, list[str]] = {
    "": [
        "campaign",
        "check",
        "report",
        "replay",
        "persona",
        "schema",
        "harness campaign campaigns/merge.toml",
        "Exit codes",
        "130",
    ],
    "campaign": ["FILE", "--quick", "--out", "--jobs", "reports/NAME", "one per core", "skipped"],
    "check": ["FILE", "nothing is run or written"],
    "report": ["RUN", "report.html", "reports/merge"],
    "persona": ["new", "show"],
    "persona new": ["NAME", "--out", "personas/NAME.toml", "Overwrites nothing"],
    "persona show": ["FILE", "--html", "membership curves"],
    "schema": ["DOCUMENT", "campaign, persona, scene or driver", "--out"],
    "replay": ["RUN", "ARM", "EPISODE", "--list", "--seed", "naive_vs_speedy", "worst first", "first"],
}


@pytest.mark.parametrize("command", HELP)
@pytest.mark.parametrize("option", ["--help", "-h"])
def test_help__teaches(command: str, option: str, run_command: Callable[..., Said]) -> None:
    said = run_command(*command.split(), option)
    assert said.code == 0
    for word in HELP[command]:
        assert word in said.out, word


def test_no_command__shows_the_help(run_command: Callable[..., Said]) -> None:
    said = run_command()
    assert "Commands" in said.out + said.err
    assert said.code in (0, 2)


@pytest.mark.parametrize(
    "arguments", [["dance"], ["campaign"], ["campaign", "x.toml", "--jobs", "0"], ["check", "--x"]]
)
def test_wrong_arguments__are_the_users_mistake(arguments: list[str], run_command: Callable[..., Said]) -> None:
    said = run_command(*arguments)
    assert said.code == 2
    assert "Traceback" not in said.err


# --- bad input --------------------------------------------------------------------------------------------------------


def edited(folder: Path, name: str, edit: Callable[[str], str]) -> dict[str, Any]:
    shutil.copytree(MERGE, folder / "merge")
    file = folder / "merge" / name
    before = file.read_text(encoding="utf-8")
    assert edit(before) != before
    file.write_text(edit(before), encoding="utf-8")
    return {"scene": "merge"}


def persona(folder: Path, old: str, new: str) -> dict[str, Any]:
    file = write_persona(folder, "anna")
    file.write_text(file.read_text().replace(old, new))
    return {"personas": ["anna.toml"]}


def no_route(text: str) -> str:
    return text.replace('edges="approach exit"', 'edges="approach"')


def beyond_the_lane(text: str) -> str:
    return re.sub(r"position_m = \[.*?\]", "position_m = [30.0, 4500.0]", text, count=1)


# what is wrong -> changes to the campaign; the file, and words that the message has to hold
BAD: dict[str, tuple[Callable[[Path], dict[str, Any]], str, list[str]]] = {
    "unknown key": (lambda folder: {"epsiodes": 3}, "tiny.toml", ["epsiodes", "unknown key"]),
    "misspelt key": (lambda f: {"assessment": {"epsiodes": 3}}, "tiny.toml", ["assessment.epsiodes", "'episodes'"]),
    "missing key": (lambda folder: {"personas": None}, "tiny.toml", ["personas", "is missing"]),
    "no persona": (lambda folder: {"personas": []}, "tiny.toml", ["personas"]),
    "number out of range": (lambda f: {"assessment": {"significance": 1.5}}, "tiny.toml", ["significance", "1.5"]),
    "number of the wrong kind": (lambda f: {"assessment": {"episodes": 2.5}}, "tiny.toml", ["episodes"]),
    "text for a number": (lambda f: {"assessment": {"episodes": "many"}}, "tiny.toml", ["episodes", "many"]),
    "name that is a path": (lambda f: {"name": "../tiny"}, "tiny.toml", ["name"]),
    "seed twice": (lambda folder: {"seeds": [1, 1]}, "tiny.toml", ["seeds", "twice"]),
    "buffer and games": (lambda f: {"training": {"buffer": 1000, "games": 64}}, "tiny.toml", ["buffer", "multiple"]),
    "unknown persona": (lambda folder: {"personas": ["speedy.toml"]}, "speedy.toml", ["there is no such file"]),
    "unknown driver": (lambda f: {"ego": {"driver": "lerned"}}, "tiny.toml", ["ego.driver", "learned"]),
    "persona with an unknown term": (lambda f: persona(f, "progress", "progres"), "anna.toml", ["'progress'"]),
    "persona without sources": (lambda f: persona(f, "[[sources]]", "[[surces]]"), "anna.toml", ["sources"]),
    "persona that is no TOML": (lambda f: persona(f, "name =", "name"), "anna.toml", ["not valid TOML", "line 1"]),
    "scene that is not there": (lambda folder: {"scene": "mrege"}, "scene.toml", ["there is no"]),
    "unknown lane": (
        lambda folder: edited(folder, "scene.toml", lambda text: text.replace("approach_1", "aproach_1")),
        "scene.toml",
        ["ego.lane", "'approach_1'"],
    ),
    "unknown vehicle": (
        lambda folder: edited(folder, "scene.toml", lambda text: text.replace('"non_ego"', '"non_eggo"')),
        "scene.toml",
        ["non_ego.vehicle", "'non_ego'"],
    ),
    "start beyond the lane": (
        lambda folder: edited(folder, "scene.toml", beyond_the_lane),
        "scene.toml",
        ["ego.position_m", "4500"],
    ),
    "net that is not there": (
        lambda folder: edited(folder, "scene.toml", lambda text: text.replace("merge.net.xml", "merg.net.xml")),
        "merg.net.xml",
        [],
    ),
    "net that is no XML": (lambda f: edited(f, "merge.net.xml", lambda text: text[:900]), "merge.net.xml", []),
    "net that is empty": (lambda f: edited(f, "merge.net.xml", lambda text: ""), "merge.net.xml", []),
    "net that is no net": (lambda f: edited(f, "merge.net.xml", lambda text: "<routes/>"), "merge.net.xml", []),
    "routes that are no XML": (lambda f: edited(f, "merge.rou.xml", lambda text: text[:-20]), "merge.rou.xml", []),
    "routes that are empty": (lambda f: edited(f, "merge.rou.xml", lambda text: "<routes/>"), "scene.toml", []),
    "route that does not reach the goal": (
        lambda folder: edited(folder, "merge.rou.xml", no_route),
        "merge.rou.xml",
        ["goal"],
    ),
    "route over an unknown edge": (
        lambda folder: edited(folder, "merge.rou.xml", lambda text: text.replace("approach exit", "aproach exit")),
        "merge.rou.xml",
        ["'approach'"],
    ),
}


@pytest.mark.parametrize("command", ["check", "campaign"])
@pytest.mark.parametrize("name", BAD)
def test_bad_input__one_clear_message_and_nothing_written(
    name: str, command: str, tmp_path: Path, run_command: Callable[..., Said], monkeypatch: pytest.MonkeyPatch
) -> None:
    make, file, words = BAD[name]
    changes = make(tmp_path)
    campaign = write_campaign(tmp_path, **{"ego": {"persona": str(CAREFUL)}, **changes, "name": "tiny"})
    if "name" in changes:
        campaign.write_text(campaign.read_text().replace('"tiny"', f'"{changes["name"]}"'))
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    said = run_command(command, campaign)
    assert said.code == 2, said.out + said.err
    assert "Traceback" not in said.err
    lines = said.err.strip().splitlines()
    assert any(file in line for line in lines), said.err
    assert any(all(word in line for word in words) for line in lines), said.err
    assert all("(" in line or ":" in line for line in lines)
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    "content", [b"", b"\xff\xfe", b"name = ", b"[" * 10_000, b'scene = "\\u0000"', b"x" * 10], ids=repr
)
def test_bad_input__a_campaign_that_is_none(content: bytes, tmp_path: Path, run_command: Callable[..., Said]) -> None:
    file = tmp_path / "c.toml"
    file.write_bytes(content)
    said = run_command("check", file)
    assert said.code == 2
    assert str(file) in said.err
    assert "Traceback" not in said.err


@pytest.mark.parametrize(
    "changes", [{"scene": "a\0b"}, {"personas": ["\0"]}, {"ego": {"driver": "x" * 400}}, {"scene": "x" * 400}]
)
def test_bad_input__impossible_paths(changes: dict[str, Any], tmp_path: Path, run_command: Callable[..., Said]) -> None:
    said = run_command("check", write_campaign(tmp_path, **changes))
    assert said.code == 2
    assert str(tmp_path) in said.err


def test_bad_input__what_is_not_there(tmp_path: Path, run_command: Callable[..., Said]) -> None:
    write_campaign(tmp_path)
    for command in ("check", "campaign"):
        said = run_command(command, tmp_path / "tini.toml")
        assert said.code == 2
        assert "there is no such file (did you mean 'tiny.toml'?)" in said.err
    assert run_command("check", tmp_path).code == 2  # a folder


def test_bad_input__without_a_traceback_from_the_shell_too(tmp_path: Path) -> None:
    said = harness("campaign", write_campaign(tmp_path, name="tiny", seeds=[-1]), cwd=tmp_path)
    assert said.returncode == 2
    assert said.stdout == ""
    assert len(said.stderr.strip().splitlines()) == 1
    assert "seeds" in said.stderr
    assert [each.name for each in tmp_path.iterdir()] == ["tiny.toml"]


# --- run folders ------------------------------------------------------------------------------------------------------


def test_campaign__another_campaigns_folder_is_left_alone(tmp_path: Path, run_command: Callable[..., Said]) -> None:
    run = shutil.copytree(learned_run(), tmp_path / "run")
    before = tables(run)
    said = run_command("campaign", write_campaign(tmp_path, name="other"), "--out", run)
    assert said.code == 2
    assert "belongs to campaign 'learned', not 'other'" in said.err
    assert "--out" in said.err
    assert tables(run) == before


def test_campaign__a_folder_of_something_else_is_left_alone(tmp_path: Path, run_command: Callable[..., Said]) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.tex").write_text("x")
    said = run_command("campaign", write_campaign(tmp_path), "--out", tmp_path / "out")
    assert said.code == 2
    assert [each.name for each in (tmp_path / "out").iterdir()] == ["thesis.tex"]


def test_check__says_what_would_be_done_and_writes_nothing(tmp_path: Path, run_command: Callable[..., Said]) -> None:
    campaign = write_campaign(tmp_path)
    said = run_command("check", campaign)
    assert said.code == 0
    assert "is in order" in said.out
    assert "3 trainings of up to 2,048 steps, 6 arms of 4 episodes" in said.out
    assert "assess naive_vs_speedy-seed1  after naive-seed1, speedy-seed1" in said.out
    assert list(tmp_path.iterdir()) == [campaign]


def test_report__from_the_folder_alone_even_when_it_has_moved(tmp_path: Path, run_command: Callable[..., Said]) -> None:
    moved = shutil.copytree(learned_run(), tmp_path / "elsewhere" / "[red] moved")
    for name in (*TABLES, "training.csv"):
        (moved / name).unlink()
    shutil.rmtree(moved / "replays")
    (moved / "report.html").unlink()
    said = run_command("report", moved)
    assert said.code == 0, said.err
    assert str(moved / "report.html") in said.out
    assert tables(moved) == tables(learned_run())
    assert (moved / "training.csv").read_bytes() == (learned_run() / "training.csv").read_bytes()
    assert (moved / "report.html").read_bytes() == (learned_run() / "report.html").read_bytes()
    replays = [{each.name for each in (run / "replays").iterdir()} for run in (moved, learned_run())]
    assert replays[0] == replays[1]


@pytest.mark.parametrize("command", ["report", "replay"])
def test_run_folder__that_is_none_is_named(command: str, tmp_path: Path, run_command: Callable[..., Said]) -> None:
    for folder in (tmp_path, tmp_path / "nowhere"):
        said = run_command(command, folder)
        assert said.code == 2
        assert f"{folder}: is not a run folder" in said.err


def test_run_folder__that_is_damaged_is_named(tmp_path: Path, run_command: Callable[..., Said]) -> None:
    run = shutil.copytree(learned_run(), tmp_path / "run")
    table = run / ".stages" / "naive_alone-seed1" / "episodes.csv"
    table.write_text(table.read_text().replace("naive_alone", "../../../x"))
    said = run_command("report", run)
    assert said.code == 2
    assert str(table) in said.err
    assert not (tmp_path / "x-seed1-000").exists()
    (run / "manifest.json").write_text("{")
    said = run_command("report", run)
    assert said.code == 2
    assert "manifest.json" in said.err


# --- replays ----------------------------------------------------------------------------------------------------------


def test_replay__lists_the_games_worst_first(run_command: Callable[..., Said]) -> None:
    said = run_command("replay", learned_run(), "--list")
    assert said.code == 0
    assert said.out.count("naive_alone ") == 4
    assert "harness replay RUN ARM EPISODE" in said.out
    said = run_command("replay", learned_run(), "naive_vs_speedy")
    assert said.code == 0
    assert said.out.count("naive_vs_speedy") == 4
    assert "naive_alone" not in said.out


def test_replay__arms_are_not_cut_off_where_there_is_little_room(
    run_command: Callable[..., Said], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    assert "retrained_alone_speedy" in run_command("replay", learned_run(), "--list").out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["naive_vs_spedy", "1"], ["naive_vs_spedy", "has no such arm", "'naive_vs_speedy'"]),
        (["naive_vs_speedy", "7"], ["naive_vs_speedy 7", "no such game", "from 0 to 3"]),
        (["naive_vs_speedy", "1", "--seed", "9"], ["seed 9"]),
        (["naive_vs_spedy", "--list"], ["'naive_vs_speedy'"]),
    ],
)
def test_replay__what_is_not_there_names_what_is(
    arguments: list[str], words: list[str], run_command: Callable[..., Said]
) -> None:
    said = run_command("replay", learned_run(), *arguments)
    assert said.code == 2
    for word in words:
        assert word in said.err


# --- trouble that is nobody's mistake ---------------------------------------------------------------------------------


def test_main__a_full_disk_is_one_message(run_command: Callable[..., Said], monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device", "/data/run/episodes.csv")

    monkeypatch.setattr("harness.campaign.results.results.write_results", full)
    said = run_command("report", learned_run())
    assert said.code == 1
    assert said.err.strip() == "/data/run/episodes.csv: No space left on device; what was done is kept"


def test_main__trouble_of_sumos_is_one_message(
    run_command: Callable[..., Said], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise SimulationError("SUMO died")

    monkeypatch.setattr("harness.campaign.results.results.write_results", refuse)
    said = run_command("report", learned_run())
    assert (said.code, said.err.strip()) == (1, "SimulationError: SUMO died")


def test_main__a_bug_has_its_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    def bug(*_: object) -> None:
        raise KeyError("a bug")

    monkeypatch.setattr("harness.campaign.results.results.write_results", bug)
    monkeypatch.setattr("sys.argv", ["harness", "report", str(learned_run())])
    with pytest.raises(KeyError, match="a bug"):
        cli.main()
