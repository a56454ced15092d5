"""How players drive in made-up games on networks/merge, compared with values computed by hand."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from harness.evaluation.columns import TABLES
from harness.evaluation.measured_game import METRICS_OF_CONDUCT, conduct_of
from harness.game.arrays import FloatArray
from harness.road.scene.open_scene import OpenScene, open_scene
from tests.support.traces import game, rows

STEPS, STEP_S = 60, 0.1
ENDING_Y, THROUGH_Y = -4.8, -1.6  # lanes of the merge
LIMIT_MPS = 13.89


def car(
    name: str,
    x_m: float = 20.0,
    y_m: FloatArray | float = THROUGH_Y,
    speed_mps: FloatArray | float = 12.0,
    steps: int = STEPS,
) -> pd.DataFrame:
    """A car that drives for six seconds from a place, straight ahead but for `y_m` in each step."""
    speed, y = (np.broadcast_to(np.asarray(each, dtype=float), steps) for each in (speed_mps, y_m))
    x = x_m + np.concatenate(([0.0], np.cumsum(speed[1:]) * STEP_S))
    return pd.DataFrame(rows(name, list(zip(x, y, np.zeros(steps), speed, strict=True))))


def conduct(scene: OpenScene, *cars: pd.DataFrame, player: str = "ego", **cells: Any) -> dict[str, Any]:
    """The row of a player; `cells` replace columns of its trace."""
    found = conduct_of(game(scene.world, pd.concat([cars[0].assign(**cells), *cars[1:]], ignore_index=True)))
    return {row["player"]: row for row in found}[player]


def test_conduct__has_a_row_for_each_player_with_every_metric(merge: OpenScene) -> None:
    played = game(merge.world, pd.concat([car("ego"), car("non_ego", y_m=ENDING_Y)], ignore_index=True))
    found = conduct_of(played)
    assert [row["player"] for row in found] == ["ego", "non_ego"]
    assert all({"player", "outcome", *(each.column.name for each in METRICS_OF_CONDUCT)} == set(row) for row in found)
    assert set(found[0]) < set(TABLES["conduct"])


def test_steady_driving__by_hand(merge: OpenScene) -> None:
    row = conduct(merge, car("ego"))
    assert row["distance_m"] == pytest.approx(12.0 * 59 * STEP_S, abs=0.5)
    assert row["moving_speed_mps"] == pytest.approx(12.0)
    assert row["free_over_limit_mps"] == pytest.approx(12.0 - LIMIT_MPS)
    assert (row["max_jerk_mps3"], row["steering_reversals_per_s"], row["looks_away_share"]) == (0.0, 0.0, 0.0)
    assert row["lateral_wander_m"] == pytest.approx(0.0, abs=1e-6)
    assert all(row[name] is None for name in ("lane_change_s", "following_gap_s", "longest_lapse_s", "accepted_gap_s"))


def test_moving_speed__is_that_of_the_steps_in_which_it_does_not_stand(merge: OpenScene) -> None:
    waits = np.where(np.arange(STEPS) < 30, 0.0, 1.2)
    assert conduct(merge, car("ego", speed_mps=waits))["moving_speed_mps"] == pytest.approx(1.2)
    assert conduct(merge, car("ego", speed_mps=0.0))["moving_speed_mps"] is None


def test_lane_change__lasts_from_5_to_95_percent_of_the_way(merge: OpenScene) -> None:
    y = np.interp(np.arange(STEPS), [10, 40], [ENDING_Y, THROUGH_Y])  # 3.3 % a step: on its way from step 11 to 39
    row = conduct(merge, car("non_ego", y_m=y), player="non_ego")
    assert row["lane_change_s"] == pytest.approx(2.8)


def test_lane_change__is_measured_from_the_lanes_and_not_from_the_line_of_the_route(repository: Path) -> None:
    cut_in = open_scene(repository / "networks/cut_in")
    lane_y, next_y, taper_x, full_x = 38.25, 34.75, 450.0, 510.0  # the route's line moves into the lane that opens here
    y = np.interp(np.arange(STEPS), [10.5, 50.5], [lane_y, next_y])
    row = conduct(cut_in, car("non_ego", x_m=taper_x, y_m=y, speed_mps=(full_x - taper_x) / 3.0), player="non_ego")
    assert row["lane_change_s"] == pytest.approx(3.7)  # from step 12 to step 49


def test_lane_change__that_is_given_up_or_not_completed_is_none(merge: OpenScene) -> None:
    back, over_the_mark = (np.interp(np.arange(STEPS), [10, 20, 30], [ENDING_Y, y, ENDING_Y]) for y in (-3.3, -3.0))
    late = np.interp(np.arange(STEPS), [40, 70], [ENDING_Y, THROUGH_Y])
    for y in (back, over_the_mark, late):
        assert conduct(merge, car("non_ego", y_m=y), player="non_ego")["lane_change_s"] is None


def test_lateral_wander__is_that_of_keeping_the_lane(merge: OpenScene) -> None:
    weaving = 0.2 * np.where(np.arange(STEPS) % 2, 1.0, -1.0)
    assert conduct(merge, car("ego", y_m=THROUGH_Y + weaving))["lateral_wander_m"] == pytest.approx(0.2, rel=0.01)
    changes = np.interp(np.arange(STEPS), [20, 40], [ENDING_Y, THROUGH_Y])
    assert conduct(merge, car("non_ego", y_m=changes), player="non_ego")["lateral_wander_m"] < 0.06


def test_following_gap__is_the_median_over_the_own_speed_and_such_a_road_is_not_free(merge: OpenScene) -> None:
    length_m = float(merge.world.length_m[0])
    leader = {"x_m": 20.0 + length_m + 1.5 * 6.0, "speed_mps": 6.0}
    row = conduct(merge, car("ego", speed_mps=6.0, steps=170), car("non_ego", **leader, steps=170))
    assert row["following_gap_s"] == pytest.approx(1.5, abs=0.04)  # places are known within 0.25 m of the route
    assert row["free_over_limit_mps"] is None
    # 15 s behind a vehicle are not yet following
    row = conduct(merge, car("ego", speed_mps=6.0, steps=150), car("non_ego", **leader, steps=150))
    assert row["following_gap_s"] is None


def test_jerk__is_the_change_of_acceleration_per_second(merge: OpenScene) -> None:
    acceleration = np.where(np.arange(STEPS) < 30, 0.0, 2.0)
    assert conduct(merge, car("ego"), acceleration_mps2=acceleration)["max_jerk_mps3"] == pytest.approx(20.0)


def test_steering_reversals__count_turns_of_the_wheel_by_at_least_3_degrees(merge: OpenScene) -> None:
    back_and_forth = np.where(np.arange(STEPS) // 10 % 2, 1.0, -1.0)  # 5 turns; the first gives the direction
    row = conduct(merge, car("ego"), steering_rad=0.01 * back_and_forth)
    assert row["steering_reversals_per_s"] == pytest.approx(4 / 5.9)
    row = conduct(merge, car("ego"), steering_rad=np.radians(1.4) / 15.0 * back_and_forth)
    assert row["steering_reversals_per_s"] == 0.0
    assert conduct(merge, car("ego"), steers=False)["steering_reversals_per_s"] is None


def test_lapses__by_hand(merge: OpenScene) -> None:
    lapsed = np.isin(np.arange(STEPS), [*range(10, 20), *range(30, 33)])
    row = conduct(merge, car("ego"), lapsed=lapsed)
    assert row["looks_away_share"] == pytest.approx(13 / 59)
    assert row["longest_lapse_s"] == pytest.approx(1.0)
    assert row["undecided_at_end_s"] == 0.0


def test_undecided__counts_from_the_last_decision_to_the_end(merge: OpenScene) -> None:
    at_end = np.isin(np.arange(STEPS), [*range(10, 20), *range(STEPS - 7, STEPS)])
    assert conduct(merge, car("ego"), lapsed=at_end)["undecided_at_end_s"] == pytest.approx(0.7)
    assert conduct(merge, car("ego"), lapsed=True)["undecided_at_end_s"] == pytest.approx(5.9)
