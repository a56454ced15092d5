"""An environment without a simulator, for policies that others train."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np

from harness.game.observation_layout import SIZE


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
