"""What a driver by rules makes of what is seen: the way ahead, and the others on it and beside it, in metres.

Others are seen as points with headings: their size is not in view, so each is taken to be as large as one's own car.
What is beyond the bounds of the view is taken at its worst: whoever closes by 10 m/s or more is taken to stand.
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
_WHERE = LAYOUT.index("other0_ahead_mps")
MOST_CLOSING_MPS = 10.0
"""The view tells closing speeds up to here."""


class Encounters(NamedTuple):
    """Others [N, K] against one's own way; where `seen` is false the rest means nothing."""

    seen: BoolArray
    ahead_m: FloatArray
    """From one's own centre to theirs, along the way."""
    gap_m: FloatArray
    """Bumper to bumper along the way; negative beside each other."""
    offset_m: FloatArray
    """Of their centre from one's way, to the left."""
    clearance_m: FloatArray
    """From side to side, if one keeps to one's way; negative where they reach into it."""
    speed_mps: FloatArray
    """Along the way."""
    approach_mps: FloatArray
    """Towards one's way, across it."""
    lengths_m: FloatArray
    """Half of theirs and half of one's own."""


class OwnMotion(NamedTuple):
    """What is seen of oneself and of the way, [N] or [N, len(AHEAD_M)]."""

    speed_mps: FloatArray
    limit_mps: FloatArray
    """Of speed; NaN while one stands, for it is seen as a share of it only."""
    acceleration_mps2: FloatArray
    steering_rad: FloatArray
    path_left_m: FloatArray
    path_turned_rad: FloatArray


def look(car: Car, observation: FloatArray) -> tuple[OwnMotion, Encounters]:
    """What there is to see in N games, from what the driver sees [N, SIZE]."""
    seen = car.seen(observation)
    speed = seen[:, _SPEED]
    with np.errstate(divide="ignore", invalid="ignore"):
        limit = np.where(speed > 0.1, speed / (1.0 + seen[:, _OVER]), np.nan)
    view = OwnMotion(
        speed,
        limit,
        seen[:, _ACCELERATION],
        seen[:, _STEERING],
        seen[:, _LEFT],
        seen[:, _TURNED : _TURNED + len(AHEAD_M)],
    )
    others = seen[:, _OTHER:].reshape(len(seen), OTHERS, _ENTRIES)
    return view, _meet(car, view, others)


def _meet(car: Car, view: OwnMotion, others: FloatArray) -> Encounters:
    there, ahead, left, closing, across, sin, cos = np.moveaxis(others, -1, 0)
    own = view.speed_mps[:, None]
    forward = own + closing
    forward = np.where(closing <= -MOST_CLOSING_MPS, np.minimum(forward, 0.0), forward)
    way_left, way_turned = _way_at(view, ahead)
    along_cos, along_sin = np.cos(way_turned), np.sin(way_turned)
    offset = (left - way_left) * along_cos
    turned_cos, turned_sin = np.abs(cos * along_cos + sin * along_sin), np.abs(sin * along_cos - cos * along_sin)
    half_length = 0.5 * (car.length_m * turned_cos + car.width_m * turned_sin)
    half_width = 0.5 * (car.length_m * turned_sin + car.width_m * turned_cos)
    lengths = half_length + 0.5 * car.length_m
    leftwards = across * along_cos - forward * along_sin
    return Encounters(
        there > 0.5,
        ahead,
        np.abs(ahead) - lengths,
        offset,
        np.abs(offset) - half_width - 0.5 * car.width_m,
        forward * along_cos + across * along_sin,
        -np.sign(offset) * leftwards,
        lengths,
    )


def _way_at(view: OwnMotion, ahead_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """[N, K] how far to the left one's way is at a distance ahead, and how far it has turned there."""
    turned = view.path_turned_rad
    steps = np.diff(AHEAD_M) * np.sin(0.5 * (turned[:, 1:] + turned[:, :-1]))
    left = view.path_left_m[:, None] + np.concatenate((np.zeros((len(turned), 1)), np.cumsum(steps, axis=1)), axis=1)
    k = np.clip(np.searchsorted(AHEAD_M, ahead_m, side="right") - 1, 0, len(AHEAD_M) - 2)
    share = (ahead_m - AHEAD_M[k]) / (AHEAD_M[k + 1] - AHEAD_M[k])

    def between(values: FloatArray, share: FloatArray) -> FloatArray:
        here, there = np.take_along_axis(values, k, 1), np.take_along_axis(values, k + 1, 1)
        return here + share * (there - here)

    return between(left, share), between(turned, np.clip(share, 0.0, 1.0))
