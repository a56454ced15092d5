"""The ego's way as a recorded game has it: its lane, and when the body of another crosses the marks of that lane."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from harness.evaluation.manoeuvres.thresholds import HALF_LANE_M
from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.quantities import Quantities
from harness.game.roles import EGO


@dataclass(frozen=True, kw_only=True)
class InWay:
    """Another body relative to the ego's lane, in every step [T]."""

    inside: BoolArray
    """Whether a part of the body is between the marks of the ego's lane."""
    left_m: FloatArray
    """Its centre, to the left of the lane's centre."""
    ahead_m: FloatArray
    """Its centre, ahead of the ego's centre along the ego's route."""
    lane_m: FloatArray
    """The lane's centre, to the left of the ego's route where the body is: it jumps when the ego changes lanes."""


def in_way(q: Quantities, body: int) -> InWay:
    """A body relative to the lane in which the ego's centre is. `q`: a game, with its steps instead of games."""
    path, routes = q.on_path, q.world.road.routes
    ahead = path.ahead_m[:, EGO, body]
    stations = q.state.station_m.copy()
    stations[:, EGO] += ahead
    row = routes.rows(stations)[:, EGO]
    centre, left_mark, right_mark = _lane(routes.lane_offset_m[row], q.lateral_offset_m[:, EGO])
    left_mark = np.minimum(np.minimum(left_mark, routes.own_left_m[row]), centre + HALF_LANE_M)
    right_mark = np.maximum(np.maximum(right_mark, routes.own_right_m[row]), centre - HALF_LANE_M)
    beside = path.left_m[:, EGO, body] + q.lateral_offset_m[:, EGO]
    half = path.half_width_m[:, EGO, body]
    inside = q.bodies.present[:, body] & (beside - half < left_mark) & (beside + half > right_mark)
    return InWay(inside=inside, left_m=beside - centre, ahead_m=ahead, lane_m=centre)


def _lane(lanes_m: FloatArray, offset_m: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Centre of the lane nearest to an offset, and the marks half way to the next lanes; +-inf without a next lane.

    lanes_m [T, L] are the centres of lanes (NaN: none), offset_m [T].
    """
    away = np.abs(lanes_m - offset_m[:, None])
    nearest: IntArray = np.where(np.isnan(away), np.inf, away).argmin(1)
    centre = lanes_m[np.arange(len(lanes_m)), nearest]
    side = lanes_m - centre[:, None]
    left = np.where(side > 0.1, side, np.inf).min(1)
    right = np.where(side < -0.1, side, -np.inf).max(1)
    return centre, centre + 0.5 * left, centre + 0.5 * right
