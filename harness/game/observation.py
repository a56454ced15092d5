"""Observations of the players: own motion, the road ahead and the nearest other bodies, in the player's own frame.

An observation holds only what a driver can see: no intentions, personas, payoffs or plans. Every entry is scaled to
[-1, 1]. `LAYOUT` names the entries in order and is stored with every policy.

An error of estimated distances scales the distance of other bodies in their true direction. An error of closing speeds
adds a radial velocity to theirs (`game.human_limits`).

The free width at a distance ahead ends at the nearest surface on either side, rail or vehicle (paper, section 4.3.2:
the ego "seeks to maintain a large distance between itself and nearby objects").
"""

from __future__ import annotations

from typing import Any

import numpy as np

from harness.game.arrays import BoolArray, FloatArray
from harness.game.jit import compiled
from harness.game.quantities import Quantities
from harness.game.road import Routes, lane_at, row_at
from harness.game.route_coordinates import PATH_M, half_extents_m, place_along_route, row_ahead

_BEHIND = int(np.searchsorted(PATH_M, 0.0))  # number of entries of PATH_M behind the player
AHEAD_M = PATH_M[_BEHIND:]
OTHERS = 3  # number of other bodies in an observation

_EDGES = np.concatenate(([-2.5], 0.5 * (AHEAD_M[1:] + AHEAD_M[:-1]), [60.0]))  # bins of road around AHEAD_M
# divisors of the entries
_SPEED_MPS, _ACCELERATION_MPS2, _SIDE_M, _FAR_M = 30.0, 10.0, 8.0, 100.0
_AHEAD_M, _CLOSING_MPS, _CROSSING_MPS = 50.0, 10.0, 5.0
_OTHER = ("seen", "ahead_m", "left_m", "ahead_mps", "left_mps", "turned_sin", "turned_cos")
_ENTRIES = len(_OTHER)

LAYOUT: tuple[str, ...] = (
    "speed_mps",
    "speed_over_limit",
    "acceleration_mps2",
    "steering_rad",
    "lane_end_m",
    "goal_m",
    *(f"path_turned_rad@{d:g}m" for d in AHEAD_M),
    "path_left_m",
    *(f"free_left_m@{d:g}m" for d in AHEAD_M),
    *(f"free_right_m@{d:g}m" for d in AHEAD_M),
    *(f"other{k}_{name}" for k in range(OTHERS) for name in _OTHER),
)
SIZE = len(LAYOUT)
_COUNT = len(AHEAD_M)
_TURNED = 6  # first entry of each kind
_LEFT = _TURNED + _COUNT + 1
_RIGHT = _LEFT + _COUNT
_FIRST_OTHER = _RIGHT + _COUNT
OF_OTHERS = np.array([name.startswith("other") for name in LAYOUT])

_SCALES = np.array(
    [
        *(_SPEED_MPS, 1.0, _ACCELERATION_MPS2, 1.0, _FAR_M, 2.0 * _FAR_M),
        *(0.5,) * _COUNT,  # radians
        *(_SIDE_M,) * (1 + 2 * _COUNT),
        *(1.0, _AHEAD_M, _SIDE_M, _CLOSING_MPS, _CROSSING_MPS, 1.0, 1.0) * OTHERS,
    ]
)
_LOCK = LAYOUT.index("steering_rad")


def in_units(observation: FloatArray, max_steering_rad: float) -> FloatArray:
    """[..., SIZE] float64: observations [..., SIZE] in the units named in `LAYOUT`.

    An entry at its bound stands for all values beyond it: a goal at 200 m may be farther away.
    """
    values = np.asarray(observation, dtype=np.float64) * _SCALES
    values[..., _LOCK] *= max_steering_rad
    return values


def observe(q: Quantities) -> FloatArray:
    """[G, P, SIZE] float32 in [-1, 1]: the players' observations; zeros for players that are not present."""
    state, bodies, actuators = q.state, q.bodies, q.world.actuators
    return _observe(
        *(state.x_m, state.y_m, state.heading_rad, state.speed_mps, state.acceleration_mps2, state.steering_rad),
        *(state.station_m, q.lateral_offset_m, state.present),
        (state.unseen_behind_m, state.sight_m, state.distance_error, state.closing_error_per_s),
        *(bodies.x_m, bodies.y_m, bodies.heading_rad, bodies.speed_mps, bodies.length_m, bodies.width_m),
        *(bodies.present, actuators.max_steering_rad, tuple(q.world.road.routes)),
    )


