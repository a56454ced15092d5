"""Motion of a player on foot.

A walker has the actions of a car, a change of speed and a turn, but not its kinematics:

- Its speed follows the request within the limits of acceleration and braking, up to a run.
- Braking ends at a stand. A request of more than `BACKWARD_SHARE` of the braking then leads backwards, at up to
  `MAX_BACKWARD_MPS`; the speed is negative.
- It turns on the spot: heading' = curvature max(speed, `TURNS_AS_AT_MPS`), at most `MAX_TURN_RADPS`, and at most the
  limit of lateral acceleration over the speed.

The curvature is that of a bicycle of the walker's `wheelbase_m` (`game.bicycle.curvature_per_m`), so that requests,
lapses and payoffs mean the same for every player. Integration is that of `game.bicycle`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from harness.game.bicycle import ActuatorLimits, Requested, curvature_per_m
from harness.game.jit import compiled
from harness.game.state import State, motion_of

MAX_BACKWARD_MPS = 0.5
BACKWARD_SHARE = 0.5  # of the braking
MAX_TURN_RADPS = np.pi  # half a turn in a second
TURNS_AS_AT_MPS = 1.0


def walk(state: State, requested: Requested, actuators: ActuatorLimits, step_s: float) -> None:
    """Move the walkers marked in `moving` by one step, in place."""
    _walk(motion_of(state), tuple(requested), tuple(actuators), step_s)


@compiled
def _walk(motion: tuple[Any, ...], requests: tuple[Any, ...], limits: tuple[Any, ...], step_s: float) -> None:
    x_m, y_m, heading_rad, speed_mps, acceleration_mps2, steering_rad, _ = motion
    asked, actuators = Requested(*requests), ActuatorLimits(*limits)
    moving = asked.moving
    for g, p in np.ndindex(moving.shape):
        if moving[g, p]:
            before = speed_mps[g, p]
            most_up, most_down = actuators.max_acceleration_mps2[p], actuators.max_braking_mps2[p]
            requested = min(max(asked.acceleration_mps2[g, p], -most_down), most_up)
            speed = _next_speed_mps(before, requested, (most_up, most_down), step_s)
            speed = min(speed, actuators.max_speed_mps[p])
            lock = actuators.max_steering_rad[p]
            steering = min(max(asked.steering_rad[g, p], -lock), lock)
            rate = curvature_per_m(steering, actuators.wheelbase_m[p]) * max(abs(speed), TURNS_AS_AT_MPS)
            fastest = min(MAX_TURN_RADPS, actuators.max_lateral_mps2[p] / max(abs(speed), 0.1))
            turned = min(max(rate, -fastest), fastest) * step_s
            course = heading_rad[g, p] + 0.5 * turned
            x_m[g, p] += speed * step_s * np.cos(course)
            y_m[g, p] += speed * step_s * np.sin(course)
            heading_rad[g, p] = (heading_rad[g, p] + turned + np.pi) % (2.0 * np.pi) - np.pi
            acceleration_mps2[g, p], speed_mps[g, p] = (speed - before) / step_s, speed
            steering_rad[g, p] = steering


@compiled
def _next_speed_mps(before_mps: float, requested_mps2: float, most_mps2: tuple[float, float], step_s: float) -> float:
    """The speed after a step in which an acceleration is requested: forward, standing or backward. `most_mps2` are the
    largest acceleration and braking."""
    most_up, most_down = most_mps2
    if before_mps > 0.0:
        return max(before_mps + requested_mps2 * step_s, 0.0)
    if requested_mps2 > 0.0:
        return before_mps + requested_mps2 * step_s
    if requested_mps2 < -BACKWARD_SHARE * most_down:
        return max(before_mps - most_up * step_s, -MAX_BACKWARD_MPS)
    return min(before_mps + most_down * step_s, 0.0)
