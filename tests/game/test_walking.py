"""Motion on foot and on two wheels: each expected number is computed by hand."""

from __future__ import annotations

from math import atan, cos, pi, radians, sin, tan

import numpy as np
import pytest

from harness.config.road_user import DEFAULTS
from harness.game.bicycle import ActuatorLimits, Requested, curvature_per_m
from harness.game.state import State
from harness.game.walking import MAX_BACKWARD_MPS, MAX_TURN_RADPS, walk
from tests.support.bicycle import STEP_S, actuators, advance, state_of


def walker(**changes: float) -> ActuatorLimits:
    limits = DEFAULTS["pedestrian"].model_dump()
    return actuators(**{**limits, "max_speed_mps": 4.0, **changes})


def step_on(state: State, acceleration_mps2: float, steering_rad: float = 0.0, steps: int = 1) -> State:
    for _ in range(steps):
        request = (np.array([[acceleration_mps2]]), np.array([[steering_rad]]))
        walk(state, Requested(*request, np.array([[True]])), walker(), STEP_S)
    return state


def test_walk__starts_at_the_limit_of_acceleration_and_stands_while_it_brakes_gently() -> None:
    state = step_on(state_of(0.0), 9.0)
    found = (state.speed_mps[0, 0], state.x_m[0, 0], state.acceleration_mps2[0, 0])
    assert found == pytest.approx((0.23, 0.023, 2.3))  # 2.3 m/s2 for 0.1 s
    state = step_on(state_of(0.1), -1.1, steps=5)  # less than half of 2.3 m/s2
    assert (state.speed_mps[0, 0], state.x_m[0, 0]) == (0.0, 0.0)


def test_walk__steps_back_from_a_stand_slowly_when_it_brakes_hard() -> None:
    state = step_on(state_of(0.1), -2.3)
    assert state.speed_mps[0, 0] == 0.0  # first it stands
    state = step_on(state, -2.3)
    assert state.speed_mps[0, 0] == pytest.approx(-0.23)
    assert state.x_m[0, 0] == pytest.approx(-0.023)
    assert step_on(state, -2.3, steps=5).speed_mps[0, 0] == -MAX_BACKWARD_MPS
    assert step_on(state, 0.0, steps=5).speed_mps[0, 0] == 0.0  # and ends there


def test_walk__turns_on_the_spot_by_half_a_turn_a_second_at_most() -> None:
    # 1 / (0.6 m) tan(1.2) cos(atan(tan(1.2) / 2)) = 2.64 per metre, as at 1 m/s
    by_hand = tan(1.2) * cos(atan(0.5 * tan(1.2))) / 0.6
    assert by_hand < MAX_TURN_RADPS
    state = step_on(state_of(0.0), 0.0, 1.2)
    assert state.heading_rad[0, 0] == pytest.approx(0.1 * by_hand)
    assert (state.x_m[0, 0], state.y_m[0, 0]) == (0.0, 0.0)


def test_walk__runs_wide_of_what_lateral_acceleration_permits() -> None:
    state = step_on(state_of(4.0), 0.0, 1.2)
    assert state.heading_rad[0, 0] == pytest.approx(0.1 * 3.0 / 4.0)  # 3 m/s2 at 4 m/s
    assert state.y_m[0, 0] == pytest.approx(0.4 * sin(0.5 * 0.1 * 3.0 / 4.0))


def test_walk__turns_by_the_curvature_of_its_steering() -> None:
    state = step_on(state_of(1.4, heading_rad=pi - 0.01), 0.0, 0.3)
    turned = 0.14 * curvature_per_m(np.array(0.3), np.array(0.6))
    assert state.heading_rad[0, 0] == pytest.approx(-pi - 0.01 + turned)  # headings wrap at half a turn


def test_bicycle__turns_no_sharper_than_it_leans() -> None:
    limits = DEFAULTS["bicycle"].model_dump()
    bicycle = actuators(**{**limits, "max_speed_mps": 8.0})
    assert limits["max_lateral_mps2"] == pytest.approx(9.81 * tan(radians(20.0)), abs=0.05)
    state = state_of(6.0, steering_rad=0.8)
    advance(state, 0.0, 0.8, bicycle)
    assert state.heading_rad[0, 0] == pytest.approx(0.1 * 3.6 / 6.0)  # 3.6 m/s2 at 6 m/s
