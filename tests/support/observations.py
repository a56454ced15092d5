"""Observations from values in physical units."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium
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


class Recorded(gymnasium.Env[Any, Any]):
    """An environment with the harness's spaces, or discrete actions, and random observations."""

    def __init__(self, discrete: bool = False) -> None:
        self.observation_space = gymnasium.spaces.Box(-1.0, 1.0, (SIZE,), np.float32)
        continuous = gymnasium.spaces.Box(-1.0, 1.0, (2,), np.float32)
        self.action_space = gymnasium.spaces.Discrete(3) if discrete else continuous
        self.random = np.random.default_rng(5)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        return self.random.uniform(0.1, 0.4, SIZE).astype(np.float32), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        return self.reset()[0], float(np.sum(action)), False, False, {}
