"""Several arenas as one vector environment: a learner that drives in another place of the scene in each of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from harness.environments.vector_env import ACTION_SPACE, OBSERVATION_SPACE, ArenaVecEnv, Finished, GamesVecEnv
from harness.game.arrays import FloatArray


class JoinedVecEnv(GamesVecEnv):
    """The games of several `ArenaVecEnv`, those of the first environment first."""

    def __init__(self, environments: Sequence[ArenaVecEnv]) -> None:
        self.environments = tuple(environments)
        games = [each.num_envs for each in self.environments]
        super().__init__(sum(games), OBSERVATION_SPACE, ACTION_SPACE)
        self._cuts = np.cumsum(games)[:-1]

    def reset(self) -> FloatArray:
        """Reset every game. Returns observations [G, SIZE]."""
        return np.concatenate([each.reset() for each in self.environments])

    def step_async(self, actions: FloatArray) -> None:
        """Store the learner's actions [G, 2] for `step_wait`."""
        for each, own in zip(self.environments, np.split(actions, self._cuts), strict=True):
            each.step_async(own)

    def step_wait(self) -> tuple[FloatArray, FloatArray, Any, list[dict[str, Any]]]:
        """Play a step of every game, as `ArenaVecEnv.step_wait`."""
        steps = [each.step_wait() for each in self.environments]
        observation, payoff, done = (np.concatenate([step[part] for step in steps]) for part in range(3))
        return observation, payoff, done, [info for step in steps for info in step[3]]

    def take_finished(self) -> list[Finished]:
        """The games that ended since the last call, removed from the lists."""
        return [game for each in self.environments for game in each.take_finished()]

    def reload(self, seed: int) -> None:
        """Reload SUMO with a seed, the same in every arena: their games differ by their place."""
        for each in self.environments:
            each.reload(seed)

    def close(self) -> None:
        """Close the SUMO simulations."""
        for each in self.environments:
            each.close()
