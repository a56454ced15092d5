"""Tables and manoeuvres of games with several people."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from harness.evaluation.columns import TABLES
from harness.evaluation.comparisons.summary import summarise
from harness.evaluation.competence import goals_alone
from harness.evaluation.people import COLLIDED_WITH, columns_for, judged, judged_outcomes, people_in
from harness.evaluation.recorded_game import BodyKind
from harness.evaluation.rule_book.course import Course
from harness.evaluation.rule_book.named_manoeuvres import find_manoeuvres
from harness.evaluation.tables import read_csv, table_of, write_csv
from tests.support.scenes import LEFT_Y, RIGHT_Y, THREE_PEOPLE, build_scene
from tests.support.traces import drawn, game

PEOPLE = ("non_ego", "non_ego_2", "non_ego_3")


def games(*rows: dict[str, object], arm: str = "naive_vs_speedy") -> pd.DataFrame:
    whole = [{"arm": arm, "persona": "speedy", "seed": 1, "episode": k, **row} for k, row in enumerate(rows)]
    return table_of("episodes", whole, people=3)


@pytest.mark.parametrize("people", [2, 3, 4])
def test_columns__of_several_people_are_each_person_s(people: int) -> None:
    columns = columns_for(people, TABLES["episodes"])
    assert people_in(columns) == ("non_ego", "non_ego_2", "non_ego_3", "non_ego_4")[:people]
    own = [name for name in TABLES["episodes"] if name.startswith("non_ego_")]
    assert len(columns) == len(TABLES["episodes"]) + (people - 1) * len(own) + 1
    assert list(columns).index(COLLIDED_WITH) == list(columns).index("ego_failed") + 1


def test_table__of_several_people_is_read_as_it_was_written(tmp_path: Path) -> None:
    table = games({"ego_outcome": "collision", COLLIDED_WITH: "non_ego_2", "non_ego_2_outcome": "collision"})
    write_csv(table, tmp_path / "episodes.csv")
    pd.testing.assert_frame_equal(read_csv(tmp_path / "episodes.csv"), table)


def test_judged__is_the_ego_or_the_person_that_drives() -> None:
    table = games(
        {"ego_outcome": "goal", "non_ego_outcome": "rail"},
        {"non_ego_2_outcome": "rail"},
        {"non_ego_3_outcome": "goal"},
    )
    assert judged_outcomes(table).tolist() == ["goal", "rail", "goal"]
    assert [judged(row) for row in table.to_dict("records")] == [
        ("ego", "goal"),
        ("non_ego_2", "rail"),
        ("non_ego_3", "goal"),
    ]


def test_summary__is_over_the_people_of_all_games() -> None:
    both = {"ego_outcome": "goal", "ego_failed": 0}
    first = {f"{name}_outcome": outcome for name, outcome in zip(PEOPLE, ("goal", "goal", "rail"), strict=True)}
    speeds = {f"{name}_mean_speed_mps": speed for name, speed in zip(PEOPLE, (10.0, 11.0, 12.0), strict=True)}
    second = {f"{name}_outcome": "goal" for name in PEOPLE} | {f"{name}_mean_speed_mps": 15.0 for name in PEOPLE}
    (row,) = summarise(games({**both, **first, **speeds}, {**both, **second})).to_dict("records")
    assert row["non_ego_goal_rate"] == pytest.approx(5 / 6)
    assert np.isnan(row["non_ego_goal_rate_low"])  # goals in one game depend on each other
    assert row["non_ego_mean_speed_mps"] == pytest.approx((10 + 11 + 12 + 15 + 15 + 15) / 6)


def test_summary__people_one_at_a_time_have_an_interval() -> None:
    table = games(*({f"{name}_outcome": "goal"} for name in PEOPLE), arm="speedy_alone")
    (row,) = summarise(table).to_dict("records")
    assert row["non_ego_goal_rate"] == 1.0
    assert row["non_ego_goal_rate_low"] == pytest.approx(0.025 ** (1 / 3))
    found = goals_alone(table, "non_ego")
    assert (found.goals, found.played) == (3, 3)


def test_manoeuvres__name_the_person_and_before_which_player(tmp_path: Path) -> None:
    world = build_scene(tmp_path / "three", places=THREE_PEOPLE).world
    steps = range(30)
    ego = [40.0 + 1.2 * step for step in steps]
    trace = drawn(
        ego=(ego, 12.0, RIGHT_Y, {}),
        non_ego=([20.0 + 1.2 * step for step in steps], 12.0, LEFT_Y, {}),
        non_ego_2=([x_m + 9.0 for x_m in ego], 12.0, LEFT_Y, {}),
        non_ego_3=([x_m + 60.0 for x_m in ego], 12.0, LEFT_Y, {}),
    )
    moving = (trace["player"] == "non_ego_2") & (trace["step"] >= 10)
    trace.loc[moving, "y_m"] = np.maximum(LEFT_Y - 0.2 * (trace.loc[moving, "step"] - 9), RIGHT_Y)
    found = find_manoeuvres(Course(game=game(world, trace, {"ego_car": BodyKind(length_m=4.6)})))
    cut_ins = [(each["player"], each["text"]) for each in found if each["manoeuvre"] == "cut_in"]
    assert cut_ins == [("non_ego_2", "cuts in from the left, 4.4 m ahead of the ego")]
