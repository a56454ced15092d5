"""The script of docs/personas-on-the-merge.md: measures against values computed by hand, and its table of a run."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from harness.config.campaign import Campaign
from harness.config.toml_reading import read_document
from harness.evaluation.trace_file import SCHEMA, trace_writer
from harness.road.scene.open_scene import OpenScene
from tests.support.repository import REPOSITORY
from tests.support.scripts import script
from tests.support.traces import game

LANE_0_M, LANE_1_M = -4.8, -1.6  # lane 0 ends at x = 100, lane 1 goes on; cars are 4.6 m long

table = script("personas/table.py")


def trace(*rows: dict[str, Any], ego_x_m: float | None = None) -> pd.DataFrame:
    """A game with the given rows of the non-ego, and the ego at a constant place in lane 1 if `ego_x_m` is given."""
    usual = {"y_m": LANE_1_M, "heading_rad": 0.0, "speed_mps": 10.0, "acceleration_mps2": 0.0, "steering_rad": 0.0}
    usual |= {"lapsed": False, "outcome": "", "signals": "", "vehicle_type": "person_car", "player": "non_ego"}
    rows_of_game = []
    for step, row in enumerate(rows):
        of_step = {"episode": 0, "step": step, "time_s": 0.1 * step}
        if ego_x_m is not None:
            rows_of_game.append({**usual, "x_m": ego_x_m, "player": "ego", "vehicle_type": "ego_car", **of_step})
        rows_of_game.append({**usual, "x_m": 50.0 + step, **row, **of_step})
    return pd.DataFrame(rows_of_game)


def measured(name: str, scene: OpenScene, *traces: pd.DataFrame) -> float:
    return float(getattr(table, name)([table.PersonGame.of(game(scene.world, each).trace, scene) for each in traces]))


def write(file: Path, scene: OpenScene, trace: pd.DataFrame) -> None:
    """Write a file of traces with one game."""
    file.parent.mkdir(exist_ok=True)
    with trace_writer(file, SCHEMA) as add_trace:
        add_trace(game(scene.world, trace).trace.to_dict("list"))


def test_speed__is_the_mean_against_the_limit_while_it_drives(merge: OpenScene) -> None:
    faster = [{"speed_mps": 13.89 * share} for share in (1.0, 1.2, 1.4)]
    ended = [{"speed_mps": 13.89, "outcome": "rail"}, {"speed_mps": 0.0, "outcome": "rail"}]
    assert measured("speed_over_limit", merge, trace(*faster)) == pytest.approx(0.2)
    assert measured("speed_over_limit", merge, trace(*faster, *ended)) == pytest.approx(0.15)


def test_time_gap__is_the_median_over_the_steps_with_a_car_ahead(merge: OpenScene) -> None:
    # the ego's centre at 80 m: gaps of 30, 20, 10 m less 4.6 m, at 10 m/s; a car behind does not count
    rows = [{"x_m": x} for x in (50.0, 60.0, 70.0, 95.0)]
    assert measured("time_gap_s", merge, trace(*rows, ego_x_m=80.0)) == pytest.approx(1.54)


def test_reaction__is_the_time_to_the_first_movement_by_the_driver(merge: OpenScene) -> None:
    at_once = trace({}, {"acceleration_mps2": -1.0}, {})
    drifting = {"steering_rad": -0.01, "lapsed": True}
    late = trace({}, drifting, drifting, {}, {"steering_rad": 0.02}, {})  # in its fourth step
    assert measured("reaction_s", merge, at_once) == 0.0
    assert measured("reaction_s", merge, at_once, late) == pytest.approx(0.15)


def test_lapse__is_the_mean_of_complete_lapses(merge: OpenScene) -> None:
    def game(lapses: str) -> pd.DataFrame:
        return trace(*({"lapsed": each == "x"} for each in lapses))

    # the first game starts within one and ends within another; the row of its start is before any decision
    assert measured("lapse_s", merge, game(".xx..xxx..x.."), game("....xxxxx..xx")) == pytest.approx(0.3)
    assert np.isnan(measured("lapse_s", merge, game(".....")))


def test_lane_left__is_the_rest_of_the_lane_at_the_crossing_of_the_line(merge: OpenScene) -> None:
    def crossing(at_m: float) -> pd.DataFrame:
        places = [(at_m - 20.0, LANE_0_M), (at_m - 1.0, -3.3), (at_m, -3.1), (at_m + 9.0, LANE_1_M)]
        return trace(*({"x_m": x, "y_m": y} for x, y in places))

    assert measured("lane_left_m", merge, crossing(70.0)) == pytest.approx(30.0, abs=0.3)
    assert measured("lane_left_m", merge, crossing(108.0)) == pytest.approx(-8.0, abs=0.3)
    median = measured("lane_left_m", merge, crossing(70.0), crossing(80.0), crossing(99.0))
    assert median == pytest.approx(20.0, abs=0.3)
    assert np.isnan(measured("lane_left_m", merge, trace({"y_m": LANE_1_M}, {"y_m": LANE_1_M})))  # the lane goes on


def test_lateral_deviation__is_over_all_games_beyond_the_taper(merge: OpenScene) -> None:
    def game(*sides: float) -> pd.DataFrame:
        there = [{"x_m": 140.0 + k, "y_m": LANE_1_M + side} for k, side in enumerate(sides)]
        return trace({"x_m": 60.0, "y_m": LANE_0_M}, {"x_m": 110.0, "y_m": -3.0}, *there)

    assert measured("lateral_deviation_m", merge, game(0.1, 0.1), game(-0.3, -0.3)) == pytest.approx(0.2, abs=0.01)


# --- the table --------------------------------------------------------------------------------------------------------


def episode(arm: str, persona: str, failed: Any, speed: float = 10.0, non_ego: str = "goal") -> dict[str, Any]:
    return {"arm": arm, "persona": persona, "seed": 1, "ego_failed": failed, "ego_mean_speed_mps": speed} | {
        "non_ego_outcome": non_ego,
        "error": None,
    }


@pytest.fixture
def run(tmp_path: Path, merge: OpenScene) -> Path:
    """A run folder with a tailgater and a persona without a characteristic against four egos."""
    shutil.copytree(merge.folder, tmp_path / "scene")
    close = trace({"x_m": 60.0}, {"x_m": 60.0}, ego_x_m=70.0)
    write(tmp_path / "traces" / "naive_vs_tailgater-seed1.parquet", merge, close)
    games = [
        episode("naive_alone", None, False),
        *(episode("tailgater_alone", "tailgater", None, np.nan, end) for end in ("goal", "rail", "goal", "goal")),
        episode("naive_vs_tailgater", "tailgater", True),
        episode("naive_vs_tailgater", "tailgater", False, 12.0),
        {**episode("naive_vs_tailgater", "tailgater", None, np.nan, "error"), "error": "the simulator died"},
        episode("adas_vs_tailgater", "tailgater", True, 5.0),
        episode("retrained_vs_tailgater", "tailgater", False, 9.0),
        episode("retrained_anna_vs_tailgater", "tailgater", True, 1.0),  # cross-play is not in the table
        episode("naive_vs_anna", "anna", False),
    ]
    other_seed = {**episode("naive_vs_tailgater", "tailgater", True), "seed": 2}
    pd.DataFrame([*games, other_seed]).to_csv(tmp_path / "episodes.csv", index=False)
    curve = [("tailgater", payoff) for payoff in (-10.0, 0.0, 3.0, 4.0, 5.0)] + [("retrained_tailgater", 99.0)]
    training = pd.DataFrame([{"stage": stage, "seed": 1, "mean_payoff": payoff} for stage, payoff in curve])
    training.to_csv(tmp_path / "training.csv", index=False)
    return tmp_path


def test_rows__have_the_results_of_the_run(run: Path) -> None:
    tailgater, anna = table.rows(table.Run.read(run, 1))
    assert tailgater == {
        "persona": "tailgater",
        "payoff in training": "-10.0 → 4.0",
        "characteristic": "median time gap behind the naive ego",
        "value": "0.54 s",  # 10 m less 4.6 m, at 10 m/s
        "as expected": "yes",
        "people": table.CHARACTERISTICS["tailgater"].people,
        "fails alone": "25%",
        "naive ego": "50%, 11.00 m/s",
        "adas": "100%, 5.00 m/s",
        "retrained ego": "0%, 9.00 m/s",
    }
    assert [name for name, cell in anna.items() if cell] == ["persona", "naive ego"]


@pytest.mark.parametrize("with_careful", [True, False])
def test_value__needs_the_baseline(with_careful: bool, tmp_path: Path, merge: OpenScene) -> None:
    shutil.copytree(merge.folder, tmp_path / "scene")
    people = {"impaired": 0.2, "careful": 0.05} if with_careful else {"impaired": 0.2}
    for persona, side_m in people.items():  # alternately left and right: the standard deviation is side_m
        places = [{"x_m": 140.0 + k, "y_m": LANE_1_M + side_m * (-1) ** k} for k in range(6)]
        write(tmp_path / "traces" / f"{persona}_alone-seed1.parquet", merge, trace(*places))
    games = [episode(f"{persona}_alone", persona, None) for persona in people]
    training = pd.DataFrame({"stage": [], "mean_payoff": []})
    run = table.Run(folder=tmp_path, seed=1, episodes=pd.DataFrame(games), training=training, scene=merge)
    value = run.value(table.CHARACTERISTICS["impaired"], "impaired")
    assert value == pytest.approx(0.15 if with_careful else np.nan, abs=0.01, nan_ok=True)


def test_main__prints_markdown_and_writes_the_same_as_csv(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table.main(run, 1, run / "table.csv")
    printed = [line.strip("| ").split(" | ") for line in capsys.readouterr().out.splitlines()]
    written = pd.read_csv(run / "table.csv", dtype=str)
    assert printed[0] == list(written.columns)
    assert printed[2][:4] == written.iloc[0, :4].tolist()


# --- the personas -----------------------------------------------------------------------------------------------------


def test_characteristics__every_persona_of_the_campaign_has_one() -> None:
    campaign = read_document(REPOSITORY / "campaigns" / "merge-personas.toml", Campaign)
    names = {Path(file).stem for file in campaign.personas}
    assert names == set(table.CHARACTERISTICS)
    assert names <= {each.stem for each in (REPOSITORY / "personas").glob("*.toml")}
    assert campaign.training == read_document(REPOSITORY / "campaigns" / "merge.toml", Campaign).training
