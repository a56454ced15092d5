"""How a player's car answers its pedals and wheel: a kinematic bicycle inside a friction circle.

Kinematic bicycle about the centre of the wheelbase (Rajamani, Vehicle Dynamics and Control, 2nd ed., section 2.2):

    slip = atan(tan(steering) / 2)          x' = v cos(heading + slip)
    heading' = v cos(slip) tan(steering) / wheelbase          y' = v sin(heading + slip)

integrated like SUMO's Euler update (displacement = new speed times step), with the heading at mid-step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from harness.game.arrays import BoolArray, FloatArray
from harness.game.jit import compiled
from harness.game.state import State

GRAVITY_MPS2 = 9.81
WHEEL_CENTRE = 0.25  # gain of the wheel about its centre: small corrections are gentle, full lock is in reach


class Actuators(NamedTuple):
    """What the players' cars can do. Arrays are [P]; `friction` is the road's, as a share of g."""

    max_acceleration_mps2: FloatArray
    max_braking_mps2: FloatArray
    max_speed_mps: FloatArray
    max_steering_rad: FloatArray
    max_steering_rate_radps: FloatArray
    wheelbase_m: FloatArray
    friction: float


@compiled
def steering_range_rad(speed_mps: FloatArray, actuators: Actuators) -> FloatArray:
    """[G, P] largest steering angle of use at this speed: the car's lock, or where the tyres would let go."""
    grip = actuators.friction * GRAVITY_MPS2
    return np.minimum(
        actuators.max_steering_rad,
        np.arctan(actuators.wheelbase_m * grip / np.maximum(speed_mps, 0.1) ** 2),
    )


@compiled
def requests(action: FloatArray, speed_mps: FloatArray, actuators: Actuators) -> tuple[FloatArray, FloatArray]:
    """What a driver's action asks of the car.

    action [G, P, 2] in [-1, 1]: the pedals (-1 full brake, 0 coast, 1 full throttle) and the wheel (-1 as far
    right, 1 as far left as is of use at this speed; gentle about the centre). Returns acceleration (m/s^2) and
    steering angle (rad), [G, P].
    """
    acceleration, steering = np.empty(speed_mps.shape), steering_range_rad(speed_mps, actuators)
    for g, p in np.ndindex(speed_mps.shape):
        pedals, wheel = _within(action[g, p, 0], 1.0), _within(action[g, p, 1], 1.0)
        strongest = actuators.max_acceleration_mps2[p] if pedals >= 0.0 else actuators.max_braking_mps2[p]
        acceleration[g, p] = pedals * strongest
        steering[g, p] *= wheel * (WHEEL_CENTRE + (1.0 - WHEEL_CENTRE) * wheel**2)
    return acceleration, steering


def actions(
    acceleration_mps2: FloatArray, steering_rad: FloatArray, speed_mps: FloatArray, actuators: Actuators
) -> FloatArray:
    """The action [..., 2] whose `requests` ask this acceleration (m/s^2) and steering angle (rad) of the car, or as
    much of them as it can. Arguments [..., P]; the result is in [-1, 1]."""
    strongest = np.where(acceleration_mps2 >= 0.0, actuators.max_acceleration_mps2, actuators.max_braking_mps2)
    share = np.clip(steering_rad / steering_range_rad(speed_mps, actuators), -1.0, 1.0)
    # the real root of share = wheel (c + (1 - c) wheel^2), a depressed cubic with one
    stretch = np.sqrt(WHEEL_CENTRE / (3.0 * (1.0 - WHEEL_CENTRE)))
    wheel = 2.0 * stretch * np.sinh(np.arcsinh(1.5 * share / (WHEEL_CENTRE * stretch)) / 3.0)
    return np.clip(np.stack((acceleration_mps2 / strongest, wheel), axis=-1), -1.0, 1.0)


def move(
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
    motion = (state.x_m, state.y_m, state.heading_rad, state.speed_mps, state.acceleration_mps2, state.steering_rad)
    _move(*motion, acceleration_mps2, steering_rad, moving, actuators, step_s)


@compiled
def _move(
    x_m: FloatArray,
    y_m: FloatArray,
    heading_rad: FloatArray,
    speed_mps: FloatArray,
    acceleration_mps2: FloatArray,
    steering_rad: FloatArray,
    wanted_acceleration_mps2: FloatArray,
    wanted_steering_rad: FloatArray,
    moving: BoolArray,
    actuators: Actuators,
    step_s: float,
) -> None:
    grip = actuators.friction * GRAVITY_MPS2
    for g, p in np.ndindex(moving.shape):
        if moving[g, p]:
            rack = actuators.max_steering_rate_radps[p] * step_s
            turn = _within(wanted_steering_rad[g, p] - steering_rad[g, p], rack)
            steering = _within(steering_rad[g, p] + turn, actuators.max_steering_rad[p])
            wanted = curvature_per_m(steering, actuators.wheelbase_m[p])

            before = speed_mps[g, p]
            left_for_pedals = _rest_of(grip, wanted * before**2)
            most_up = min(actuators.max_acceleration_mps2[p], left_for_pedals)
            most_down = min(actuators.max_braking_mps2[p], left_for_pedals)
            acceleration = min(max(wanted_acceleration_mps2[g, p], -most_down), most_up)
            speed = min(max(before + acceleration * step_s, 0.0), actuators.max_speed_mps[p])
            acceleration = (speed - before) / step_s

            curvature = _within(wanted, _rest_of(grip, acceleration) / max(speed, 0.1) ** 2)
            slip = np.arcsin(_within(0.5 * curvature * actuators.wheelbase_m[p], 1.0))
            turned = curvature * speed * step_s
            course = heading_rad[g, p] + 0.5 * turned + slip
            x_m[g, p] += speed * step_s * np.cos(course)
            y_m[g, p] += speed * step_s * np.sin(course)
            heading_rad[g, p] = (heading_rad[g, p] + turned + np.pi) % (2.0 * np.pi) - np.pi
            acceleration_mps2[g, p], speed_mps[g, p], steering_rad[g, p] = acceleration, speed, steering


@compiled
def curvature_per_m(steering_rad: FloatArray, wheelbase_m: FloatArray) -> FloatArray:
    """[...] curvature of the path of the centre of the wheelbase at a steering angle."""
    return np.cos(np.arctan(0.5 * np.tan(steering_rad))) * np.tan(steering_rad) / wheelbase_m


def lateral_acceleration_mps2(state: State, actuators: Actuators) -> FloatArray:
    """[G, P] lateral acceleration at this steering and speed, bounded by the grip that the pedals leave."""
    return _lateral_acceleration_mps2(state.steering_rad, state.speed_mps, state.acceleration_mps2, actuators)


@compiled
def _lateral_acceleration_mps2(
    steering_rad: FloatArray, speed_mps: FloatArray, acceleration_mps2: FloatArray, actuators: Actuators
) -> FloatArray:
    sideways = curvature_per_m(steering_rad, actuators.wheelbase_m) * speed_mps**2
    return _within(sideways, _rest_of(actuators.friction * GRAVITY_MPS2, acceleration_mps2))


@compiled
def _rest_of(grip_mps2: float, used_mps2: FloatArray) -> FloatArray:
    """[...] what the friction circle leaves in one direction when so much is used in the other."""
    return np.sqrt(np.maximum(grip_mps2**2 - used_mps2**2, 0.0))


@compiled
def _within(value: FloatArray, most: FloatArray | float) -> FloatArray:
    """[...] a value kept between -most and most."""
    return np.minimum(np.maximum(value, -most), most)
