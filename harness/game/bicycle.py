"""Vehicle dynamics of a player on wheels: a kinematic bicycle inside a friction circle.

Kinematic bicycle about the centre of the wheelbase (Rajamani, Vehicle Dynamics and Control, 2nd ed., section 2.2):

    slip = atan(tan(steering) / 2)          x' = v cos(heading + slip)
    heading' = v cos(slip) tan(steering) / wheelbase          y' = v sin(heading + slip)

Integration follows SUMO's Euler update (displacement = new speed times step), with the heading at mid-step. The lateral
acceleration of a two-wheeler is also limited by its lean.

Pedals and wheel act late: acceleration and steering angle approach what is requested with a first-order lag, the
acceleration by no more than the limit of its jerk (`config.road_user` has the values and their sources).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from harness.game.arrays import BoolArray, FloatArray
from harness.game.jit import compiled
from harness.game.road import Routes
from harness.game.state import PlayersMotion, State, motion_of

GRAVITY_MPS2 = 9.81
WHEEL_CENTRE = 0.25  # gain of the wheel near its centre; at full deflection the gain is 1


class ActuatorLimits(NamedTuple):
    """Limits of the players' cars. Arrays are [P]; `friction` is the usual friction coefficient of the road. That of a
    game is in its state; drivers know the usual one."""

    max_acceleration_mps2: FloatArray
    max_braking_mps2: FloatArray
    max_speed_mps: FloatArray
    max_steering_rad: FloatArray
    max_steering_rate_radps: FloatArray
    wheelbase_m: FloatArray
    max_lateral_mps2: FloatArray  # by the lean of a two-wheeler; a car is limited by its grip alone
    throttle_lag_s: FloatArray  # time constants of the approach to what is requested
    brake_lag_s: FloatArray
    steering_lag_s: FloatArray
    max_jerk_mps3: FloatArray
    friction: float


@compiled
def steering_range_rad(speed_mps: FloatArray, actuators: ActuatorLimits) -> FloatArray:
    """[G, P] largest useful steering angle at a speed [G, P]: the lock, or the angle at which the tyres lose grip."""
    grip = np.minimum(actuators.friction * GRAVITY_MPS2, actuators.max_lateral_mps2)
    return np.minimum(
        actuators.max_steering_rad,
        np.arctan(actuators.wheelbase_m * grip / np.maximum(speed_mps, 0.1) ** 2),
    )


@compiled
def requests(
    action: FloatArray, speed_mps: FloatArray, road_steering_rad: FloatArray, actuators: ActuatorLimits
) -> FloatArray:
    """[2, G, P] the accelerations (m/s^2) and steering angles (rad) that actions request of the cars.

    action [G, P, 2] in [-1, 1]: the pedals (-1 full brake, 0 coast, 1 full throttle) and the wheel. A wheel of 0
    follows the road (road_steering_rad [G, P]); -1 and 1 add the largest useful angle to the right and left at speeds
    [G, P]; progressive from the centre.
    """
    requested, range_rad = np.empty((2, *speed_mps.shape)), steering_range_rad(speed_mps, actuators)
    for g, p in np.ndindex(speed_mps.shape):
        pedals, wheel = _clamped(action[g, p, 0], 1.0), _clamped(action[g, p, 1], 1.0)
        strongest = actuators.max_acceleration_mps2[p] if pedals >= 0.0 else actuators.max_braking_mps2[p]
        requested[0, g, p] = pedals * strongest
        turned = range_rad[g, p] * wheel * (WHEEL_CENTRE + (1.0 - WHEEL_CENTRE) * wheel**2)
        requested[1, g, p] = _clamped(road_steering_rad[g, p] + turned, actuators.max_steering_rad[p])
    return requested


def actions(
    acceleration_mps2: FloatArray,
    steering_rad: FloatArray,
    *,
    speed_mps: FloatArray,
    road_steering_rad: FloatArray,
    actuators: ActuatorLimits,
) -> FloatArray:
    """[..., P, 2] actions in [-1, 1]: the inverse of `requests`.

    acceleration_mps2, steering_rad, speed_mps and road_steering_rad are [..., P]. Requests beyond the car's limits are
    clipped.
    """
    strongest = np.where(acceleration_mps2 >= 0.0, actuators.max_acceleration_mps2, actuators.max_braking_mps2)
    turned = np.clip(steering_rad, -actuators.max_steering_rad, actuators.max_steering_rad) - road_steering_rad
    share = np.clip(turned / steering_range_rad(speed_mps, actuators), -1.0, 1.0)
    # the only real root of the depressed cubic share = wheel (c + (1 - c) wheel^2)
    stretch = np.sqrt(WHEEL_CENTRE / (3.0 * (1.0 - WHEEL_CENTRE)))
    wheel = 2.0 * stretch * np.sinh(np.arcsinh(1.5 * share / (WHEEL_CENTRE * stretch)) / 3.0)
    return np.clip(np.stack((acceleration_mps2 / strongest, wheel), axis=-1), -1.0, 1.0)


class Requested(NamedTuple):
    """Requests of the players, [G, P], and whose are carried out."""

    acceleration_mps2: FloatArray
    steering_rad: FloatArray
    moving: BoolArray


def move(state: State, requested: Requested, actuators: ActuatorLimits, step_s: float) -> None:
    """Move the players marked in `moving` by one step, in place.

    The steering angle follows its request with the lag of the steering, at most at the rate of the rack, and the
    acceleration with the lag of the pedal that is used, at most at the limit of the jerk. The grip used by the curve is
    not available to the pedals (friction circle). If the grip is too small for the curve, the car runs wide.
    """
    _move((motion_of(state), state.friction), tuple(requested), tuple(actuators), step_s)


@compiled
def _move(cars: tuple[Any, ...], requests: tuple[Any, ...], limits: tuple[Any, ...], step_s: float) -> None:
    (x_m, y_m, heading_rad, speed_mps, acceleration_mps2, steering_rad, _), friction = cars
    requested, actuators = Requested(*requests), ActuatorLimits(*limits)
    for g, p in np.ndindex(requested.moving.shape):
        if requested.moving[g, p]:
            grip = friction[g] * GRAVITY_MPS2
            rack = actuators.max_steering_rate_radps[p] * step_s
            followed = followed_share(step_s, actuators.steering_lag_s[p])
            turn = _clamped(followed * (requested.steering_rad[g, p] - steering_rad[g, p]), rack)
            steering = _clamped(steering_rad[g, p] + turn, actuators.max_steering_rad[p])
            requested_curvature = curvature_per_m(steering, actuators.wheelbase_m[p])

            before = speed_mps[g, p]
            pedal_grip = _remaining_grip(grip, requested_curvature * before**2)
            most_up = min(actuators.max_acceleration_mps2[p], pedal_grip)
            most_down = min(actuators.max_braking_mps2[p], pedal_grip)
            asked = requested.acceleration_mps2[g, p]
            lag_s = actuators.brake_lag_s[p] if asked < 0.0 else actuators.throttle_lag_s[p]
            change = followed_share(step_s, lag_s) * (asked - acceleration_mps2[g, p])
            change = _clamped(change, actuators.max_jerk_mps3[p] * step_s)
            acceleration = min(max(acceleration_mps2[g, p] + change, -most_down), most_up)
            speed = min(max(before + acceleration * step_s, 0.0), actuators.max_speed_mps[p])
            acceleration = (speed - before) / step_s

            sideways = min(_remaining_grip(grip, acceleration), actuators.max_lateral_mps2[p])
            curvature = _clamped(requested_curvature, sideways / max(speed, 0.1) ** 2)
            slip = np.arcsin(_clamped(0.5 * curvature * actuators.wheelbase_m[p], 1.0))
            turned = curvature * speed * step_s
            course = heading_rad[g, p] + 0.5 * turned + slip
            x_m[g, p] += speed * step_s * np.cos(course)
            y_m[g, p] += speed * step_s * np.sin(course)
            heading_rad[g, p] = (heading_rad[g, p] + turned + np.pi) % (2.0 * np.pi) - np.pi
            acceleration_mps2[g, p], speed_mps[g, p], steering_rad[g, p] = acceleration, speed, steering


@compiled
def followed_share(step_s: float, lag_s: float) -> float:
    """The share of a request that a first-order lag follows within a step."""
    return 1.0 - np.exp(-step_s / lag_s) if lag_s > 0.0 else 1.0


@compiled
def curvature_per_m(steering_rad: FloatArray, wheelbase_m: FloatArray) -> FloatArray:
    """[...] curvature (1/m) of the path of the wheelbase's centre at a steering angle."""
    return np.cos(np.arctan(0.5 * np.tan(steering_rad))) * np.tan(steering_rad) / wheelbase_m


