"""Metrics of a drive, compared with values computed by hand."""

from __future__ import annotations

from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from harness.evaluation import metrics
from harness.evaluation.columns import MEANS, TABLES
from harness.evaluation.measured_game import METRICS_OF_PLAYERS
from harness.game.outcome import Outcome

INF = np.inf


def drive(outcome: Outcome = Outcome.GOAL, steers: bool = True, shielded: Any = None, **changes: Any) -> Any:
    """Four steps of 0.5 s, without encounters at junctions."""
    of = {
        "speed_mps": [10.0, 12.0, 11.0, 3.0],
        "acceleration_mps2": [0.0, 4.0, -2.0, -7.5],
        "lateral_acceleration_mps2": [0.5, -1.5, 1.0, 0.0],
        "leader_gap_m": [INF, 20.0, 10.0, INF],
        "time_to_collision_s": [INF, 9.0, 2.5, 4.0],
        "payoff": [0.25, 0.5, -1.0, 5.0],
        "passed_red_s": [-1.0, 0.4, -1.0, 2.5],
        "wrong_way": [0.0, 1.0, 1.0, 1.0],
    }
    series = {name: np.array(values) for name, values in {**of, **changes}.items()}
    shared = {"acceleration_mps2": series["acceleration_mps2"], "payoff": series["payoff"], "encounters": ()}
    flags = {} if shielded is None else {"shielded": np.array(shielded)}
    made: Any = SimpleNamespace(
        outcome=outcome, step_s=0.5, game=SimpleNamespace(steers=[steers]), player=0, of=series.__getitem__, **shared
    )
    made.flags, made.share = flags.get, partial(metrics.Drive.share, made)
    return made


def test_metrics__by_hand() -> None:
    assert {each.column.name: each.of(drive()) for each in METRICS_OF_PLAYERS} == {
        "mean_speed_mps": 9.0,
        "trailing_distance_m": 15.0,
        "min_ttc_s": 2.5,
        "max_deceleration_mps2": 7.5,
        "max_lateral_acceleration_mps2": 1.5,
        "time_to_goal_s": 2.0,
        "red_lights": 2.0,
        "latest_red_s": 2.5,
        "wrong_way_s": 1.5,
        "accepted_gap_s": None,
        "payoff": 4.75,
        "shield_interventions_per_km": None,  # without a shield
        "shielded_share": None,
        "lost_share": None,  # without perception errors
        "ghost_share": None,
    }


def test_registry__has_a_column_for_each_player_that_a_metric_is_of_and_for_its_mean() -> None:
    for each in METRICS_OF_PLAYERS:
        names = {"ego": f"ego_{each.column.name}", "person": f"non_ego_{each.column.name}"}
        assert all((names[who] in TABLES["episodes"]) == (who in each.whose) for who in names)
    assert all(metric.mean in TABLES["summary"] for metric in MEANS.values())


def test_registry__says_what_each_column_is() -> None:
    for columns in TABLES.values():
        assert all(column.meaning.endswith(".") for column in columns.values())
        assert all(name == column.name for name, column in columns.items())


@pytest.mark.parametrize(
    ("name", "changes", "value"),
    [
        ("latest_red_s", {"passed_red_s": [-1.0] * 4}, None),
        ("red_lights", {"passed_red_s": [-1.0] * 4}, 0.0),
        ("shield_interventions_per_km", {"shielded": [True, False, True, True]}, 2 / 0.018),  # 36 m/s in steps of 0.5 s
        ("shield_interventions_per_km", {"shielded": [False] * 4}, 0.0),
        ("shielded_share", {"shielded": [True, False, True, True]}, 0.75),
        ("time_to_goal_s", {"outcome": Outcome.COLLISION}, None),
        ("time_to_goal_s", {"outcome": Outcome.TIMEOUT}, None),
        ("trailing_distance_m", {"leader_gap_m": [INF] * 4}, None),
        ("min_ttc_s", {"time_to_collision_s": [INF] * 4}, None),
        ("min_ttc_s", {"time_to_collision_s": [INF, 1.0, 0.4, 0.0]}, 0.0),  # contact is a value
        ("max_deceleration_mps2", {"acceleration_mps2": [0.0, 1.0, 2.0, 0.5]}, 0.0),
        ("max_lateral_acceleration_mps2", {"steers": False}, None),
        ("mean_speed_mps", {"speed_mps": []}, None),
        ("max_deceleration_mps2", {"acceleration_mps2": []}, None),
    ],
)
def test_metric__is_empty_where_it_can_t_be_measured(name: str, changes: Any, value: float | None) -> None:
    assert getattr(metrics, name)(drive(**changes)) == value
