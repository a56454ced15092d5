"""Perception of a rule-based driver: the path ahead, the next stop line, and the road users on the path and beside it,
in metres."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from harness.drivers.car import Car
from harness.game.arrays import BoolArray, FloatArray
from harness.game.observation_layout import ENTRIES, FIRST_OTHER, OTHERS, OWN
from harness.game.road import AHEAD_M


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
    own_to_conflict_m: FloatArray
    """From the own front bumper to the place where the other's way crosses or joins the own path; inf without one."""
    other_to_conflict_s: FloatArray
    """Time to that place at the other's present speed; inf without one."""
    has_priority: BoolArray
    """Whether the other has priority there."""
    yielding_mps: FloatArray
    """Speed of another that has to yield to the own car at a place ahead of it; inf if it has none, or is in it."""


class OwnMotion(NamedTuple):
    """The own motion and the own path, [N] or [N, len(AHEAD_M)]."""

    speed_mps: FloatArray
    speed_limit_mps: FloatArray
    acceleration_mps2: FloatArray
    steering_rad: FloatArray
    goal_m: FloatArray
    road_steering_rad: FloatArray
    """The steering angle that follows the path."""
    path_left_m: FloatArray
    path_turned_rad: FloatArray
    path_bend_per_m: FloatArray
    """The tightest curvature of the path in each section from `AHEAD_M` on."""
    stop_line_m: FloatArray
    """From the front bumper to the next stop line; very large without one."""
    stop_sign: BoolArray
    signal_red: BoolArray
    signal_yellow: BoolArray


def perceive(car: Car, observation: FloatArray) -> tuple[OwnMotion, Encounters]:
    """Own motion and other road users in N games, from observations [N, SIZE]."""
    values = car.physical(observation)
    own: dict[str, Any] = {name: values[:, getattr(OWN, name)] for name in OwnMotion._fields}
    own |= {name: own[name] > 0.5 for name in ("stop_sign", "signal_red", "signal_yellow")}
    for name in ("path_turned_rad", "path_bend_per_m"):
        first = getattr(OWN, name)
        own[name] = values[:, first : first + len(AHEAD_M)]
    motion = OwnMotion(**own)
    return motion, _encounters(car, motion, values[:, FIRST_OTHER:].reshape(len(values), OTHERS, ENTRIES))


def _encounters(car: Car, motion: OwnMotion, others: FloatArray) -> Encounters:
    seen, ahead, left, closing, across, sin, cos, length, width, *conflict = others.transpose(2, 0, 1)
    own_m, other_m, _, priority = conflict
    own = motion.speed_mps[:, None]
    forward = own + closing
    path_left, path_turned = _path_at(motion, ahead)
    along_cos, along_sin = np.cos(path_turned), np.sin(path_turned)
    offset = (left - path_left) * along_cos
    turned_cos, turned_sin = np.abs(cos * along_cos + sin * along_sin), np.abs(sin * along_cos - cos * along_sin)
    half_length = 0.5 * (length * turned_cos + width * turned_sin)
    half_width = 0.5 * (length * turned_sin + width * turned_cos)
    lengths = half_length + 0.5 * car.length_m
    speed = np.hypot(forward, across)
    meets, arrives_s = priority != 0.0, np.maximum(other_m, 0.0) / np.maximum(speed, 0.1)
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
        own_to_conflict_m=np.where(meets, own_m, np.inf),
        other_to_conflict_s=np.where(meets, arrives_s, np.inf),
        has_priority=priority > 0.5,
        yielding_mps=np.where((priority < 0.0) & (other_m > 0.0), speed, np.inf),
    )


def _path_at(motion: OwnMotion, ahead_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """[N, K] offset of the path to the left at a distance ahead, and its heading there."""
    turned = motion.path_turned_rad
    steps = np.diff(AHEAD_M) * np.sin(0.5 * (turned[:, 1:] + turned[:, :-1]))
    left = motion.path_left_m[:, None] + np.concatenate((np.zeros((len(turned), 1)), np.cumsum(steps, axis=1)), axis=1)
    k = np.clip(np.searchsorted(AHEAD_M, ahead_m, side="right") - 1, 0, len(AHEAD_M) - 2)
    share = (ahead_m - AHEAD_M[k]) / (AHEAD_M[k + 1] - AHEAD_M[k])
    games = np.arange(len(k))[:, None]

    def interpolate(values: FloatArray, share: FloatArray) -> FloatArray:
        low, high = values[games, k], values[games, k + 1]
        return low + share * (high - low)

    return interpolate(left, share), interpolate(turned, np.clip(share, 0.0, 1.0))
