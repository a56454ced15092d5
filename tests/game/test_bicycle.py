"""The motion of a player's car, compared with hand calculations and with laws that hold for every input."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from harness.game.bicycle import (
    GRAVITY_MPS2,
    ActuatorLimits,
    Requested,
    actions,
    lateral_acceleration_mps2,
    move,
    requests,
    steering_range_rad,
)
from harness.game.state import State
from tests.support.bicycle import STEP_S, actuators, advance, state_of

Numbers = tuple[float, float]


@pytest.mark.parametrize(
    ("start", "requested", "expected"),
    [
        # a displacement is the new speed times the step
        ((10.0, 0.0), (2.0, 0.0), {"speed_mps": 10.2, "x_m": 1.02, "acceleration_mps2": 2.0}),
        ((10.0, 0.0), (-5.0, 0.0), {"speed_mps": 9.5, "x_m": 0.95, "y_m": 0.0, "heading_rad": 0.0}),
        ((10.0, 0.0), (9.0, 0.0), {"acceleration_mps2": 3.0}),  # the engine
        ((10.0, 0.0), (-20.0, 0.0), {"acceleration_mps2": -7.848}),  # the brakes have 8 m/s2, the tyres 0.8 * 9.81
        # to a stand and not backwards: 0.3 m/s in 0.1 s are the whole speed
        ((0.3, 0.0), (-8.0, 0.0), {"speed_mps": 0.0, "x_m": 0.0, "acceleration_mps2": -3.0}),
        ((2.0, 0.0), (0.0, 0.6), {"steering_rad": 0.08}),  # the rack: 0.8 rad/s for 0.1 s
        ((2.0, 0.08), (0.0, -0.6), {"steering_rad": 0.0}),
        # too fast for the curve the car runs wide: 20 m/s and 0.3 rad would need 0.1132 /m * 400 = 45 m/s2; the tyres
        # give 7.848 = 0.01962 /m * 400, and nothing is left for the engine
        ((20.0, 0.3), (3.0, 0.3), {"heading_rad": 7.848 / 20.0 * STEP_S, "acceleration_mps2": 0.0}),
    ],
)
def test_drive__one_step(
    start: tuple[float, float], requested: tuple[float, float], expected: dict[str, float]
) -> None:
    """From a speed and a steering angle, with an acceleration and a steering angle requested."""
    state = state_of(start[0], steering_rad=start[1])
    advance(state, *requested)
    assert {name: getattr(state, name)[0, 0] for name in expected} == pytest.approx(expected)


def test_drive__pedals_and_wheel_follow_requests_with_their_lags() -> None:
    # a lag of 0.5 s follows 1 - exp(-0.1 / 0.5) = 0.18126925 of a request in 0.1 s, one of 0.2 s 0.39346934, one of
    # 0.1 s 0.63212056
    car = actuators(throttle_lag_s=0.5, brake_lag_s=0.2, steering_lag_s=0.1)
    state = state_of(10.0)
    advance(state, 2.0, 0.05, car)
    assert state.acceleration_mps2[0, 0] == pytest.approx(2.0 * 0.18126925)
    assert state.steering_rad[0, 0] == pytest.approx(0.05 * 0.63212056)
    advance(state, -4.0, 0.05, car)  # from 0.3625385 to -4.0: 0.39346934 of -4.3625385
    assert state.acceleration_mps2[0, 0] == pytest.approx(0.3625385 - 4.3625385 * 0.39346934)
    assert state.steering_rad[0, 0] == pytest.approx(0.05 * (1.0 - 0.36787944**2))


def test_drive__the_acceleration_changes_by_no_more_than_the_limit_of_the_jerk() -> None:
    # 12.65 m/s3: 1.265 m/s2 in each 0.1 s, so that 0.774 g are reached within 0.6 s, as in UN R157
    state, car = state_of(20.0), actuators(max_jerk_mps3=12.65)
    for step in range(1, 7):
        advance(state, -7.59294, 0.0, car)
        assert state.acceleration_mps2[0, 0] == pytest.approx(-1.265 * step if step < 6 else -7.59)


def test_drive__one_step_of_a_turn_agrees_with_a_hand_calculation() -> None:
    # At 10 m/s with the wheels at 0.1 rad and coasting:
    #   tan 0.1 = 0.10033467       slip = atan(0.05016734) = 0.05012534, cos slip = 0.99874399
    #   curvature = 0.99874399 * 0.10033467 / 2.7 = 0.03711437 1/m  (lateral 3.711 m/s2, below the grip of 7.848)
    #   turned = 0.03711437 * 10 * 0.1 = 0.03711437 rad             course = 0.3 + 0.01855718 + 0.05012534 = 0.36868252
    #   x = cos 0.36868252 = 0.93279999, y = sin 0.36868252 = 0.36038889
    state = state_of(10.0, heading_rad=0.3, steering_rad=0.1)
    advance(state, 0.0, 0.1)
    assert state.heading_rad[0, 0] == pytest.approx(0.33711437, abs=1e-7)
    assert state.x_m[0, 0] == pytest.approx(np.cos(0.36868252), abs=1e-7)
    assert state.y_m[0, 0] == pytest.approx(np.sin(0.36868252), abs=1e-7)
    assert state.speed_mps[0, 0] == 10.0
    assert lateral_acceleration_mps2(state, actuators())[0, 0] == pytest.approx(3.711437, abs=1e-5)


def test_drive__on_ice_the_grip_is_that_of_the_game() -> None:
    # 0.1 * 9.81 = 0.981 m/s2 for the brakes, in one game; the other has the friction of a dry road
    state = State.empty(2, 1)
    state.speed_mps[:], state.friction[:] = 10.0, [0.1, 0.8]
    move(state, Requested(np.full((2, 1), -8.0), np.zeros((2, 1)), np.ones((2, 1), dtype=bool)), actuators(), STEP_S)
    assert state.acceleration_mps2[:, 0] == pytest.approx([-0.981, -7.848])


def test_drive__players_that_do_not_move_are_untouched() -> None:
    state = State.empty(1, 2)
    state.speed_mps[:], state.heading_rad[:], state.steering_rad[:], state.friction[:] = 10.0, 1.0, 0.05, 0.8
    before = state.copy()
    two = ActuatorLimits(
        **{name: value if name == "friction" else np.repeat(value, 2) for name, value in actuators()._asdict().items()}
    )
    move(state, Requested(np.full((1, 2), 2.0), np.full((1, 2), 0.1), np.array([[True, False]])), two, STEP_S)
    for name in ("x_m", "y_m", "heading_rad", "speed_mps", "acceleration_mps2", "steering_rad"):
        assert getattr(state, name)[0, 1] == getattr(before, name)[0, 1]
        assert getattr(state, name)[0, 0] != getattr(before, name)[0, 0]


CARS = st.builds(
    actuators,
    max_acceleration_mps2=st.floats(0.5, 15.0),
    max_braking_mps2=st.floats(0.5, 15.0),
    max_steering_rad=st.floats(0.05, 1.2),
    max_steering_rate_radps=st.floats(0.1, 10.0),
    wheelbase_m=st.floats(0.6, 12.0),
    friction=st.floats(0.05, 1.5),
)


@settings(max_examples=150, deadline=None)
@given(
    car=CARS,
    speed=st.floats(0.0, 40.0),
    steering=st.floats(-1.2, 1.2),
    request_list=st.lists(st.tuples(st.floats(-20.0, 20.0), st.floats(-1.5, 1.5)), min_size=1, max_size=8),
)
def test_drive__the_tyre_force_stays_within_the_friction_circle(
    car: ActuatorLimits, speed: float, steering: float, request_list: list[tuple[float, float]]
) -> None:
    lock = float(car.max_steering_rad[0])
    state = state_of(speed, steering_rad=float(np.clip(steering, -lock, lock)))
    grip = car.friction * GRAVITY_MPS2
    for acceleration, wheel in request_list:
        before = state.copy()
        advance(state, acceleration, wheel, car)
        turned = (state.heading_rad - before.heading_rad + np.pi) % (2.0 * np.pi) - np.pi
        lateral = state.speed_mps * turned / STEP_S  # lateral acceleration of the path
        along = (state.speed_mps - before.speed_mps) / STEP_S
        assert abs(lateral[0, 0]) <= grip + 1e-6
        assert np.hypot(lateral, along)[0, 0] <= grip + 1e-6
        reported = np.hypot(lateral_acceleration_mps2(state, car), state.acceleration_mps2)
        assert reported[0, 0] <= grip + 1e-6
        assert 0.0 <= state.speed_mps[0, 0] <= 40.0
        assert abs(state.steering_rad[0, 0]) <= lock + 1e-12
        moved = np.hypot(state.x_m - before.x_m, state.y_m - before.y_m)
        assert moved[0, 0] == pytest.approx(state.speed_mps[0, 0] * STEP_S)
        assert -np.pi <= state.heading_rad[0, 0] <= np.pi


@settings(max_examples=50, deadline=None)
@given(speed=st.floats(1.0, 39.0), wheel=st.floats(-0.6, 0.6), pedals=st.floats(-8.0, 3.0))
def test_drive__left_and_right_are_mirror_images(speed: float, wheel: float, pedals: float) -> None:
    one, two = state_of(speed, steering_rad=wheel / 2.0), state_of(speed, steering_rad=-wheel / 2.0)
    advance(one, pedals, wheel)
    advance(two, pedals, -wheel)
    assert one.x_m[0, 0] == pytest.approx(two.x_m[0, 0])
    assert one.y_m[0, 0] == pytest.approx(-two.y_m[0, 0])
    assert one.heading_rad[0, 0] == pytest.approx(-two.heading_rad[0, 0])
    assert one.speed_mps[0, 0] == pytest.approx(two.speed_mps[0, 0])


@pytest.mark.parametrize(
    ("speed", "steering"),
    [
        (0.0, 0.6),  # the lock
        (5.0, 0.6),  # atan(2.7 * 7.848 / 25) = atan(0.847584) = 0.703 is beyond the lock
        (10.0, 0.208807),  # atan(2.7 * 7.848 / 100) = atan(0.211896) = 0.211896 - 0.211896^3 / 3 + ...
        (20.0, 0.052924),  # atan(2.7 * 7.848 / 400) = atan(0.052974)
    ],
)
def test_steering_range__is_the_lock_or_the_grip_limit(speed: float, steering: float) -> None:
    assert steering_range_rad(np.array([[speed]]), actuators())[0, 0] == pytest.approx(steering, abs=1e-6)


@pytest.mark.parametrize(
    ("action", "road", "acceleration", "steering"),
    [
        ((0.0, 0.0), 0.0, 0.0, 0.0),
        ((1.0, 1.0), 0.0, 3.0, 0.208807),
        ((0.5, -0.5), 0.0, 1.5, -0.045677),  # progressive: 0.5 * (0.25 + 0.75 * 0.5^2) = 0.21875 of 0.208807
        ((-0.25, -1.0), 0.0, -2.0, -0.208807),
        ((7.0, -9.0), 0.0, 3.0, -0.208807),  # clamped to [-1, 1]
        ((-1.0, 0.0), 0.15, -8.0, 0.15),  # a wheel of 0 follows the road
        ((0.0, -0.5), 0.15, 0.0, 0.15 - 0.045677),
        ((0.0, 1.0), -0.15, 0.0, -0.15 + 0.208807),
        ((0.0, 1.0), 0.5, 0.0, 0.6),  # not beyond the lock
        ((0.0, -1.0), -0.9, 0.0, -0.6),
    ],
)
def test_requests__scale_pedals_and_wheel(
    action: tuple[float, float], road: float, acceleration: float, steering: float
) -> None:
    requested, wheel = requests(np.array([[action]]), np.array([[10.0]]), np.array([[road]]), actuators())
    assert requested[0, 0] == pytest.approx(acceleration)
    assert wheel[0, 0] == pytest.approx(steering, abs=1e-6)


@settings(max_examples=100, deadline=None)
@given(pedals=st.floats(-1.0, 1.0), wheel=st.floats(-1.0, 1.0), speed=st.floats(0.0, 40.0), road=st.floats(-0.3, 0.3))
def test_actions__are_the_inverse_of_requests_in_a_bend(pedals: float, wheel: float, speed: float, road: float) -> None:
    speeds, roads, car = np.array([[speed]]), np.array([[road]]), actuators(max_steering_rad=1.2)
    asked = requests(np.array([[(pedals, wheel)]]), speeds, roads, car)
    found = actions(*asked, speed_mps=speeds, road_steering_rad=roads, actuators=car)
    # not beyond the lock of 1.2 rad: what the lock cuts off can't be found again
    assume(abs(asked[1][0, 0]) < 1.2)
    assert found[0, 0] == pytest.approx([pedals, wheel], abs=1e-6)
