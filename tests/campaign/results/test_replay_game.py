"""A game of a real run folder: the list with its manoeuvres, the replay folder, the film."""

from __future__ import annotations

import io
import shutil
from pathlib import Path

import pytest
from PIL import Image
from rich.console import Console

import tests.support.tiny as tiny
from harness.campaign.results.replay_game import GameList, film, game_table, played_game, replay_of, watch
from harness.campaign.results.results import write_results
from harness.campaign.storage.run_folder import RunFolder
from harness.errors import UsageError
from harness.evaluation.tables import read_csv, table_of, write_csv
from harness.evaluation.worst_first import replay_name, worst_first
from tests.support.pictures import require_gui


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """A run folder that may be changed."""
    return shutil.copytree(tiny.learned_run(), tmp_path / "run")


def printed(run: Path, arm: str | None = None, width: int = 160) -> str:
    console = Console(file=io.StringIO(), width=width)
    console.print(game_table(run, GameList(arm=arm)))
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def test_list__has_the_cause_of_each_failure(run: Path) -> None:
    row = {"arm": "naive_vs_speedy", "persona": "speedy", "seed": 1, "episode": 2, "ego_outcome": "collision"}
    event = {"other": "non_ego", "event": "cut_in", "deed": "cuts in from the left", "reaction": "brakes"}
    write_csv(table_of("causes", [row | event]), run / "causes.csv")
    shutil.rmtree(run / ".stages")  # its checksums
    (line,) = [each for each in printed(run).splitlines() if "cut-in -> brakes" in each]
    assert line.split()[:3] == ["naive_vs_speedy", "1", "2"]


def test_list__in_a_narrow_terminal_breaks_the_arm_and_the_cause_and_no_number(run: Path) -> None:
    arm = "naive_vs_speedy_with_estimation_of_careful"
    episodes = read_csv(run / "episodes.csv")
    episodes["arm"] = episodes["arm"].replace("naive_vs_speedy", arm)
    write_csv(episodes, run / "episodes.csv")
    shutil.rmtree(run / ".stages")  # its checksums
    lines = printed(run, arm, width=80).splitlines()
    title = next(number for number, line in enumerate(lines) if not line.strip())  # as many lines as its path needs
    assert lines[title + 1].split() == ["arm", "seed", "episode", "ego", "non-ego", "cause", "TTC", "(s)", "severity"]
    assert lines[title + 3].split()[1:3] == ["1", str(worst_first(episodes[episodes["arm"] == arm])["episode"].iloc[0])]


def test_list__has_no_page_after_the_last(run: Path) -> None:
    assert "page 2 of 2" in printed_page(run, 2)
    with pytest.raises(UsageError, match="the last one is 2"):
        printed_page(run, 3)


def printed_page(run: Path, page: int) -> str:
    games = len(read_csv(run / "episodes.csv"))
    console = Console(file=io.StringIO(), width=160)
    console.print(game_table(run, GameList(rows=games - 1, page=page)))
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def test_report__makes_tables_of_the_log_anew_without_playing_a_game(run: Path) -> None:
    before = {name: (run / f"{name}.csv").read_bytes() for name in ("episodes", "causes", "manoeuvres")}
    for number, file in enumerate(sorted((run / ".stages").glob("*/tables.json"))):
        if number % 2:
            file.unlink()  # as if the sources of a metric had changed
        else:
            file.with_name("episodes.csv").write_text("damaged")
    write_results(RunFolder(run), Console(file=io.StringIO()))
    assert {name: (run / f"{name}.csv").read_bytes() for name in before} == before


def test_game__is_made_from_its_trace_and_not_from_the_folder_replays(run: Path) -> None:
    name, game = replay_name("naive_alone", 1, 3), played_game(run, "naive_alone", 3, None)
    assert game.title == "naive_alone, seed 1, episode 3"
    shutil.rmtree(run / "replays")
    with replay_of(game) as replay:
        before = {file.name: file.read_bytes() for file in replay.iterdir()}
        assert (replay.name, (run / "replays").exists()) == (name, False)
    assert not replay.parent.exists()
    (run / "replays" / name).mkdir(parents=True)
    # a configuration can make SUMO write anywhere, and the folder may come from another machine
    (run / "replays" / name / "scene.sumocfg").write_text("<configuration><log value='/tmp/mine'/></configuration>")
    with replay_of(played_game(run, "naive_alone", 3, 1)) as replay:
        assert {file.name: file.read_bytes() for file in replay.iterdir()} == before
        assert "scene.sumocfg" in before


def test_watch__without_a_screen_names_the_film(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setattr("harness.replay.sumo_gui.sys.platform", "linux")
    with pytest.raises(UsageError, match="--film"):
        watch(played_game(run, "naive_alone", 0, None), Console(file=io.StringIO()))


def test_film__of_a_game_without_a_replay_folder(run: Path, tmp_path: Path) -> None:
    require_gui()
    shutil.rmtree(run / "replays")
    console = Console(file=io.StringIO(), width=200)
    game = played_game(run, "naive_vs_speedy", 0, None)
    film(game, tmp_path / "film.gif", console)
    pictures = int(game.trace["step"].max()) + 1
    assert isinstance(console.file, io.StringIO)
    assert console.file.getvalue().strip() == f"Wrote {tmp_path / 'film.gif'}: {pictures} pictures."
    with Image.open(tmp_path / "film.gif") as made:
        assert made.n_frames == pictures


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--film", "film.gif"], "harness replay RUN ARM EPISODE"),
        (["naive_alone", "0", "--film", "film.avi"], "neither .gif nor .mp4"),
    ],
)
def test_command__refuses_an_impossible_film(arguments: list[str], words: str, tmp_path: Path) -> None:
    result = tiny.harness("replay", tiny.learned_run(), *arguments, cwd=tmp_path)
    assert result.returncode == 2
    assert words in result.stderr
    assert list(tmp_path.iterdir()) == []