@compiled
def _observe(
    x_m: FloatArray,
    y_m: FloatArray,
    heading_rad: FloatArray,
    speed_mps: FloatArray,
    acceleration_mps2: FloatArray,
    steering_rad: FloatArray,
    station_m: FloatArray,
    offset_m: FloatArray,
    present: BoolArray,
    sight: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    body_x_m: FloatArray,
    body_y_m: FloatArray,
    body_heading_rad: FloatArray,
    body_speed_mps: FloatArray,
    body_length_m: FloatArray,
    body_width_m: FloatArray,
    body_present: BoolArray,
    max_steering_rad: FloatArray,
    table: tuple[Any, ...],
) -> FloatArray:
    """One compiled pass: for the few games of a reset, several calls would cost more than their work."""
    routes = Routes(*table)
    unseen_behind_m, sight_m, distance_error, closing_error_per_s = sight
    observation = np.zeros((*present.shape, SIZE), dtype=np.float32)
    view = np.empty(SIZE)
    bodies = body_present.shape[1]
    seen, distance_m = np.empty(bodies, dtype=np.bool_), np.empty(bodies)
    ahead_m, left_m = np.empty(bodies), np.empty(bodies)
    for g, p in np.ndindex(present.shape):
        if present[g, p]:
            first, last = routes.first_row[p], routes.last_row[p]
            station, offset, heading = station_m[g, p], offset_m[g, p], heading_rad[g, p]
            row = row_at(station, first, last)
            _, lane_end = lane_at(row, offset, routes.lane_offset_m, routes.lane_end_m)
            view[:] = 0.0
            view[0] = speed_mps[g, p] / _SPEED_MPS
            view[1] = speed_mps[g, p] / routes.speed_limit_mps[row] - 1.0
            view[2] = acceleration_mps2[g, p] / _ACCELERATION_MPS2
            view[3] = steering_rad[g, p] / max_steering_rad[p]
            view[4] = np.maximum(lane_end - station, 0.0) / _FAR_M
            view[5] = (routes.goal_m[p] - station) / (2.0 * _FAR_M)
            view[_LEFT - 1] = -offset / _SIDE_M
            for k in range(_COUNT):
                ahead = row_ahead(row, _BEHIND + k, first, last)
                turned = routes.heading_rad[ahead] - heading
                view[_TURNED + k] = 2.0 * ((turned + np.pi) % (2.0 * np.pi) - np.pi)
                view[_LEFT + k] = routes.left_edge_m[ahead] - offset
                view[_RIGHT + k] = routes.right_edge_m[ahead] - offset
            cosine, sine = np.cos(heading), np.sin(heading)
            for b in range(bodies):
                dx, dy = body_x_m[g, b] - x_m[g, p], body_y_m[g, b] - y_m[g, p]
                ahead_m[b], left_m[b] = dx * cosine + dy * sine, dy * cosine - dx * sine
                distance_m[b] = np.hypot(dx, dy)
                in_view = ahead_m[b] >= unseen_behind_m[g, p] and distance_m[b] <= sight_m[g, p]
                seen[b] = body_present[g, b] and b != p and in_view
                if seen[b]:
                    error = distance_error[g, p]
                    seen_at = (body_x_m[g, b] + error * dx, body_y_m[g, b] + error * dy)
                    along, beside, frame = place_along_route(row, station, offset, p, routes, *seen_at)
                    length, width = body_length_m[g, b], body_width_m[g, b]
                    extent = 0.5 * (length + width)  # at least the half extents, which take longer to compute
                    if along + extent > _EDGES[0] and along - extent < _EDGES[-1]:
                        turned = body_heading_rad[g, b] - routes.heading_rad[frame]
                        _narrow(view, along, beside, *half_extents_m(turned, length, width))
            for k in range(_COUNT):
                view[_LEFT + k] /= _SIDE_M
                view[_RIGHT + k] /= _SIDE_M
            last_seen, last_m = -1, -1.0  # the body of the previous entry
            for k in range(OTHERS):  # nearest first; missing bodies stay zeros
                nearest = _next_nearest(seen, distance_m, last_seen, last_m)
                if nearest < 0:
                    break
                last_seen, last_m = nearest, distance_m[nearest]
                turned, speed = body_heading_rad[g, nearest] - heading, body_speed_mps[g, nearest]
                entry = view[_FIRST_OTHER + k * _ENTRIES :]
                entry[0] = 1.0
                error, closing = distance_error[g, p], closing_error_per_s[g, p]
                ahead, left = ahead_m[nearest], left_m[nearest]
                entry[1] = (ahead + error * ahead) / _AHEAD_M
                entry[2] = (left + error * left) / _SIDE_M
                entry[3] = (speed * np.cos(turned) - speed_mps[g, p] + closing * ahead) / _CLOSING_MPS
                entry[4] = (speed * np.sin(turned) + closing * left) / _CROSSING_MPS
                entry[5] = np.sin(turned)
                entry[6] = np.cos(turned)
            for k in range(SIZE):
                observation[g, p, k] = min(max(view[k], -1.0), 1.0)
    return observation


@compiled
def _narrow(view: FloatArray, ahead_m: float, left_m: float, half_length_m: float, half_width_m: float) -> None:
    """Reduce the free widths in `view` by a body, given in route coordinates."""
    near, far = ahead_m - half_length_m, ahead_m + half_length_m
    for k in range(_COUNT):
        if far > _EDGES[k] and near < _EDGES[k + 1]:
            if left_m > 0.0:
                view[_LEFT + k] = min(view[_LEFT + k], left_m - half_width_m)
            else:
                view[_RIGHT + k] = max(view[_RIGHT + k], left_m + half_width_m)


@compiled
def _next_nearest(seen: BoolArray, distance_m: FloatArray, last: int, last_m: float) -> int:
    """The nearest body after the last one, by distance and then by index; -1 if there is none."""
    nearest, nearest_m = -1, _FAR_M
    for b in range(len(seen)):
        distance = distance_m[b]
        if seen[b] and distance < nearest_m and (distance > last_m or (distance == last_m and b > last)):
            nearest, nearest_m = b, distance
    return nearest