def lateral_acceleration_mps2(state: State, actuators: ActuatorLimits) -> FloatArray:
    """[G, P] lateral acceleration (m/s^2) at the state's steering and speed, bounded by the grip left by the pedals."""
    return _lateral_acceleration_mps2(motion_of(state), state.friction, tuple(actuators))


@compiled
def _lateral_acceleration_mps2(columns: tuple[Any, ...], friction: FloatArray, limits: tuple[Any, ...]) -> FloatArray:
    motion, actuators = PlayersMotion(*columns), ActuatorLimits(*limits)
    lateral = np.empty(motion.speed_mps.shape)
    for g, p in np.ndindex(lateral.shape):
        curvature = curvature_per_m(motion.steering_rad[g, p], actuators.wheelbase_m[p])
        grip = _remaining_grip(friction[g] * GRAVITY_MPS2, motion.acceleration_mps2[g, p])
        sideways = min(grip, actuators.max_lateral_mps2[p])
        lateral[g, p] = _clamped(curvature * motion.speed_mps[g, p] ** 2, sideways)
    return lateral


@compiled
def _remaining_grip(grip_mps2: FloatArray | float, used_mps2: FloatArray) -> FloatArray:
    """[...] grip that the friction circle leaves in one direction when `used_mps2` is used in the other."""
    return np.sqrt(np.maximum(grip_mps2**2 - used_mps2**2, 0.0))


