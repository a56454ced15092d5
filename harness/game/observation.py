"""What a driver sees of the game: own motion, the road ahead, and the nearest others, in the driver's own frame.

Only what a person behind the wheel could see: nobody's intentions, persona, payoff or plan. Every entry is scaled
to [-1, 1]; `LAYOUT` names them in order and is written beside every policy.

The free width at a distance ahead reaches to the nearest surface on either side, rail or vehicle alike (the paper's
ego "seeks to maintain a large distance between itself and nearby objects", section 4.3.2).
"""

from __future__ import annotations

import numpy as np

from harness.compiling import compiled
from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.quantities import PATH_M, OnPath, Quantities, Relative

_BEHIND = int(np.searchsorted(PATH_M, 0.0))  # how many of them are not ahead
AHEAD_M = PATH_M[_BEHIND:]
OTHERS = 3  # how many of the nearest others are seen

_EDGES = np.concatenate(([-2.5], 0.5 * (AHEAD_M[1:] + AHEAD_M[:-1]), [60.0]))  # bins of road around AHEAD_M
# what each kind of entry is divided by
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
_TURNED = 6  # where the entries of each kind begin
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
    """[..., SIZE] float64: what is seen, in the units that the entries' names in `LAYOUT` say. An entry that is at
    its bound stands for whatever lies beyond it as well: a goal 200 m ahead may be farther."""
    seen = np.asarray(observation, dtype=np.float64) * _SCALES
    seen[..., _LOCK] *= max_steering_rad
    return seen


def observe(q: Quantities) -> FloatArray:
    """[G, P, SIZE] float32 in [-1, 1]: what each player sees. Players that are not there see zeros."""
    state, actuators, routes = q.state, q.world.actuators, q.world.road.routes
    view = np.zeros((*state.x_m.shape, SIZE))
    view[..., 0] = state.speed_mps / _SPEED_MPS
    view[..., 1] = q.speed_over_limit
    view[..., 2] = state.acceleration_mps2 / _ACCELERATION_MPS2
    view[..., 3] = state.steering_rad / actuators.max_steering_rad
    view[..., 4] = q.lane_end_m / _FAR_M
    view[..., 5] = q.goal_m / (2.0 * _FAR_M)
    edges = (routes.left_edge_m, routes.right_edge_m)
    _look_ahead(view, state.heading_rad, q.lateral_offset_m, q.path_rows, routes.heading_rad, *edges, q.seen, q.on_path)
    _look_at_others(view, state.speed_mps, q.bodies.speed_mps, q.seen, q.relative)
    return _within_bounds(view, state.present)


@compiled
def _look_ahead(
    view: FloatArray,
    heading_rad: FloatArray,
    lateral_offset_m: FloatArray,
    path_rows: IntArray,
    line_heading_rad: FloatArray,
    left_edge_m: FloatArray,
    right_edge_m: FloatArray,
    seen: BoolArray,
    bodies: OnPath,
) -> None:
    """Fill in how the path turns, and the free width beside it."""
    for g, p in np.ndindex(heading_rad.shape):
        offset = lateral_offset_m[g, p]
        view[g, p, _LEFT - 1] = -offset / _SIDE_M
        for k in range(_COUNT):
            row = path_rows[g, p, _BEHIND + k]
            turned = line_heading_rad[row] - heading_rad[g, p]
            view[g, p, _TURNED + k] = 2.0 * ((turned + np.pi) % (2.0 * np.pi) - np.pi)
            left, right = left_edge_m[row] - offset, right_edge_m[row] - offset
            for b in range(seen.shape[2]):
                near = bodies.ahead_m[g, p, b] - bodies.half_length_m[g, p, b]
                far = bodies.ahead_m[g, p, b] + bodies.half_length_m[g, p, b]
                if seen[g, p, b] and far > _EDGES[k] and near < _EDGES[k + 1]:
                    if bodies.left_m[g, p, b] > 0.0:
                        left = min(left, bodies.left_m[g, p, b] - bodies.half_width_m[g, p, b])
                    else:
                        right = max(right, bodies.left_m[g, p, b] + bodies.half_width_m[g, p, b])
            view[g, p, _LEFT + k], view[g, p, _RIGHT + k] = left / _SIDE_M, right / _SIDE_M


@compiled
def _look_at_others(
    view: FloatArray, own_speed_mps: FloatArray, speed_mps: FloatArray, seen: BoolArray, bodies: Relative
) -> None:
    """Fill in the nearest others, nearest first; zeros stay where there are fewer."""
    for g, p in np.ndindex(own_speed_mps.shape):
        last, last_m = -1, -1.0  # whom the entry before is of
        for k in range(OTHERS):
            nearest, nearest_m = -1, _FAR_M
            for b in range(seen.shape[2]):
                away = bodies.distance_m[g, p, b]
                if seen[g, p, b] and away < nearest_m and (away > last_m or (away == last_m and b > last)):
                    nearest, nearest_m = b, away
            if nearest < 0:
                break
            last, last_m = nearest, nearest_m
            turned, speed = bodies.turned_rad[g, p, nearest], speed_mps[g, nearest]
            entry = view[g, p, _FIRST_OTHER + k * _ENTRIES :]
            entry[0] = 1.0
            entry[1] = bodies.ahead_m[g, p, nearest] / _AHEAD_M
            entry[2] = bodies.left_m[g, p, nearest] / _SIDE_M
            entry[3] = (speed * np.cos(turned) - own_speed_mps[g, p]) / _CLOSING_MPS
            entry[4] = speed * np.sin(turned) / _CROSSING_MPS
            entry[5] = np.sin(turned)
            entry[6] = np.cos(turned)


@compiled
def _within_bounds(view: FloatArray, present: BoolArray) -> FloatArray:
    bounded = np.zeros(view.shape, dtype=np.float32)
    for g, p in np.ndindex(present.shape):
        if present[g, p]:
            for k in range(view.shape[2]):
                bounded[g, p, k] = min(max(view[g, p, k], -1.0), 1.0)
    return bounded
