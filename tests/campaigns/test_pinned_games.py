"""A failure of the shipped naive ego, pinned and played again: it fails there, the retrained ego does not."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pandas as pd
import pytest

from harness.assessment.rollout import Game
from harness.assessment.start_trials import StartTrials
from harness.campaign.execution.pinned_games import PinnedGames
from harness.campaign.execution.run_players import RunPlayers
from harness.campaign.results.drawn_starts import drawn_starts
from harness.campaign.storage.run_folder import RunFolder
from harness.config.pinned_game import PinnedGame
from harness.config.toml_reading import read_document
from harness.errors import NOT_ACCEPTED
from harness.evaluation.tables import read_csv
from harness.evaluation.trace_file import TraceReader
from harness.road.scene.open_scene import open_scene
from tests.support import shipped
from tests.support.shipped import NAIVE, PERSON, POLICIES, RETRAINED, stage
from tests.support.tiny import SHIPPED, carried_out, finished, harness, numbers, write_campaign

ARM = f"naive_vs_{shipped.SPEEDY}"


@pytest.fixture(scope="module")
def run() -> Path:
    """A few games of the shipped policies, with the judgement of their failures."""
    changes: dict[str, Any] = {
        **SHIPPED,
        "name": "pinned",
        "assessment": {"episodes": 8, "reference_drivers": True},
    }
    return finished(**changes)


@pytest.fixture(scope="module")
def failed(run: Path) -> list[int]:
    """The games that the naive ego fails against the speedy driver."""
    episodes = read_csv(run / "episodes.csv")
    return episodes.loc[(episodes["arm"] == ARM) & (episodes["ego_failed"] == 1), "episode"].tolist()


@pytest.fixture(scope="module")
def pinned(run: Path, failed: list[int], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of one pinned game."""
    folder = tmp_path_factory.mktemp("pinned") / "games"
    done = harness("minimise", run, ARM, failed[0], "--policies", POLICIES, "--out", folder)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "no longer fails after this change" in done.stdout
    return folder


def game_of(folder: Path) -> PinnedGame:
    (file,) = folder.glob("*.toml")
    return read_document(file, PinnedGame)


# --- the judgement of the same run ---


def test_preventability__every_failure_is_judged_by_every_driver_and_counted(run: Path, failed: list[int]) -> None:
    games, counts = read_csv(run / "reference_drivers.csv"), read_csv(run / "preventability.csv")
    of_arm = games[games["arm"] == ARM]
    assert sorted(of_arm["episode"].unique()) == sorted(failed)
    assert set(of_arm.groupby("driver").size()) == {len(failed)}
    assert of_arm["prevented_from_start"].notna().all()
    assert (of_arm["conflict_s"].dropna() < of_arm["failed_s"].loc[of_arm["conflict_s"].notna()]).all()
    assert (of_arm["preventable_from_s"] <= of_arm["preventable_until_s"]).all()
    assert (of_arm["preventable_until_s"] < of_arm["failed_s"]).all()
    prevented = games.groupby(["arm", "driver"])["prevented_from_start"].sum()
    for row in counts.itertuples():
        assert row.from_start_prevented == prevented[row.arm, row.driver]
    page = (run / "report.html").read_text(encoding="utf-8")
    assert "Preventable by the careful and competent driver of UN R157" in page


def test_preventability__the_course_of_a_driver_that_prevents_a_collision_is_in_the_page(run: Path) -> None:
    judged, courses = read_csv(run / "reference_drivers.csv"), read_csv(run / "takeovers.csv")
    prevents = judged[judged["prevented_from_conflict"] == 1].drop_duplicates(["arm", "episode"])
    begun = courses.drop_duplicates(["arm", "episode"]).set_index(["arm", "episode"])
    assert len(begun) == len(prevents) > 0
    for row in prevents.itertuples():
        first = begun.loc[(row.arm, row.episode)]
        assert (first["driver"], first["step"] * 0.1) == (row.driver, pytest.approx(row.conflict_s))
    page = (run / "report.html").read_text(encoding="utf-8")
    embedded = json.loads(re.search(r'id="recorded">(.*?)</script>', page, re.DOTALL)[1])["games"]
    shown = {(each["arm"], each["episode"]) for each in embedded if each["reference"] is not None}
    assert shown == set(begun.index)


