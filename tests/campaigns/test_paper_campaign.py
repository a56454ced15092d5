"""Whole campaigns through the real command, on the real SUMO: every file is there, and the numbers are right."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import platformdirs
import pytest
import sumo
from defusedxml import ElementTree
from markupsafe import escape
from scipy import stats

from harness.drivers.policy_file import read_policy
from harness.evaluation.columns import TABLES
from harness.evaluation.comparisons.comparison import compare
from harness.evaluation.research_questions import Question
from harness.evaluation.tables import read_csv
from harness.evaluation.trace_file import read_trace
from harness.replay import replay_name
from harness.road.scene.open_scene import open_scene
from tests.support.tiny import (
    BY_SUMO,
    CAREFUL,
    PATIENCE_S,
    SPEEDY,
    files_in,
    harness,
    learned_run,
    sumo_run,
    tables,
    write_campaign,
    write_persona,
)

pytestmark = pytest.mark.slow

ARMS = ("naive_alone", "naive_vs_sumo", "speedy_alone", "naive_vs_speedy", "retrained_vs_speedy")
ARMS += ("retrained_alone_speedy",)
TRAININGS = ("naive", "speedy", "retrained_speedy")


@pytest.fixture(scope="session")
def run() -> Path:
    return learned_run()


@pytest.fixture(scope="session")
def episodes(run: Path) -> pd.DataFrame:
    return pd.read_csv(run / "episodes.csv", keep_default_na=False, na_values={"ego_failed": [""]})


def number(frame: pd.DataFrame, column: str) -> pd.Series:
    return pd.to_numeric(frame[column], errors="coerce")


# --- what is there ----------------------------------------------------------------------------------------------------


def test_campaign__every_file_is_there(run: Path) -> None:
    assert {each.name for each in run.iterdir() if not each.name.startswith(".")} == {
        *("manifest.json", "policies", "training.csv", "episodes.csv", "summary.csv", "comparisons.csv"),
        *(
            "causes.csv",
            "result.json",
            "junit.xml",
            "manoeuvres.csv",
            "traces",
            "replays",
            "report.html",
            "scene",
            "tensorboard",
            "harness.log",
        ),
    }
    assert {each.name for each in (run / "policies").iterdir()} == {f"{name}-seed1" for name in TRAININGS}
    assert {each.name for each in (run / "tensorboard").iterdir()} == {f"{name}-seed1" for name in TRAININGS}
    assert {each.name for each in (run / "traces").iterdir()} == {f"{name}-seed1.parquet" for name in ARMS}
    assert {each.name for each in (run / "scene").iterdir()} == {"scene.toml", "merge.net.xml", "merge.rou.xml"}
    assert "<html" in (run / "report.html").read_text(encoding="utf-8")
    for policy in (run / "policies").iterdir():
        assert {each.name for each in policy.iterdir()} == {"policy.safetensors", "policy.json", "README.md"}
        assert read_policy(policy).card["stage"] == policy.name


@pytest.mark.parametrize(
    ("table", "columns"),
    [
        ("episodes", TABLES["episodes"]),
        ("summary", TABLES["summary"]),
        ("comparisons", TABLES["comparisons"]),
        ("training", TABLES["training"]),
    ],
)
def test_campaign__tables_have_their_columns(table: str, columns: dict[str, str], run: Path) -> None:
    assert (run / f"{table}.csv").read_text().splitlines()[0] == ",".join(columns)
    assert len(read_csv(run / f"{table}.csv")) > 0


def test_campaign__episodes_are_all_there(episodes: pd.DataFrame) -> None:
    assert [(arm, k) for arm in ARMS for k in range(4)] == sorted(
        zip(episodes["arm"], episodes["episode"], strict=True), key=lambda row: (ARMS.index(row[0]), row[1])
    )
    assert set(episodes["ego_outcome"]) <= {"goal", "collision", "rail", "timeout", ""}
    assert (episodes["error"] == "").all()
    alone = episodes["arm"].isin(["naive_alone", "retrained_alone_speedy"])
    assert (episodes.loc[alone, "non_ego_outcome"] == "").all()
    assert (episodes.loc[~alone, "non_ego_outcome"] != "").all()
    no_ego = episodes["arm"] == "speedy_alone"
    assert episodes.loc[no_ego, "ego_failed"].isna().all()
    assert (episodes.loc[~no_ego, "ego_failed"] == (episodes.loc[~no_ego, "ego_outcome"] != "goal")).all()


def test_campaign__the_manifest_says_what_was_done(run: Path) -> None:
    manifest = json.loads((run / "manifest.json").read_text())
    assert (manifest["format"], manifest["name"], manifest["quick"]) == (1, "learned", False)
    assert set(manifest["stages"]) == {f"{name}-seed1" for name in (*ARMS, *TRAININGS)}
    assert all(stage["status"] == "done" and stage["seconds"] >= 0 for stage in manifest["stages"].values())
    naive = manifest["stages"]["naive-seed1"]
    assert (naive["steps"], naive["budget_steps"], naive["stopped"]) == (2048, 2048, "budget")
    assert "segments" in naive["rule"]
    assert {"harness", "libsumo", "torch", "numpy"} <= set(manifest["versions"])
    assert manifest["campaign"]["training"]["steps"] == 2048
    assert {"learned.toml", "speedy.toml", "merge.net.xml"} <= {Path(name).name for name in manifest["hashes"]}


def test_campaign__learning_curves_are_in_the_training_table(run: Path) -> None:
    training = read_csv(run / "training.csv")
    curves = {
        (stage, persona): rows["steps"].tolist() for (stage, persona), rows in training.groupby(["stage", "persona"])
    }
    assert curves == {
        ("naive", ""): [1024, 2048],
        ("speedy", "speedy"): [1024, 2048],
        ("retrained_speedy", "speedy"): [1024, 2048],
    }


# --- the numbers ------------------------------------------------------------------------------------------------------


def test_campaign__summary_is_what_pandas_and_scipy_make_of_the_episodes(run: Path, episodes: pd.DataFrame) -> None:
    summary = pd.read_csv(run / "summary.csv").set_index("arm")
    assert set(summary.index) == set(ARMS)
    for arm, games in episodes.groupby("arm"):
        row, failed, speed = (
            summary.loc[arm],
            games["ego_failed"].dropna(),
            number(games, "ego_mean_speed_mps").dropna(),
        )
        assert (row["episodes"], row["errors"]) == (4, 0)
        if len(failed):
            k, n = int(failed.sum()), len(failed)
            low = stats.beta.ppf(0.025, k, n - k + 1) if k else 0.0
            high = stats.beta.ppf(0.975, k + 1, n - k) if k < n else 1.0
            expected = [k / n, low, high]
            assert row[["failure_rate", "failure_rate_low", "failure_rate_high"]].tolist() == pytest.approx(expected)
            for outcome in ("collision", "rail", "timeout"):
                assert row[f"{outcome}s"] == (games["ego_outcome"] == outcome).sum()
            half = stats.t.ppf(0.975, len(speed) - 1) * stats.sem(speed)
            expected = [speed.mean(), speed.mean() - half, speed.mean() + half]
            assert row[["mean_speed_mps", "mean_speed_low_mps", "mean_speed_high_mps"]].tolist() == pytest.approx(
                expected
            )
        else:
            assert row[["failure_rate", "mean_speed_mps", "collisions"]].isna().all()
        for column in ("min_ttc_s", "trailing_distance_m", "max_deceleration_mps2"):
            assert row[column] == pytest.approx(number(games, f"ego_{column}").mean(), nan_ok=True)


DIRECTION = {("RQ1", "failure"): 1, ("RQ1", "mean_speed"): -1, ("RQ2", "failure"): -1, ("RQ2", "mean_speed"): 1}


def test_campaign__comparisons_are_what_pandas_and_scipy_make_of_the_episodes(
    run: Path, episodes: pd.DataFrame
) -> None:
    comparisons = pd.read_csv(run / "comparisons.csv")
    assert list(zip(comparisons["question"], comparisons["metric"], strict=True)) == list(DIRECTION)
    for row in comparisons.to_dict("records"):
        arms = (
            ("naive_alone", "naive_vs_speedy")
            if row["question"] == "RQ1"
            else ("naive_vs_speedy", "retrained_vs_speedy")
        )
        column = {"failure": "ego_failed", "mean_speed": "ego_mean_speed_mps"}[row["metric"]]
        before, after = (
            number(episodes[episodes["arm"] == arm].set_index("episode"), column).astype(float) for arm in arms
        )
        differences = DIRECTION[row["question"], row["metric"]] * (after - before)
        assert (row["pairs"], row["pairs_left_out"]) == (4, 0)
        assert row["mean_difference"] == pytest.approx(differences.mean())
        if differences.nunique() > 1:
            test = stats.ttest_1samp(differences, 0.0, alternative="greater")
            assert (row["t"], row["p_value"]) == pytest.approx((test.statistic, test.pvalue))
            assert row["effect_size"] == pytest.approx(differences.mean() / differences.std())
            assert row["rejects_h0"] == (test.pvalue < 0.01)
        else:
            assert np.isnan(row["p_value"])
            assert not row["rejects_h0"]


@pytest.mark.parametrize("arm", [arm for arm in ARMS if arm != "speedy_alone"])
def test_campaign__an_arm_against_itself_rejects_nothing(arm: str, run: Path) -> None:
    asked = [
        Question(question=question, persona="", seed=1, baseline=arm, treatment=arm) for question in ("RQ1", "RQ2")
    ]
    compared = compare(asked, read_csv(run / "episodes.csv"), 0.01)
    assert not compared["rejects_h0"].any()
    assert set(compared["verdict"]) == {"no difference"}


def test_campaign__the_report_shows_the_numbers_of_the_tables(run: Path) -> None:
    page = (run / "report.html").read_text(encoding="utf-8")
    for verdict in pd.read_csv(run / "comparisons.csv")["verdict"]:
        assert escape(verdict.split(":")[0]) in page


# --- replays ----------------------------------------------------------------------------------------------------------


def test_campaign__every_failed_game_has_a_replay(run: Path) -> None:
    episodes = read_csv(run / "episodes.csv")
    outcome = episodes["ego_outcome"].where(episodes["ego_outcome"] != "", episodes["non_ego_outcome"])
    failed = episodes[outcome.isin(["collision", "rail", "timeout"])]
    names = {each.name for each in (run / "replays").iterdir()}
    assert {replay_name(game.arm, game.seed, game.episode) for game in failed.itertuples()} <= names
    assert all((run / "replays" / name / "scene.sumocfg").is_file() for name in names)


@pytest.mark.parametrize("arm", ["naive_vs_sumo", "naive_vs_speedy"])
def test_campaign__sumo_plays_a_replay_as_it_was_recorded(arm: str, run: Path, tmp_path: Path) -> None:
    episode = 1
    folder = shutil.copytree(run / "replays" / replay_name(arm, 1, episode), tmp_path / "replay")
    command = [Path(sumo.SUMO_HOME) / "bin" / "sumo", "-c", folder / "scene.sumocfg", "--precision", "6"]
    command += ["--fcd-output", tmp_path / "played.xml", "--fcd-output.attributes", "id,x,y,angle,speed"]
    environment = {**os.environ, "SUMO_HOME": sumo.SUMO_HOME}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    assert done.returncode == 0, done.stderr

    scene = open_scene(run / "scene")
    length_m = {"ego": scene.world.length_m[0], "non_ego": scene.world.length_m[1]}
    played = pd.DataFrame(
        {
            "player": car.get("id"),
            "step": round(float(step.get("time")) / 0.1) - 1,
            "x": car.get("x"),
            "y": car.get("y"),
        }
        for step in ElementTree.parse(tmp_path / "played.xml").getroot()
        for car in step
    ).astype({"x": float, "y": float})
    played = played[played["step"] >= 0]  # the step before is SUMO putting them there
    recorded = read_trace(run / "traces" / f"{arm}-seed1.parquet", episode)
    last = recorded["step"].max()
    (shown, held) = (played[played["step"] == step].set_index("player").sort_index() for step in (last, last + 1))
    pd.testing.assert_frame_equal(held[["x", "y"]], shown[["x", "y"]])  # the last picture stays for one more step
    both = recorded.merge(played[played["step"] <= last], on=["player", "step"], how="outer", indicator=True)
    assert (both["_merge"] == "both").all()
    half = 0.5 * both["player"].map(length_m)
    assert np.abs(both["x"] - (both["x_m"] + half * np.cos(both["heading_rad"]))).max() <= 1e-3
    assert np.abs(both["y"] - (both["y_m"] + half * np.sin(both["heading_rad"]))).max() <= 1e-3


# --- again and elsewhere ----------------------------------------------------------------------------------------------


def test_campaign__is_the_same_with_one_worker_from_elsewhere_and_writes_nowhere_else(
    run: Path, tmp_path: Path
) -> None:
    folders = {name: tmp_path / name for name in ("cwd", "home", "tmp", "out")}
    for folder in folders.values():
        folder.mkdir()
    compiled = folders["home"] / "cache" / "harness" / "compiled"  # machine code as on any machine after its first run
    compiled.parent.mkdir(parents=True)
    compiled.symlink_to(Path(platformdirs.user_cache_dir("harness")) / "compiled")
    environment = {
        **os.environ,
        "HOME": str(folders["home"]),
        "XDG_CACHE_HOME": str(folders["home"] / "cache"),
        "TMPDIR": str(folders["tmp"]),
    }
    again = folders["out"] / "again"
    campaign = write_campaign(folders["out"] / "campaign", name="learned")
    done = harness("campaign", campaign, "--out", again, "--jobs", 1, cwd=folders["cwd"], env=environment)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stderr == ""
    assert tables(again) == tables(run)
    for policy in TRAININGS:
        for name in ("policy.safetensors", "policy.json", "README.md"):
            file = Path("policies") / f"{policy}-seed1" / name
            assert (again / file).read_bytes() == (run / file).read_bytes()
    assert list(folders["cwd"].iterdir()) == []
    left = {each.name for each in folders["tmp"].iterdir() if not each.name.startswith("torchinductor")}  # torch's
    assert left == set()
    assert {each.name for each in folders["home"].iterdir()} <= {"cache", ".config"}  # .config: matplotlib
    assert {each.name for each in folders["out"].iterdir()} == {"campaign", "again"}


def test_campaign__running_again_skips_everything(run: Path, tmp_path: Path) -> None:
    again = shutil.copytree(run, tmp_path / "run")
    before = files_in(again)
    done = harness("campaign", run.with_suffix(".toml"), "--out", again)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "started" not in done.stdout
    assert files_in(again) == before


def test_campaign__more_episodes_keep_the_trainings_and_the_games_that_were_played(tmp_path: Path) -> None:
    again = shutil.copytree(sumo_run(), tmp_path / "run")
    more = {**BY_SUMO, "assessment": {"episodes": 3}}
    done = harness("campaign", write_campaign(tmp_path, **more), "--out", again, "--jobs", 1)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "speedy-seed1" not in [line.split()[1] for line in done.stdout.splitlines() if line.startswith("started")]
    before, after = (read_csv(folder / "episodes.csv") for folder in (sumo_run(), again))
    pd.testing.assert_frame_equal(after[after["episode"] < 2].reset_index(drop=True), before)


# --- other egos, other personas ---------------------------------------------------------------------------------------


def rows_of(run: Path, *personas: str) -> pd.DataFrame:
    episodes = read_csv(run / "episodes.csv")
    return episodes[episodes["persona"].isin(["", *personas])].reset_index(drop=True)


def test_campaign__another_persona_needs_no_python_and_changes_no_row_of_the_others(tmp_path: Path) -> None:
    personas = [str(write_persona(tmp_path, "x")), str(SPEEDY)]
    changes: dict[str, Any] = {**BY_SUMO, "personas": personas}
    done = harness("campaign", write_campaign(tmp_path, **changes), "--out", tmp_path / "run", "--jobs", 1)
    assert done.returncode == 0, done.stdout + done.stderr
    pd.testing.assert_frame_equal(rows_of(tmp_path / "run", "speedy"), rows_of(sumo_run(), "speedy"))
    assert set(rows_of(tmp_path / "run", "x")["arm"]) == {"naive_alone", "naive_vs_sumo", "x_alone", "naive_vs_x"}
    assert "not for conclusions" not in (tmp_path / "run" / "report.html").read_text()


def test_campaign__an_ego_left_to_sumo_is_not_retrained() -> None:
    run = sumo_run()
    assert set(read_csv(run / "comparisons.csv")["question"]) == {"RQ1"}
    assert {each.name for each in (run / "policies").iterdir()} == {"speedy-seed1"}
    episodes = read_csv(run / "episodes.csv")
    assert set(episodes["arm"]) == {"naive_alone", "naive_vs_sumo", "speedy_alone", "naive_vs_speedy"}
    assert (episodes.loc[episodes["arm"] == "naive_alone", "ego_outcome"] == "goal").all()


def test_campaign__an_ego_that_is_a_policy_drives_as_where_it_was_trained(run: Path, tmp_path: Path) -> None:
    shutil.copytree(run / "policies" / "naive-seed1", tmp_path / "ego")
    changes: dict[str, Any] = {
        "name": "given",
        "ego": {"driver": "ego", "persona": str(CAREFUL)},
        "personas": [str(write_persona(tmp_path, "x"))],
    }
    done = harness("campaign", write_campaign(tmp_path, **changes), "--out", tmp_path / "run", "--quick", "--jobs", 1)
    assert done.returncode == 0, done.stdout + done.stderr
    given, trained = (read_csv(each / "episodes.csv") for each in (tmp_path / "run", run))
    for arm in ("naive_alone", "naive_vs_sumo"):
        one, other = (each[each["arm"] == arm].reset_index(drop=True) for each in (given, trained))
        pd.testing.assert_frame_equal(one, other)
    assert set(read_csv(tmp_path / "run" / "comparisons.csv")["question"]) == {"RQ1"}
    assert "not for conclusions" in (tmp_path / "run" / "report.html").read_text()
