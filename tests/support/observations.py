"""Observations from values in physical units."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from harness.game.arrays import FloatArray
from harness.game.observation_layout import LAYOUT, SCALES, SIZE


def observation_of(values: Mapping[str, float]) -> FloatArray:
    """[1, SIZE] the observation with these values by name of the entry, the angles of the wheels as shares of the lock.

    There is no stop line and no leader unless the values have one; all other entries are 0.
    """
    view = np.zeros((1, SIZE))
    for name, value in {"stop_line_m": np.inf, "leader_gap_m": np.inf, **values}.items():
        scale = SCALES[name]
        if scale.compressed:
            scaled = value / (abs(value) + scale.scale) if np.isfinite(value) else np.sign(value)
        else:
            scaled = np.clip(value / scale.scale, -1.0, 1.0)
        view[0, LAYOUT.index(name)] = scaled
    return view
