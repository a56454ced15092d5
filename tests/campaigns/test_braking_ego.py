"""A tiny league through the command: an ONNX network that always brakes, in two scenes."""

from __future__ import annotations

import html
import json
import shutil
from pathlib import Path

import numpy as np
import onnx
import pandas as pd
import pytest
from onnx import TensorProto, helper
from typer.testing import CliRunner

from harness.cli.app import app
from harness.errors import UsageError
from harness.evaluation.tables import read_csv, write_csv
from harness.game.observation_layout import SIZE
from tests.support.shipped import SEED, people_seeds

EPISODES = 3
SEEDS = people_seeds("red_light")
ALL_OF_THREE = 0.025 ** (1 / 3)
"""The low end of the Clopper-Pearson interval of 3 of 3."""


@pytest.fixture(scope="module")
def league(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the league."""
    folder = tmp_path_factory.mktemp("league")
    _write_brake(folder / "brake.onnx")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        options = ("--scenes", "paper_merge,red_light", "--episodes", str(EPISODES), "--jobs", "1", "--out", "out")
        done = CliRunner().invoke(app, ["league", "--ego", "brake.onnx", *options])
    assert done.exit_code == 0, done.output
    assert "red_light: campaign 2 of 2, about" in done.output
    return folder / "out"


def _write_brake(file: Path) -> None:
    """A network that decides full braking, straight on, whatever it observes."""
    weights = onnx.numpy_helper.from_array(np.zeros((SIZE, 2), dtype=np.float32), "weights")
    bias = onnx.numpy_helper.from_array(np.array([-1.0, 0.0], dtype=np.float32), "bias")
    nodes = [helper.make_node("Gemm", ["seen", "weights", "bias"], ["action"])]
    seen, action = (
        helper.make_tensor_value_info(name, TensorProto.FLOAT, ["n", size])
        for name, size in (("seen", SIZE), ("action", 2))
    )
    graph = helper.make_graph(nodes, "brake", [seen], [action], [weights, bias])
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8), file)


def rows(league: Path) -> pd.DataFrame:
    """Of each scene, person and training of the person."""
    return read_csv(league / "league.csv").set_index(["scene", "person", "seed"])


def test_rows__every_shipped_person_and_ordinary_traffic_in_every_scene(league: Path) -> None:
    """A person has a row for each of its trainings."""
    merge = [("paper_merge", person, SEED) for person in ("nobody", "sumo", "paper_distracted", "paper_speedy")]
    light = [("red_light", "nobody", SEEDS[0]), ("red_light", "sumo", SEEDS[0])]
    light += [("red_light", "red_light_runner", seed) for seed in SEEDS]
    assert sorted(rows(league).index) == sorted(merge + light)
    assert set(rows(league)["ego"]) == {"brake"}
    assert set(rows(league)["episodes"]) == {EPISODES}


def test_rows__an_ego_that_stands_runs_out_of_time(league: Path) -> None:
    """Alone it brakes to a stand in every game, which hurts nobody, and has no person to prevent anything against."""
    row = rows(league).loc["paper_merge", "nobody", SEED]
    assert row[["failure_rate", "failure_rate_high", "hard_brake_rate"]].tolist() == [1.0, 1.0, 1.0]
    assert row["failure_rate_low"] == pytest.approx(ALL_OF_THREE)
    assert row[["collisions", "rails", "timeouts", "errors"]].tolist() == [0, 0, EPISODES, 0]
    assert row["serious_injuries"] == 0.0
    assert np.isnan(row["preventable_rate"])


def test_rows__an_ego_that_brakes_for_nothing_is_hit_from_behind(league: Path) -> None:
    """On the red light's road a car follows it in most games."""
    row = rows(league).loc["red_light", "nobody", SEEDS[0]]
    assert row["collisions"] + row["timeouts"] == EPISODES
    assert row["collisions"] > 0
    assert row["serious_injuries"] > 0.0


def test_rows__of_people_say_nothing_where_the_ego_cannot_drive_the_scene_alone(league: Path) -> None:
    """They are the last, and the page says why."""
    reason = "the ego brake can't drive this scene: alone it reaches its goal in 0 of 3 games (0 %), below 97 %"
    reasons = rows(league)["reason"]
    alone = [("paper_merge", "nobody", SEED), ("red_light", "nobody", SEEDS[0])]
    assert sorted(reasons[reasons == ""].index) == alone
    assert all(each.startswith(reason) for each in reasons.drop("nobody", level="person"))
    assert reasons.index[:2].get_level_values("person").tolist() == ["nobody", "nobody"]
    page = html.unescape((league / "league.html").read_text(encoding="utf-8"))
    assert all(f"{scene}: {reason}" in page for scene in ("paper_merge", "red_light"))
    assert f"Not answered: {reason}" in (league / "junit.xml").read_text(encoding="utf-8")


def test_rows__are_those_of_the_run_folders(league: Path) -> None:
    """How many failures the driver of UN R157 prevents from the start is counted again, game by game."""
    judged = read_csv(league / "paper_merge" / "reference_drivers.csv")
    regulation = judged[judged["driver"] == "careful_and_competent"]
    summary = read_csv(league / "paper_merge" / "summary.csv").set_index("arm")
    for person in ("paper_speedy", "paper_distracted"):
        row, arm = rows(league).loc["paper_merge", person, SEED], f"naive_vs_{person}"
        prevented = regulation[regulation["arm"] == arm]["prevented_from_start"].sum()
        assert row["preventable_rate"] == pytest.approx(prevented / EPISODES)
        assert row["mean_speed_mps"] == summary.loc[arm, "mean_speed_mps"]


def test_page__cells_open_games_of_the_reports(league: Path) -> None:
    page = (league / "league.html").read_text(encoding="utf-8")
    assert page.count(f'href="red_light/report.html#game=naive_alone,{SEEDS[0]},') == 2  # in the matrix and in the list
    assert "3 of 3" in page


def test_files_for_ci__have_each_pairing(league: Path) -> None:
    result = json.loads((league / "result.json").read_text(encoding="utf-8"))
    assert (result["exit_code"], result["failed"], len(result["rows"])) == (0, [], len(rows(league)))
    junit = (league / "junit.xml").read_text(encoding="utf-8")
    assert f'tests="{len(rows(league))}"' in junit
    assert "brake fails in 3 of 3 games against nobody in red_light: 100" in junit


def test_table__the_same_ego_by_another_name_shares_the_rank(league: Path, tmp_path: Path) -> None:
    for name in ("brake", "twin"):
        shutil.copytree(league, tmp_path / name, ignore=shutil.ignore_patterns("traces", "replays", "tensorboard"))
    write_csv(read_csv(league / "league_games.csv").assign(ego="twin"), tmp_path / "twin" / "league_games.csv")
    done = CliRunner().invoke(app, ["league-table", str(tmp_path)])
    assert done.exit_code == 0, done.output
    ranks = read_csv(tmp_path / "league_ranks.csv")
    assert ranks["ego"].tolist() == ["brake", "twin"]
    assert ranks["rank"].tolist() == [1, 1]
    assert set(ranks["games"]) == {EPISODES * len(rows(league))}
    assert ranks["told_apart"].tolist() == ["", ""]


def test_table__one_league_is_no_table(league: Path) -> None:
    done = CliRunner().invoke(app, ["league-table", str(league.parent)])
    assert isinstance(done.exception, UsageError)
    assert "has fewer than two egos: out" in str(done.exception)