def test_preventability__running_the_campaign_again_judges_nothing_again(run: Path, tmp_path: Path) -> None:
    again, campaign = shutil.copytree(run, tmp_path / "pinned"), run.with_suffix(".toml")
    assert "Nothing to do" in carried_out(campaign, again)
    (again / ".stages" / stage(f"{ARM}_preventability") / "reference_drivers.csv").unlink()
    printed = carried_out(campaign, again)
    assert [f"done     {stage(ARM + part)}" in printed for part in ("_preventability", "")] == [True, False]
    assert numbers(again) == numbers(run)


# --- minimising ---


def test_minimise__the_start_lies_between_the_campaigns_and_one_without_a_failure(pinned: Path) -> None:
    game = game_of(pinned)
    assert (game.arm, game.seed) == (ARM, shipped.SEED)
    assert game.outcome in ("collision", "rail")
    assert game.no_failure_from is not None
    fails, passes = (pd.Series([*each.position_m, *each.speed_mps]) for each in (game.start, game.no_failure_from))
    assert (fails - passes).abs().max() <= 0.05
    assert list(game.drawn_start.position_m) != list(game.no_failure_from.position_m) or list(
        game.drawn_start.speed_mps
    ) != list(game.no_failure_from.speed_mps)


def test_minimise__all_pins_one_game_of_each_kind(run: Path, failed: list[int], tmp_path: Path) -> None:
    """The shipped policies are found by their checksums."""
    done = harness("minimise", run, ARM, "--all", "--out", tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    games = [read_document(file, PinnedGame) for file in sorted(tmp_path.glob("*.toml"))]
    assert 1 <= len(games) <= len(failed)
    assert sum(game.alike for game in games) == len(failed)


def test_minimise__counts_all_games_that_it_plays(
    run: Path, failed: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The failure played again, the starts of other games that were tried, and the last game among them."""
    played = list[object]()

    def play(self: StartTrials, start: object) -> Game:
        played.append(start)
        return play_one(self, start)

    play_one: Any = StartTrials.play
    monkeypatch.setattr(StartTrials, "play", play)
    folder = RunFolder(run)
    pinning = PinnedGames(folder, RunPlayers(folder, POLICIES), tmp_path)
    assert pinning.pin(pinning.failure(ARM, shipped.SEED, failed[0])).games == len(played) > 3


def test_minimise__says_what_is_wrong(run: Path, failed: list[int]) -> None:
    fine = next(episode for episode in range(8) if episode not in failed)
    for arguments, words in (
        ((run, ARM, fine, "--policies", POLICIES), "does not fail in this game"),
        ((run, "naive_vs_nobody", 0, "--policies", POLICIES), "has no such arm"),
        ((run,), "names no game"),
    ):
        done = harness("minimise", *arguments)
        assert done.returncode == 2
        assert words in done.stderr


# --- the report's picture of the starts ---


def test_report__draws_each_start_as_it_was_played_and_the_boundary_that_was_found(
    run: Path, pinned: Path, tmp_path: Path
) -> None:
    again = shutil.copytree(run, tmp_path / "run")
    shutil.copytree(pinned, again / "pinned")
    done = harness("report", again)
    assert "Report:" in done.stdout, done.stdout + done.stderr
    page = (again / "report.html").read_text(encoding="utf-8")
    section = page[page.index('<section id="starts"') :]
    assert "Lines lead from a failure" in section[: section.index("</section>")]
    traces = TraceReader()
    starts = drawn_starts(open_scene(run / "scene"), shipped.SEED, range(8))
    for episode, start in starts.iterrows():
        trace = traces.read(run / "traces" / f"{stage(ARM)}.parquet", int(str(episode)))
        ego, person = (trace[(trace["step"] == 0) & (trace["player"] == name)].iloc[0] for name in ("ego", "non_ego"))
        assert start["non_ego_ahead_m"] == pytest.approx(
            person["x_m"] - ego["x_m"], abs=1e-3
        )  # equal cars, straight on
        assert start["non_ego_faster_mps"] == pytest.approx(person["speed_mps"] - ego["speed_mps"], abs=1e-3)


# --- regression ---


def test_regression__the_naive_ego_fails_and_the_retrained_ego_passes(pinned: Path, tmp_path: Path) -> None:
    naive = harness("regression", pinned, "--ego", POLICIES / NAIVE, "--junit", tmp_path / "junit.xml")
    assert naive.returncode == 3, naive.stdout + naive.stderr
    assert "FAIL" in naive.stdout
    suite = ElementTree.parse(tmp_path / "junit.xml").getroot().find("testsuite")
    assert suite is not None
    assert (suite.get("tests"), suite.get("failures"), suite.get("errors")) == ("1", "1", "0")
    retrained = harness("regression", pinned, "--ego", POLICIES / RETRAINED)
    assert retrained.returncode == 0, retrained.stdout + retrained.stderr
    assert "1 of 1 pinned games pass." in retrained.stdout


def test_regression__refuses_what_is_not_the_pinned_game(pinned: Path, tmp_path: Path) -> None:
    empty = harness("regression", tmp_path, "--ego", POLICIES / NAIVE)
    assert (empty.returncode, "no pinned game" in empty.stderr) == (2, True)
    changed = tmp_path / "changed"
    shutil.copytree(pinned, changed)
    for name in ("policy.json", "policy.safetensors"):
        shutil.copy(POLICIES / NAIVE / name, changed / "policies" / PERSON / name)
    with (changed / "scene" / "scene.toml").open("a", encoding="utf-8") as scene:
        scene.write("\n# changed\n")
    done = harness("regression", changed, "--ego", POLICIES / NAIVE)
    assert done.returncode == 2
    assert "is not the scene of this game" in done.stderr
    shutil.copytree(pinned / "scene", changed / "scene", dirs_exist_ok=True)
    done = harness("regression", changed, "--ego", POLICIES / NAIVE)
    assert done.returncode == 2
    assert "is not the policy of this game" in done.stderr


# --- a second training seed ---


def test_minimise__a_failure_of_the_second_training_seed_has_the_starts_of_the_first(tmp_path: Path) -> None:
    """The second training is a copy of the first: it plays the same games, and fails in the same."""
    policies = tmp_path / "policies"
    for folder in (each for each in POLICIES.iterdir() if each.is_dir()):
        shutil.copytree(folder, policies / folder.name)
        copy = shutil.copytree(folder, policies / folder.name.replace(f"seed{shipped.SEED}", f"seed{shipped.SEED + 1}"))
        card = (copy / "policy.json").read_text(encoding="utf-8").replace(folder.name, copy.name)
        (copy / "policy.json").write_text(card, encoding="utf-8")
    changes: dict[str, Any] = {**SHIPPED, "seeds": [shipped.SEED, shipped.SEED + 1], "policies": str(policies)}
    run = tmp_path / "run"
    carried_out(write_campaign(tmp_path, **changes, assessment={"episodes": 8, "reference_drivers": True}), run)
    judged = read_csv(run / "reference_drivers.csv")
    first, second = (rows.drop(columns="seed").reset_index(drop=True) for _, rows in judged.groupby("seed"))
    pd.testing.assert_frame_equal(first, second, check_exact=True)
    failed = judged.loc[judged["arm"] == ARM, "episode"]
    out = tmp_path / "games"
    options = ("--seed", shipped.SEED + 1, "--policies", policies, "--out", out)
    done = harness("minimise", run, ARM, int(failed.iloc[0]), *options)
    assert done.returncode == 0, done.stdout + done.stderr
    game = game_of(out)
    assert (game.seed, game.start_seed) == (shipped.SEED + 1, shipped.SEED)
    again = harness("regression", out, "--ego", policies / NAIVE)
    assert again.returncode == NOT_ACCEPTED, again.stdout + again.stderr
