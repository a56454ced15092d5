"""An arm in segments: the same bytes whatever interrupted it, and the memory of a few segments."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

import harness.campaign.execution.assessment_stage
from harness.assessment.seated_arm import SeatedArm
from harness.campaign.execution.assessment_stage import Segment, join_segments, play_segments, segments_of
from harness.campaign.execution.stage_run import Attempt, StageRun
from harness.campaign.storage.arm_tables import PLAYED
from harness.campaign.storage.locks import held_by_worker
from harness.drivers.sumo import SumoDriver
from harness.errors import StageFailed
from harness.evaluation.tables import read_csv
from harness.game.arrays import FloatArray, IntArray
from harness.road.scene.open_scene import OpenScene
from tests.support.plans import empty_context
from tests.support.repository import REPOSITORY
from tests.support.rollouts import Steady, arm

EPISODES = 7
LABELS: dict[str, str | int] = {"arm": "naive_vs_sumo", "persona": "", "seed": 1}
FIRST, AGAIN = Attempt(), Attempt(first=False)


@pytest.fixture(autouse=True)
def three_games(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(harness.campaign.execution.assessment_stage, "SEGMENT_EPISODES", 3)


def play(
    assessed: SeatedArm, folder: Path, attempt: Attempt = FIRST, on_start: Callable[[int], None] = lambda episode: None
) -> tuple[int, list[int]]:
    """Errors, and the episodes that were played."""
    played: list[int] = []

    def note(episode: int) -> None:
        on_start(episode)
        played.append(episode)

    segments = segments_of(folder / "segments", EPISODES)
    run = StageRun(context=empty_context(folder), attempt=attempt, on_start=note)
    play_segments(assessed, segments, LABELS, run)
    join_segments(segments, folder / PLAYED, folder / "traces.parquet", LABELS)
    return errors_in(folder), played


def errors_in(folder: Path) -> int:
    return int((read_csv(folder / PLAYED)["error"] != "").sum())


def recorded(folder: Path) -> list[int]:
    """The episodes of which there are traces."""
    return list(pd.read_parquet(folder / "traces.parquet")["episode"].unique())


def files(folder: Path) -> dict[str, bytes]:
    return {each.name: each.read_bytes() for each in folder.iterdir() if each.is_file()}


@pytest.fixture(scope="module")
def steady(merge: OpenScene) -> SeatedArm:
    return arm(merge, Steady(), SumoDriver())


@pytest.fixture(scope="module")
def whole(steady: SeatedArm, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("whole")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(harness.campaign.execution.assessment_stage, "SEGMENT_EPISODES", 3)
        assert play(steady, folder) == (0, list(range(EPISODES)))
    assert read_csv(folder / PLAYED)["episode"].tolist() == list(range(EPISODES))
    assert recorded(folder) == list(range(EPISODES))
    return folder


class Killed(BaseException):
    """Ends an arm as the death of its process does: nobody catches it."""


@pytest.mark.parametrize("dies_in", [0, 2, 3, 6])
def test_arm__killed_in_any_game_is_uninterrupted(dies_in: int, steady: SeatedArm, whole: Path, tmp_path: Path) -> None:
    def die(episode: int) -> None:
        if episode == dies_in:
            raise Killed

    with pytest.raises(Killed):
        play(steady, tmp_path, on_start=die)
    assert play(steady, tmp_path, AGAIN) == (0, list(range(dies_in // 3 * 3, EPISODES)))
    assert files(tmp_path) == files(whole)


def test_arm__a_game_that_is_given_up_is_an_error_and_the_others_are_played(
    steady: SeatedArm, whole: Path, tmp_path: Path
) -> None:
    errors, played = play(steady, tmp_path, Attempt(first=False, abandoned={4: "the worker died of SIGSEGV"}))
    assert (errors, played) == (1, [0, 1, 2, 3, 5, 6])
    expected, table = (read_csv(folder / PLAYED) for folder in (whole, tmp_path))
    assert table.loc[4, ["ego_outcome", "non_ego_outcome", "error"]].tolist() == [
        *("error", "error", "the worker died of SIGSEGV")
    ]
    assert table.drop(4).equals(expected.drop(4))
    assert recorded(tmp_path) == [0, 1, 2, 3, 5, 6]


def test_arm__plays_what_another_worker_leaves_at_last(steady: SeatedArm, whole: Path, tmp_path: Path) -> None:
    """Another worker has the segment from game 3, and ends without it while game 6 is played."""
    locks, segment = tmp_path / ".stages" / "worker_locks", f"{LABELS['arm']}-seed{LABELS['seed']}.000003"
    with ExitStack() as another:
        another.enter_context(held_by_worker(locks, segment, 0.0))
        _, played = play(steady, tmp_path, on_start=lambda episode: another.close() if episode == 6 else None)
    assert played == [0, 1, 2, 6, 3, 4, 5]
    assert files(tmp_path) == files(whole)


class Raises(Steady):
    """Raises in some of the games that it plays, which are counted from 1."""

    def __init__(self, raising: Callable[[int], bool]) -> None:
        super().__init__()
        self.games, self._raising = 0, raising

    def reset(self, games: IntArray) -> None:
        self.games += 1

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        if self._raising(self.games):
            raise RuntimeError(f"out of ideas after {self.games * 1.5} s")
        return super().decide(games, observation, noise)


def test_arm__only_segments_with_errors_are_played_again_by_the_next_run(
    merge: OpenScene, whole: Path, tmp_path: Path
) -> None:
    forgetful = arm(merge, Raises(lambda game: game == 5), SumoDriver())
    assert play(forgetful, tmp_path) == (1, list(range(EPISODES)))
    assert play(forgetful, tmp_path, AGAIN) == (1, [])  # within a run, errors stay
    assert play(forgetful, tmp_path) == (0, [3, 4, 5])
    assert files(tmp_path) == files(whole)


def test_arm__ends_if_its_first_ten_games_fail_for_one_reason(merge: OpenScene, tmp_path: Path) -> None:
    def errors(driver: Raises, folder: Path, keep_going: bool = False) -> int:
        run = StageRun(context=replace(empty_context(folder), keep_going=keep_going))
        segments = segments_of(folder / "segments", 12)
        play_segments(arm(merge, driver, SumoDriver()), segments, LABELS, run)
        return sum(each.errors() or 0 for each in segments)

    never = Raises(lambda game: True)
    with pytest.raises(StageFailed, match=r"none of its first 10 games .*--keep-going.*RuntimeError: out of ideas"):
        errors(never, tmp_path)
    assert never.games == 12  # the games of the segments that the first ten are in
    assert errors(Raises(lambda game: True), tmp_path, keep_going=True) == 12
    assert errors(Raises(lambda game: game != 10), tmp_path / "one") == 11


@pytest.mark.parametrize("name", ["json", PLAYED, "traces.parquet"])
@pytest.mark.parametrize("gone", [True, False])
def test_arm__a_torn_segment_is_played_again(
    name: str, gone: bool, steady: SeatedArm, whole: Path, tmp_path: Path
) -> None:
    shutil.copytree(whole, tmp_path, dirs_exist_ok=True)
    torn = Segment(tmp_path / "segments", range(3, 6)).file(name)
    torn.unlink() if gone else torn.write_bytes(torn.read_bytes()[:-10])
    assert play(steady, tmp_path) == (0, [3, 4, 5])
    assert files(tmp_path) == files(whole)


def test_arm__segments_of_other_versions_are_played_again(
    steady: SeatedArm, whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(whole, tmp_path, dirs_exist_ok=True)
    monkeypatch.setattr(harness.campaign.execution.assessment_stage, "versions_of_numbers", lambda: {"numpy": "99"})
    assert play(steady, tmp_path) == (0, list(range(EPISODES)))


STREAM = """
import resource, sys
from itertools import repeat
from pathlib import Path
from harness.campaign.execution import assessment_stage as segments
from harness.assessment.seated_arm import SeatedArm
from harness.assessment.rollout import Game
from harness.campaign.execution.stage_run import StageRun
from tests.support.plans import empty_context
from harness.evaluation.trace_file import SCHEMA
folder, episodes = Path(sys.argv[1]), int(sys.argv[2])
texts = {"player": "ego", "vehicle_type": "car", "outcome": "", "signals": "", "signal_s": "", "steers": True}
def game(episode):
    columns = {name: [texts.get(name, 0.5)] * 2000 for name in SCHEMA.names}
    columns |= {"episode": [episode] * 2000, "step": list(range(2000)), "lapsed": [False] * 2000}
    return Game(played={"episode": episode, "ego_outcome": "goal", "error": ""}, trace=columns, scene=None)
segments.assess_batches = lambda arm, batches, begin, abandoned: (game(each) for batch in batches for each in batch)
segments.plays_side_by_side = lambda arm: True
class Anyone:
    name, seed, scene, drivers, trace_schema = "a", 1, None, (None, None), SCHEMA
parts = segments.segments_of(folder / "segments", episodes)
run = StageRun(context=empty_context(folder))
segments.play_segments(Anyone, parts, {"arm": "a", "persona": "", "seed": 1}, run)
segments.join_segments(parts, folder / "played.csv", folder / "t.parquet", {})
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


def test_arm__needs_the_memory_of_a_few_segments(tmp_path: Path) -> None:
    """Ten times the games of 2,000 rows each, which would be 160 MB more, in a process of their own."""
    peak_kb = []
    for episodes in (100, 1000):
        folder = tmp_path / str(episodes)
        folder.mkdir()
        done = subprocess.run(
            [sys.executable, "-c", STREAM, folder, str(episodes)], cwd=REPOSITORY, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        peak_kb.append(int(done.stdout))
    assert peak_kb[1] - peak_kb[0] < 40_000, peak_kb
