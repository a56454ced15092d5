"""Metrics of a game, compared with values computed by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from harness.evaluation import metrics
from harness.evaluation.metrics import OF_EGO, OF_NON_EGO, PlayerSeries
from harness.evaluation.tables import EPISODE_COLUMNS
from harness.game.outcome import Outcome

INF = np.inf


def drive(**changes: Any) -> PlayerSeries:
    """Four steps of 0.5 s."""
    series: dict[str, Any] = {
        "speed_mps": [10.0, 12.0, 11.0, 3.0],
        "acceleration_mps2": [0.0, 4.0, -2.0, -7.5],
        "lateral_acceleration_mps2": [0.5, -1.5, 1.0, 0.0],
        "leader_gap_m": [INF, 20.0, 10.0, INF],
        "time_to_collision_s": [INF, 9.0, 2.5, 4.0],
        "payoff": [0.25, 0.5, -1.0, 5.0],
        "passed_red_s": [-1.0, 0.4, -1.0, 2.5],
        "wrong_way": [0.0, 1.0, 1.0, 1.0],
    }
    outcome = changes.pop("outcome", Outcome.GOAL)
    return PlayerSeries(
        outcome=outcome, step_s=0.5, **{name: np.array(values) for name, values in {**series, **changes}.items()}
    )


def test_metrics__by_hand() -> None:
    assert {name: metric(drive()) for name, metric in OF_EGO.items()} == {
        "ego_mean_speed_mps": 9.0,
        "ego_trailing_distance_m": 15.0,
        "ego_min_ttc_s": 2.5,
        "ego_max_deceleration_mps2": 7.5,
        "ego_max_lateral_acceleration_mps2": 1.5,
        "ego_time_to_goal_s": 2.0,
        "ego_red_lights": 2.0,
        "ego_wrong_way_s": 1.5,
        "ego_min_pet_s": None,  # without an encounter at a junction
        "ego_pet_priority": None,
        "ego_accepted_gap_s": None,
        "ego_payoff": 4.75,
    }
    assert {name: metric(drive()) for name, metric in OF_NON_EGO.items()} == {
        "non_ego_mean_speed_mps": 9.0,
        "non_ego_red_lights": 2.0,
        "non_ego_latest_red_s": 2.5,
        "non_ego_wrong_way_s": 1.5,
        "non_ego_payoff": 4.75,
    }


def test_metrics__are_the_columns_of_the_episodes() -> None:
    assert {*OF_EGO, *OF_NON_EGO} <= set(EPISODE_COLUMNS)


def test_latest_red__without_a_red_light_is_unscored() -> None:
    assert metrics.latest_red_s(drive(passed_red_s=[-1.0] * 4)) is None
    assert metrics.red_lights(drive(passed_red_s=[-1.0] * 4)) == 0.0


@pytest.mark.parametrize("outcome", [Outcome.COLLISION, Outcome.RAIL, Outcome.TIMEOUT])
def test_time_to_goal__without_the_goal_is_unscored(outcome: Outcome) -> None:
    assert metrics.time_to_goal_s(drive(outcome=outcome)) is None


def test_trailing_distance__without_a_leader_is_unscored() -> None:
    assert metrics.trailing_distance_m(drive(leader_gap_m=[INF] * 4)) is None


def test_min_ttc__without_a_course_to_contact_is_unscored() -> None:
    assert metrics.min_ttc_s(drive(time_to_collision_s=[INF] * 4)) is None


def test_min_ttc__contact_is_zero_and_that_is_a_value() -> None:
    assert metrics.min_ttc_s(drive(time_to_collision_s=[INF, 1.0, 0.4, 0.0])) == 0.0


def test_max_deceleration__without_braking_is_zero() -> None:
    assert metrics.max_deceleration_mps2(drive(acceleration_mps2=[0.0, 1.0, 2.0, 0.5])) == 0.0


def test_metrics__of_no_steps_are_unscored() -> None:
    empty = drive(**{name: [] for name in PlayerSeries.__dataclass_fields__ if name not in ("outcome", "step_s")})
    assert metrics.mean_speed_mps(empty) is None
    assert metrics.max_deceleration_mps2(empty) is None
    assert metrics.max_lateral_acceleration_mps2(empty) is None
