"""What a driver sees of the game: own motion, the road ahead, and the nearest others, in the driver's own frame.

Only what a person behind the wheel could see: nobody's intentions, persona, payoff or plan. Every entry is scaled
to [-1, 1]; `LAYOUT` names them in order and is written beside every policy.

The free width at a distance ahead reaches to the nearest surface on either side, rail or vehicle alike (the paper's
ego "seeks to maintain a large distance between itself and nearby objects", section 4.3.2).
"""

from __future__ import annotations

import numpy as np

from harness.game.arrays import FloatArray
from harness.game.quantities import PATH_M, Quantities

AHEAD = PATH_M >= 0.0
AHEAD_M = PATH_M[AHEAD]
OTHERS = 3  # how many of the nearest others are seen

_EDGES = np.concatenate(([-2.5], 0.5 * (AHEAD_M[1:] + AHEAD_M[:-1]), [60.0]))  # bins of road around AHEAD_M
# what each kind of entry is divided by
_SPEED_MPS, _ACCELERATION_MPS2, _SIDE_M, _FAR_M = 30.0, 10.0, 8.0, 100.0
_AHEAD_M, _CLOSING_MPS, _CROSSING_MPS = 50.0, 10.0, 5.0
_OTHER = ("seen", "ahead_m", "left_m", "ahead_mps", "left_mps", "turned_sin", "turned_cos")

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
_TURNED = slice(6, 6 + len(AHEAD_M))
_LEFT = slice(_TURNED.stop + 1, _TURNED.stop + 1 + len(AHEAD_M))
_RIGHT = slice(_LEFT.stop, _LEFT.stop + len(AHEAD_M))
OF_OTHERS = np.array([name.startswith("other") for name in LAYOUT])


def observe(q: Quantities) -> FloatArray:
    """[G, P, SIZE] float32 in [-1, 1]: what each player sees. Players that are not there see zeros."""
    state = q.state
    seen = np.zeros((*state.x_m.shape, SIZE))
    seen[..., 0] = state.speed_mps / _SPEED_MPS
    seen[..., 1] = q.speed_over_limit
    seen[..., 2] = state.acceleration_mps2 / _ACCELERATION_MPS2
    seen[..., 3] = state.steering_rad / q.world.actuators.max_steering_rad
    seen[..., 4] = np.minimum(q.lane_end_m, _FAR_M) / _FAR_M
    seen[..., 5] = q.goal_m / (2.0 * _FAR_M)
    turned = q.path.heading_rad[..., AHEAD] - state.heading_rad[..., None]
    seen[..., _TURNED] = 2.0 * ((turned + np.pi) % (2.0 * np.pi) - np.pi)
    seen[..., _TURNED.stop] = q.lateral_offset_m / -_SIDE_M
    left, right = _free_width(q)
    seen[..., _LEFT], seen[..., _RIGHT] = left / _SIDE_M, right / _SIDE_M
    _see_others(q, seen[..., _RIGHT.stop :])
    seen *= state.present[..., None]
    return np.minimum(np.maximum(seen, -1.0), 1.0).astype(np.float32)


def _free_width(q: Quantities) -> tuple[FloatArray, FloatArray]:
    """[G, P, K] free width to the left (positive) and to the right (negative) of the player at `AHEAD_M`."""
    offset = q.lateral_offset_m[..., None]
    left = q.path.left_edge_m[..., AHEAD] - offset
    right = q.path.right_edge_m[..., AHEAD] - offset
    if q.seen.any():
        body = q.on_path
        near, far = (
            (body.ahead_m - body.half_length_m)[..., None],
            (body.ahead_m + body.half_length_m)[..., None],
        )
        inside = q.seen[..., None] & (far > _EDGES[:-1]) & (near < _EDGES[1:])
        on_left = (body.left_m > 0.0)[..., None]
        side_to_right = (body.left_m - body.half_width_m)[..., None]
        side_to_left = (body.left_m + body.half_width_m)[..., None]
        left = np.minimum(left, np.where(inside & on_left, side_to_right, np.inf).min(-2))
        right = np.maximum(right, np.where(inside & ~on_left, side_to_left, -np.inf).max(-2))
    return left, right


def _see_others(q: Quantities, seen: FloatArray) -> None:
    """Fill [G, P, OTHERS * 7] with the nearest others, nearest first; zeros stay where there are fewer."""
    relative, state, bodies = q.relative, q.state, q.bodies
    distance = np.where(q.seen & (relative.distance_m < _FAR_M), relative.distance_m, np.inf)
    order = np.argsort(distance, axis=-1, kind="stable")[..., :OTHERS]
    g, p, k = np.nonzero(np.isfinite(distance).sum(-1)[..., None] > np.arange(order.shape[-1]))
    b = order[g, p, k]
    turned = relative.turned_rad[g, p, b]
    speed = bodies.speed_mps[g, b]
    entries = (
        np.ones(len(g)),
        relative.ahead_m[g, p, b] / _AHEAD_M,
        relative.left_m[g, p, b] / _SIDE_M,
        (speed * np.cos(turned) - state.speed_mps[g, p]) / _CLOSING_MPS,
        speed * np.sin(turned) / _CROSSING_MPS,
        np.sin(turned),
        np.cos(turned),
    )
    for each, entry in enumerate(entries):
        seen[g, p, k * len(_OTHER) + each] = entry
