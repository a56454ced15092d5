"""Whole campaigns through the real command, on the real SUMO: every file is there, and the numbers are right."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from markupsafe import escape

from harness.drivers.policy_file import read_policy
from harness.evaluation.columns import TABLES
from harness.evaluation.comparisons.comparison import compare
from harness.evaluation.comparisons.summary import summarise
from harness.evaluation.competence import Question
from harness.evaluation.tables import read_csv
from harness.evaluation.trace_file import TraceReader
from harness.evaluation.worst_first import replay_name
from harness.road.scene.open_scene import open_scene
from tests.support.replays import assert_plays
from tests.support.tiny import (
    BY_SUMO,
    CAREFUL,
    carried_out,
    files_in,
    learned_run,
    sumo_run,
    write_campaign,
)

ARMS = ("naive_alone", "naive_vs_sumo", "speedy_alone", "naive_vs_speedy", "retrained_vs_speedy")
ARMS += ("retrained_alone_speedy",)
TRAININGS = ("naive", "speedy", "retrained_speedy")


@pytest.fixture(scope="session")
def run() -> Path:
    return learned_run()


@pytest.fixture(scope="session")
def episodes(run: Path) -> pd.DataFrame:
    return read_csv(run / "episodes.csv")


def names_in(folder: Path) -> set[str]:
    return {each.name for each in folder.iterdir()}


# --- what is there ----------------------------------------------------------------------------------------------------


def test_campaign__every_file_is_there(run: Path) -> None:
    names = (
        "training",
        "episodes",
        "summary",
        "comparisons",
        "causes",
        "manoeuvres",
        "conduct",
        "realism",
        "undecided",
    )
    tables = [f"{name}.csv" for name in names]
    folders = ("policies", "traces", "replays", "scene", "tensorboard")
    others = ("manifest.json", "result.json", "junit.xml", "report.html", "harness.log")
    assert {name for name in names_in(run) if not name.startswith(".")} == {*tables, *folders, *others}
    assert names_in(run / "policies") == names_in(run / "tensorboard") == {f"{name}-seed1" for name in TRAININGS}
    assert names_in(run / "traces") == {f"{name}-seed1.parquet" for name in ARMS}
    assert names_in(run / "scene") == {"scene.toml", "paper_merge.net.xml", "paper_merge.rou.xml"}
    for policy in (run / "policies").iterdir():
        assert names_in(policy) == {"policy.safetensors", "policy.json", "README.md"}
        assert read_policy(policy).card["stage"] == policy.name
    for table in ("episodes", "summary", "comparisons", "training"):
        columns = [name for name, column in TABLES[table].items() if not column.optional]
        assert (run / f"{table}.csv").read_text().splitlines()[0] == ",".join(columns)
        assert len(read_csv(run / f"{table}.csv")) > 0


def test_campaign__episodes_are_all_there(episodes: pd.DataFrame) -> None:
    games = zip(episodes["arm"], episodes["episode"], strict=True)
    assert sorted(games) == sorted((arm, k) for arm in ARMS for k in range(4))
    assert set(episodes["ego_outcome"]) <= {"goal", "collision", "rail", "timeout", ""}
    assert (episodes["error"] == "").all()
    alone = episodes["arm"].isin(["naive_alone", "retrained_alone_speedy"])
    assert ((episodes["non_ego_outcome"] == "") == alone).all()
    no_ego = episodes["arm"] == "speedy_alone"
    assert episodes.loc[no_ego, "ego_failed"].isna().all()
    assert (episodes.loc[~no_ego, "ego_failed"] == (episodes.loc[~no_ego, "ego_outcome"] != "goal")).all()


def test_campaign__manifest_and_training_table_say_what_was_done(run: Path) -> None:
    manifest = json.loads((run / "manifest.json").read_text())
    assert (manifest["format"], manifest["name"], manifest["quick"]) == (1, "learned", False)
    assert set(manifest["stages"]) == {f"{name}-seed1" for name in (*ARMS, *TRAININGS)}
    assert all(stage["status"] == "done" and stage["seconds"] >= 0 for stage in manifest["stages"].values())
    naive = manifest["stages"]["naive-seed1"]
    assert (naive["steps"], naive["budget_steps"], naive["stopped"]) == (2048, 2048, "budget")
    assert "segments" in naive["rule"]
    assert {"harness", "libsumo", "torch", "numpy"} <= set(manifest["versions"])
    assert manifest["campaign"]["training"]["steps"] == 2048
    assert {"learned.toml", "speedy.toml", "paper_merge.net.xml"} <= {Path(name).name for name in manifest["hashes"]}
    curves = read_csv(run / "training.csv").groupby(["stage", "persona"])["steps"].agg(list).to_dict()
    trainings = [("naive", ""), ("speedy", "speedy"), ("retrained_speedy", "speedy")]
    assert curves == {each: [1024, 2048] for each in trainings}


# --- the numbers ------------------------------------------------------------------------------------------------------


def test_campaign__its_tables_are_made_of_its_episodes_and_the_report_shows_them(
    run: Path, episodes: pd.DataFrame
) -> None:
    """What is made of episodes is checked by hand and by SciPy in tests/evaluation."""
    pd.testing.assert_frame_equal(read_csv(run / "summary.csv"), summarise(episodes), check_exact=True)
    asked = [
        Question(question="RQ1", persona="speedy", seed=1, baseline="naive_alone", treatment="naive_vs_speedy"),
        Question(question="RQ2", persona="speedy", seed=1, baseline="naive_vs_speedy", treatment="retrained_vs_speedy"),
    ]
    comparisons = read_csv(run / "comparisons.csv")
    pd.testing.assert_frame_equal(comparisons, compare(asked, episodes, 0.01), check_exact=True)
    needs_traffic = comparisons["metric"].isin(["bystander_failure", "follower_braking"])  # this road has two cars
    assert comparisons["pairs"].tolist() == np.where(needs_traffic, 0, 4).tolist()
    page = (run / "report.html").read_text(encoding="utf-8")
    assert all(escape(verdict.split(":")[0]) in page for verdict in comparisons["verdict"])


# --- replays ----------------------------------------------------------------------------------------------------------


def test_campaign__every_failed_game_has_a_replay(run: Path, episodes: pd.DataFrame) -> None:
    outcome = episodes["ego_outcome"].where(episodes["ego_outcome"] != "", episodes["non_ego_outcome"])
    failed = episodes[outcome.isin(["collision", "rail", "timeout"])]
    names = names_in(run / "replays")
    assert {replay_name(game.arm, game.seed, game.episode) for game in failed.itertuples()} <= names
    assert all((run / "replays" / name / "scene.sumocfg").is_file() for name in names)


def test_campaign__sumo_plays_a_replay_as_it_was_recorded(run: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(run / "replays" / replay_name("naive_vs_speedy", 1, 1), tmp_path / "replay")
    trace, scene = TraceReader().read(run / "traces" / "naive_vs_speedy-seed1.parquet", 1), open_scene(run / "scene")
    types = [scene.vehicle(player).vehicle_type for player in range(2)]
    assert_plays(folder, trace, dict(zip(types, scene.world.length_m, strict=True)))


# --- again, and with changes ------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_campaign__running_again_skips_everything(run: Path, tmp_path: Path) -> None:
    again = shutil.copytree(run, tmp_path / "run")
    before = files_in(again)
    assert "started" not in carried_out(run.with_suffix(".toml"), again)
    assert files_in(again) == before


@pytest.mark.slow
def test_campaign__more_episodes_keep_the_trainings_and_the_games_that_were_played(tmp_path: Path) -> None:
    again = shutil.copytree(sumo_run(), tmp_path / "run")
    more = {**BY_SUMO, "assessment": {"episodes": 3}}
    assert "started  speedy-seed1" not in carried_out(write_campaign(tmp_path, **more), again)
    before, after = (read_csv(folder / "episodes.csv") for folder in (sumo_run(), again))
    pd.testing.assert_frame_equal(after[after["episode"] < 2].reset_index(drop=True), before)


@pytest.mark.slow
def test_campaign__an_ego_that_is_a_policy_drives_as_where_it_was_trained(
    run: Path, episodes: pd.DataFrame, tmp_path: Path
) -> None:
    shutil.copytree(run / "policies" / "naive-seed1", tmp_path / "ego")
    changes: dict[str, Any] = {
        "name": "given",
        "ego": {"driver": "ego", "persona": str(CAREFUL)},
        "training": None,
        "policies": str(run / "policies"),
    }
    carried_out(write_campaign(tmp_path, **changes), tmp_path / "run")
    trained = episodes[episodes["arm"].isin(ARMS[:4])].reset_index(drop=True)
    pd.testing.assert_frame_equal(read_csv(tmp_path / "run" / "episodes.csv"), trained)
    assert set(read_csv(tmp_path / "run" / "comparisons.csv")["question"]) == {"RQ1"}
