"""One car that moves by the bicycle model."""

from __future__ import annotations

import numpy as np

from harness.game.bicycle import (
    ActuatorLimits,
    Requested,
    move,
)
from harness.game.state import State

STEP_S = 0.1


def actuators(**changes: float) -> ActuatorLimits:
    values = {
        "max_acceleration_mps2": 3.0,
        "max_braking_mps2": 8.0,
        "max_speed_mps": 40.0,
        "max_steering_rad": 0.6,
        "max_steering_rate_radps": 0.8,
        "wheelbase_m": 2.7,
        "max_lateral_mps2": 15.0,
        "throttle_lag_s": 0.0,  # what is requested occurs at once, unless a test says otherwise
        "brake_lag_s": 0.0,
        "steering_lag_s": 0.0,
        "max_jerk_mps3": 1e6,
        **{name: value for name, value in changes.items() if name != "friction"},
    }
    arrays = {name: np.array([value]) for name, value in values.items()}
    return ActuatorLimits(**arrays, friction=changes.get("friction", 0.8))


def state_of(speed_mps: float, heading_rad: float = 0.0, steering_rad: float = 0.0) -> State:
    state = State.empty(1, 1)
    state.speed_mps[:], state.heading_rad[:], state.steering_rad[:] = speed_mps, heading_rad, steering_rad
    state.present[:], state.friction[:] = True, 0.8
    return state


def advance(state: State, acceleration_mps2: float, steering_rad: float, car: ActuatorLimits | None = None) -> None:
    car = car or actuators()
    state.friction[:] = car.friction
    requested = Requested(np.array([[acceleration_mps2]]), np.array([[steering_rad]]), np.array([[True]]))
    move(state, requested, car, STEP_S)
