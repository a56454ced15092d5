"""Perception of a rule-based driver: the path ahead and the road users on it and beside it, in metres.

An observation gives a road user's position and heading, not its size: each is taken to be as large as the own car.
An entry at its bound is taken at its worst: a road user that closes at 10 m/s or more is taken to stand.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from harness.drivers.car import Car
from harness.game.arrays import BoolArray, FloatArray
from harness.game.observation import AHEAD_M, LAYOUT, OTHERS, SIZE

_SPEED, _OVER, _ACCELERATION, _STEERING = (
    LAYOUT.index(name) for name in ("speed_mps", "speed_over_limit", "acceleration_mps2", "steering_rad")
)
_TURNED = LAYOUT.index("path_turned_rad@0m")
_LEFT = LAYOUT.index("path_left_m")
_OTHER = LAYOUT.index("other0_seen")
_ENTRIES = (SIZE - _OTHER) // OTHERS
MAX_CLOSING_MPS = 10.0
"""Bound of the closing speed in an observation."""


class Encounters(NamedTuple):
    """Other road users [N, K] relative to the own path; where `seen` is false the other fields are undefined."""

    seen: BoolArray
    ahead_m: FloatArray
    """From the own centre to the other's, along the path."""
    gap_m: FloatArray
    """Bumper to bumper along the path; negative side by side."""
    offset_m: FloatArray
    """Of the other's centre from the own path, to the left."""
    clearance_m: FloatArray
    """Lateral distance between the sides if the own car keeps to its path; negative where the other reaches into it."""
    speed_mps: FloatArray
    """Along the path."""
    approach_mps: FloatArray
    """Towards the path, across it."""
    lengths_m: FloatArray
    """Half the length of the other plus half the length of the own car, along the path."""


class OwnMotion(NamedTuple):
    """The own motion and the own path, [N] or [N, len(AHEAD_M)]."""

    speed_mps: FloatArray
    limit_mps: FloatArray
    """Speed limit; NaN while the car stands, because the observation gives the speed relative to the limit only."""
    acceleration_mps2: FloatArray
    steering_rad: FloatArray
    path_left_m: FloatArray
    path_turned_rad: FloatArray


def perceive(car: Car, observation: FloatArray) -> tuple[OwnMotion, Encounters]:
    """Own motion and other road users in N games, from observations [N, SIZE]."""
    values = car.physical(observation)
    speed = values[:, _SPEED]
    with np.errstate(divide="ignore", invalid="ignore"):
        limit = np.where(speed > 0.1, speed / (1.0 + values[:, _OVER]), np.nan)
    motion = OwnMotion(
        speed_mps=speed,
        limit_mps=limit,
        acceleration_mps2=values[:, _ACCELERATION],
        steering_rad=values[:, _STEERING],
        path_left_m=values[:, _LEFT],
        path_turned_rad=values[:, _TURNED : _TURNED + len(AHEAD_M)],
    )
    others = values[:, _OTHER:].reshape(len(values), OTHERS, _ENTRIES)
    return motion, _encounters(car, motion, others)


def _encounters(car: Car, motion: OwnMotion, others: FloatArray) -> Encounters:
    seen, ahead, left, closing, across, sin, cos = np.moveaxis(others, -1, 0)
    own = motion.speed_mps[:, None]
    forward = own + closing
    forward = np.where(closing <= -MAX_CLOSING_MPS, np.minimum(forward, 0.0), forward)
    path_left, path_turned = _path_at(motion, ahead)
    along_cos, along_sin = np.cos(path_turned), np.sin(path_turned)
    offset = (left - path_left) * along_cos
    turned_cos, turned_sin = np.abs(cos * along_cos + sin * along_sin), np.abs(sin * along_cos - cos * along_sin)
    half_length = 0.5 * (car.length_m * turned_cos + car.width_m * turned_sin)
    half_width = 0.5 * (car.length_m * turned_sin + car.width_m * turned_cos)
    lengths = half_length + 0.5 * car.length_m
    leftwards = across * along_cos - forward * along_sin
    return Encounters(
        seen=seen > 0.5,
        ahead_m=ahead,
        gap_m=np.abs(ahead) - lengths,
        offset_m=offset,
        clearance_m=np.abs(offset) - half_width - 0.5 * car.width_m,
        speed_mps=forward * along_cos + across * along_sin,
        approach_mps=-np.sign(offset) * leftwards,
        lengths_m=lengths,
    )


def _path_at(motion: OwnMotion, ahead_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """[N, K] offset of the path to the left at a distance ahead, and its heading there."""
    turned = motion.path_turned_rad
    steps = np.diff(AHEAD_M) * np.sin(0.5 * (turned[:, 1:] + turned[:, :-1]))
    left = motion.path_left_m[:, None] + np.concatenate((np.zeros((len(turned), 1)), np.cumsum(steps, axis=1)), axis=1)
    k = np.clip(np.searchsorted(AHEAD_M, ahead_m, side="right") - 1, 0, len(AHEAD_M) - 2)
    share = (ahead_m - AHEAD_M[k]) / (AHEAD_M[k + 1] - AHEAD_M[k])

    def interpolate(values: FloatArray, share: FloatArray) -> FloatArray:
        low, high = np.take_along_axis(values, k, 1), np.take_along_axis(values, k + 1, 1)
        return low + share * (high - low)

    return interpolate(left, share), interpolate(turned, np.clip(share, 0.0, 1.0))
