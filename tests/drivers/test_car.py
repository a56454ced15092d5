"""Conversions between physical units and scaled observations and actions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from harness.drivers.car import Car, car_of
from harness.game.bicycle import requests
from harness.game.observation import observe
from harness.game.observation_layout import LAYOUT, SIZE
from harness.game.state import EGO
from harness.traffic.scene import OpenScene


@pytest.fixture(scope="module")
def car(merge: OpenScene) -> Car:
    return car_of(merge.world, EGO)


def observation_with(**entries: float) -> np.ndarray:
    view = np.zeros((1, SIZE), dtype=np.float32)
    for name, value in entries.items():
        view[0, LAYOUT.index(name)] = value
    return view


@pytest.mark.parametrize("speed_mps", [0.0, 3.0, 12.0, 29.0])
@pytest.mark.parametrize("acceleration", [-7.9, -1.0, 0.0, 0.3, 2.9])
@pytest.mark.parametrize("share", [-1.0, -0.3, 0.0, 0.001, 0.6])
def test_actions__request_the_given_acceleration_and_steering(
    car: Car, speed_mps: float, acceleration: float, share: float
) -> None:
    view = observation_with(speed_mps=speed_mps / 30.0)
    speed = car.physical(view)[:, LAYOUT.index("speed_mps")]
    _, largest = requests(np.array([[[0.0, 1.0]]]), speed[None], car.actuators)
    steering = share * largest[0]
    requested = requests(car.actions(np.array([acceleration]), steering, view)[:, None], speed[None], car.actuators)
    assert requested[0] == pytest.approx(acceleration, abs=1e-9)
    assert requested[1][0] == pytest.approx(steering, abs=1e-9)


def test_actions__are_clipped_to_the_limits_of_the_car(car: Car) -> None:
    hardest = car.actions(np.array([-50.0]), np.array([2.0]), observation_with(speed_mps=0.5))
    np.testing.assert_array_equal(hardest, [[-1.0, 1.0]])


def test_physical__has_the_units_of_the_names(merge: OpenScene, car: Car, moment: Callable[..., Any]) -> None:
    """Each quantity of the moment is restored from the observation."""
    ego = {"x_m": 30.0, "y_m": -5.0, "speed_mps": 11.0, "acceleration_mps2": -2.5, "steering_rad": 0.05}
    quantities = moment(merge.world, [ego, {"x_m": 45.0, "y_m": -4.0, "speed_mps": 7.0, "heading_rad": 0.1}])
    values = dict(zip(LAYOUT, car.physical(observe(quantities)[:, EGO])[0], strict=True))
    expected = {
        "speed_mps": 11.0,
        "speed_over_limit": quantities.speed_over_limit[0, EGO],
        "acceleration_mps2": -2.5,
        "steering_rad": 0.05,
        "path_left_m": -quantities.lateral_offset_m[0, EGO],
        "path_turned_rad@0m": 0.0,
        "other0_seen": 1.0,
        "other0_ahead_m": 15.0,
        "other0_left_m": 1.0,
        "other0_ahead_mps": 7.0 * np.cos(0.1) - 11.0,
        "other0_left_mps": 7.0 * np.sin(0.1),
        "other0_turned_sin": np.sin(0.1),
        "other0_turned_cos": np.cos(0.1),
        "other1_seen": 0.0,
    }
    assert {name: values[name] for name in expected} == pytest.approx(expected, abs=1e-5)
    assert values["goal_m"] == pytest.approx(min(float(quantities.goal_m[0, EGO]), 200.0), rel=1e-5)
    assert values["free_left_m@0m"] > 0.0 > values["free_right_m@0m"]
