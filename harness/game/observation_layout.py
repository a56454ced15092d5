"""The entries of an observation: their names, their order and their scales.

Every entry is scaled to [-1, 1]. Bounded quantities are divided by a scale and clipped. Distances, speeds and times
that have no bound are compressed: x becomes x / (|x| + scale), so that near values are told apart finely, far ones
coarsely, and none is clipped. `LAYOUT` is stored with every policy; a policy with another layout is refused.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from harness.game.arrays import BoolArray, FloatArray
from harness.game.jit import compiled
from harness.game.road import AHEAD_M
from harness.game.route_coordinates import PATH_M

BEHIND = int(np.searchsorted(PATH_M, 0.0))  # number of entries of PATH_M behind the player
OTHERS = 4
"""Number of other bodies in an observation."""


class Scale(NamedTuple):
    """How an entry is scaled: divided and clipped, or compressed."""

    scale: float
    compressed: bool = False


_SPEED, _ONE, _SIDE, _ANGLE = Scale(30.0), Scale(1.0), Scale(8.0), Scale(0.5, compressed=True)
_OWN: dict[str, Scale] = {
    "speed_mps": _SPEED,
    "speed_limit_mps": _SPEED,
    "speed_over_limit": _ONE,
    "over_posted_mps": Scale(5.0, compressed=True),  # speed over what limits ahead, signals and signs permit
    "acceleration_mps2": Scale(10.0),
    "steering_rad": _ONE,  # of the largest steering angle
    "road_steering_rad": _ONE,
    "lane_end_m": Scale(100.0),
    "goal_m": Scale(200.0),
    "own_side_left_m": _SIDE,  # to the mark between own and oncoming lanes
    "own_side_right_m": _SIDE,
    "path_left_m": _SIDE,
    **{f"path_turned_rad@{d:g}m": _ANGLE for d in AHEAD_M},
    **{f"path_bend_per_m@{d:g}m": Scale(0.1, compressed=True) for d in AHEAD_M},  # tightest from there to the next
    **{f"free_left_m@{d:g}m": _SIDE for d in AHEAD_M},
    **{f"free_right_m@{d:g}m": _SIDE for d in AHEAD_M},
    "stop_line_m": Scale(20.0, compressed=True),
    "give_way": _ONE,
    "stop_sign": _ONE,
    "signal_green": _ONE,
    "signal_yellow": _ONE,
    "signal_red": _ONE,
    "signal_s": Scale(5.0, compressed=True),  # since the signal changed
    "leader_seen": _ONE,
    "leader_gap_m": Scale(20.0, compressed=True),
    "leader_mps": Scale(10.0, compressed=True),  # relative to the own speed
}
_OTHER: Mapping[str, Scale] = {
    "seen": _ONE,
    "ahead_m": Scale(20.0, compressed=True),
    "left_m": Scale(8.0, compressed=True),
    "ahead_mps": Scale(10.0, compressed=True),
    "left_mps": Scale(5.0, compressed=True),
    "turned_sin": _ONE,
    "turned_cos": _ONE,
    "length_m": Scale(20.0),
    "width_m": Scale(4.0),
    "own_to_conflict_m": Scale(20.0, compressed=True),
    "other_to_conflict_m": Scale(20.0, compressed=True),
    "arrives_later_s": Scale(3.0, compressed=True),  # than the player, at constant speeds
    "has_priority": _ONE,  # 1: over the player; -1: must yield to it; 0: no conflict
}

SCALES: Mapping[str, Scale] = _OWN | {
    f"other{k}_{name}": scale for k in range(OTHERS) for name, scale in _OTHER.items()
}
"""The scale of each entry, by name, in the order of the entries."""
LAYOUT: tuple[str, ...] = tuple(SCALES)
"""The names of the entries in their order. A name ends with the unit."""
SIZE = len(LAYOUT)
FIRST_OTHER, ENTRIES = len(_OWN), len(_OTHER)
"""The place of the first other body's entries, and the number of entries of each."""


def _places(names: Sequence[str]) -> Any:
    """The place of each entry under its name without the distance; of entries at `AHEAD_M`, that of the first."""
    places = {name.partition("@")[0]: k for k, name in reversed(list(enumerate(names)))}
    return namedtuple("Places", places)(**places)


OWN, OTHER = _places(list(_OWN)), _places(list(_OTHER))
"""Places by name: in an observation, and among the entries of another body."""
OF_OTHERS = np.array([name.startswith(("other", "leader")) for name in LAYOUT])
"""[SIZE] the entries about other road users."""
SCALE = np.array([each.scale for each in SCALES.values()])
COMPRESSED = np.array([each.compressed for each in SCALES.values()])

_LOCK = [OWN.steering_rad, OWN.road_steering_rad]
_NEAR_BOUND = 1.0 - 2.0**-20  # of a compressed entry: rounding to 32 bits must not make it infinite


def in_units(observation: FloatArray, max_steering_rad: float) -> FloatArray:
    """[..., SIZE] float64: observations [..., SIZE] in the units named in `LAYOUT`.

    A divided entry at its bound stands for all values beyond it: a goal at 200 m may be farther away. A compressed
    entry at its bound is a very large number.
    """
    values = np.array(observation, dtype=np.float64, order="C")
    _unscale(values.reshape(-1, SIZE), SCALE, COMPRESSED)
    values[..., _LOCK] *= max_steering_rad
    return values


@compiled
def _unscale(values: FloatArray, scale: FloatArray, compressed: BoolArray) -> None:
    """Bring scaled values [N, SIZE] into their units, in place."""
    for row in range(len(values)):
        for entry in range(values.shape[1]):
            value = values[row, entry]
            if compressed[entry]:
                value = min(max(value, -_NEAR_BOUND), _NEAR_BOUND)
                values[row, entry] = value * scale[entry] / (1.0 - abs(value))
            else:
                values[row, entry] = value * scale[entry]
