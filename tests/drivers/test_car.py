"""Conversions between physical units and scaled observations and actions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from harness.drivers.car import Car
from harness.game.bicycle import requests
from harness.game.observation import observe
from harness.game.observation_layout import LAYOUT, SIZE
from harness.game.roles import EGO
from harness.road.scene.open_scene import OpenScene


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
    _, largest = requests(np.array([[[0.0, 1.0]]]), speed[None], np.zeros((1, 1)), car.actuators)
    steering = share * largest[0]
    action = car.actions(np.array([acceleration]), steering, view)[:, None]
    requested = requests(action, speed[None], np.zeros((1, 1)), car.actuators)
    assert requested[0] == pytest.approx(acceleration, abs=1e-9)
    assert requested[1][0] == pytest.approx(steering, abs=1e-9)


@pytest.mark.parametrize("bend_rad", [-0.2, 0.03, 0.25])
@pytest.mark.parametrize("steering_rad", [-0.1, 0.0, 0.2])
def test_actions__count_the_wheel_from_the_bend_of_the_road(car: Car, bend_rad: float, steering_rad: float) -> None:
    view = observation_with(speed_mps=5.0 / 30.0, road_steering_rad=bend_rad / 0.6)
    bend = car.physical(view)[:, [LAYOUT.index("road_steering_rad")]]
    assert bend[0, 0] == pytest.approx(bend_rad)
    action = car.actions(np.zeros(1), np.array([steering_rad]), view)[:, None]
    assert np.sign(action[0, 0, 1]) == np.sign(steering_rad - bend_rad)
    assert requests(action, np.array([[5.0]]), bend, car.actuators)[1][0, 0] == pytest.approx(steering_rad, abs=1e-6)


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
        "speed_limit_mps": 13.89,
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
        "other0_length_m": 4.6,
        "other0_width_m": 1.8,
        "other1_seen": 0.0,
    }
    assert {name: values[name] for name in expected} == pytest.approx(expected, abs=1e-5)
    assert values["goal_m"] == pytest.approx(min(float(quantities.goal_m[0, EGO]), 200.0), rel=1e-5)
    assert values["free_left_m@0m"] > 0.0 > values["free_right_m@0m"]