@compiled
def _clamped(value: FloatArray, most: FloatArray | float) -> FloatArray:
    return np.minimum(np.maximum(value, -most), most)


def slide(state: State, sliding: BoolArray, course_rad: FloatArray, step_s: float) -> None:
    """Move the players marked in `sliding` [G, P] by one step, in place: along courses [G, P], braked by friction."""
    grip_mps2 = state.friction[:, None] * GRAVITY_MPS2
    speed_mps = np.where(sliding, np.maximum(state.speed_mps - grip_mps2 * step_s, 0.0), state.speed_mps)
    moved_m = np.where(sliding, speed_mps * step_s, 0.0)
    state.x_m = state.x_m + moved_m * np.cos(course_rad)
    state.y_m = state.y_m + moved_m * np.sin(course_rad)
    state.acceleration_mps2 = np.where(sliding, (speed_mps - state.speed_mps) / step_s, state.acceleration_mps2)
    state.speed_mps = speed_mps


def along_rail(state: State, at_rail: BoolArray, course_rad: FloatArray, routes: Routes) -> FloatArray:
    """[G, P] courses on which the players marked in `at_rail` go along the road; of their speed, in place, the part in
    this direction is left. Courses of others are unchanged."""
    road_rad = routes.heading_rad[routes.rows(state.station_m)]
    turned_rad = course_rad - road_rad
    state.speed_mps = np.where(at_rail, state.speed_mps * np.abs(np.cos(turned_rad)), state.speed_mps)
    return np.where(at_rail, np.where(np.cos(turned_rad) >= 0.0, road_rad, road_rad + np.pi), course_rad)
