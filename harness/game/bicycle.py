"""How a player's car answers its pedals and wheel: a kinematic bicycle inside a friction circle.

Kinematic bicycle about the centre of the wheelbase (Rajamani, Vehicle Dynamics and Control, 2nd ed., section 2.2):

    slip = atan(tan(steering) / 2)          x' = v cos(heading + slip)
    heading' = v cos(slip) tan(steering) / wheelbase          y' = v sin(heading + slip)

integrated like SUMO's Euler update (displacement = new speed times step), with the heading at mid-step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from harness.game.arrays import BoolArray, FloatArray
from harness.game.state import State

GRAVITY_MPS2 = 9.81
WHEEL_CENTRE = 0.25  # gain of the wheel about its centre: small corrections are gentle, full lock is in reach


@dataclass(frozen=True)
class Actuators:
    """What the players' cars can do. Arrays are [P]; `friction` is the road's, as a share of g."""

    max_acceleration_mps2: FloatArray
    max_braking_mps2: FloatArray
    max_speed_mps: FloatArray
    max_steering_rad: FloatArray
    max_steering_rate_radps: FloatArray
    wheelbase_m: FloatArray
    friction: float


def steering_range_rad(speed_mps: FloatArray, actuators: Actuators) -> FloatArray:
    """[G, P] largest steering angle of use at this speed: the car's lock, or where the tyres would let go."""
    grip = actuators.friction * GRAVITY_MPS2
    return np.minimum(
        actuators.max_steering_rad,
        np.arctan(actuators.wheelbase_m * grip / np.maximum(speed_mps, 0.1) ** 2),
    )


def requests(action: FloatArray, speed_mps: FloatArray, actuators: Actuators) -> tuple[FloatArray, FloatArray]:
    """What a driver's action asks of the car.

    action [G, P, 2] in [-1, 1]: the pedals (-1 full brake, 0 coast, 1 full throttle) and the wheel (-1 as far
    right, 1 as far left as is of use at this speed; gentle about the centre). Returns acceleration (m/s^2) and
    steering angle (rad), [G, P].
    """
    pedals = np.clip(action[..., 0], -1.0, 1.0)
    wheel = np.clip(action[..., 1], -1.0, 1.0)
    acceleration = np.where(
        pedals >= 0.0, pedals * actuators.max_acceleration_mps2, pedals * actuators.max_braking_mps2
    )
    turned = wheel * (WHEEL_CENTRE + (1.0 - WHEEL_CENTRE) * wheel**2)
    return acceleration, turned * steering_range_rad(speed_mps, actuators)


def drive(
    state: State,
    acceleration_mps2: FloatArray,
    steering_rad: FloatArray,
    moving: BoolArray,
    actuators: Actuators,
    step_s: float,
) -> None:
    """Advance the players marked in `moving` [G, P] by one step, in place, by the requests [G, P].

    Steering follows its request as fast as the rack allows; what grip the curve uses is missing for speeding up and
    braking (friction circle), and where the grip is not enough for the curve the car runs wide.
    """
    grip = actuators.friction * GRAVITY_MPS2
    turn = actuators.max_steering_rate_radps * step_s
    steering = state.steering_rad + np.clip(steering_rad - state.steering_rad, -turn, turn)
    steering = np.clip(steering, -actuators.max_steering_rad, actuators.max_steering_rad)
    wanted = curvature_per_m(steering, actuators.wheelbase_m)

    left_for_pedals = _rest_of(grip, wanted * state.speed_mps**2)
    most_up = np.minimum(actuators.max_acceleration_mps2, left_for_pedals)
    most_down = np.minimum(actuators.max_braking_mps2, left_for_pedals)
    acceleration = np.clip(acceleration_mps2, -most_down, most_up)
    speed = np.clip(state.speed_mps + acceleration * step_s, 0.0, actuators.max_speed_mps)
    acceleration = (speed - state.speed_mps) / step_s

    tightest = _rest_of(grip, acceleration) / np.maximum(speed, 0.1) ** 2
    curvature = np.clip(wanted, -tightest, tightest)
    slip = np.arcsin(np.clip(0.5 * curvature * actuators.wheelbase_m, -1.0, 1.0))
    turned = curvature * speed * step_s
    course = state.heading_rad + 0.5 * turned + slip
    np.copyto(state.x_m, state.x_m + speed * step_s * np.cos(course), where=moving)
    np.copyto(state.y_m, state.y_m + speed * step_s * np.sin(course), where=moving)
    heading = state.heading_rad + turned
    np.copyto(state.heading_rad, (heading + np.pi) % (2.0 * np.pi) - np.pi, where=moving)
    np.copyto(state.acceleration_mps2, acceleration, where=moving)
    np.copyto(state.speed_mps, speed, where=moving)
    np.copyto(state.steering_rad, steering, where=moving)


def curvature_per_m(steering_rad: FloatArray, wheelbase_m: FloatArray) -> FloatArray:
    """[...] curvature of the path of the centre of the wheelbase at a steering angle."""
    return np.cos(np.arctan(0.5 * np.tan(steering_rad))) * np.tan(steering_rad) / wheelbase_m


def lateral_acceleration_mps2(state: State, actuators: Actuators) -> FloatArray:
    """[G, P] lateral acceleration at this steering and speed, bounded by the grip that the pedals leave."""
    grip = actuators.friction * GRAVITY_MPS2
    sideways = curvature_per_m(state.steering_rad, actuators.wheelbase_m) * state.speed_mps**2
    most = _rest_of(grip, state.acceleration_mps2)
    return np.clip(sideways, -most, most)


def _rest_of(grip_mps2: float, used_mps2: FloatArray) -> FloatArray:
    """[...] what the friction circle leaves in one direction when so much is used in the other."""
    return np.sqrt(np.maximum(grip_mps2**2 - used_mps2**2, 0.0))
