"""The arena as the vector environment Stable-Baselines3 trains on: one learner, G games, restarted as they end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from stable_baselines3.common.vec_env import VecEnv

from harness.drivers.policy_file import ACTIONS
from harness.environments.arena import Arena
from harness.environments.auto_reset import AutoReset
from harness.game.arrays import FloatArray
from harness.game.initial_state import StartDistribution
from harness.game.observation import SIZE
from harness.game.state import Outcome

OBSERVATION_SPACE = gymnasium.spaces.Box(-1.0, 1.0, (SIZE,), np.float32)
ACTION_SPACE = gymnasium.spaces.Box(-1.0, 1.0, (ACTIONS,), np.float32)


@dataclass(frozen=True)
class Finished:
    """A learner's finished game."""

    payoff: float
    steps: int
    outcome: Outcome


class ArenaVecEnv(VecEnv):
    """G games of one learner, as SB3 wants them. A game ends with the learner's part in it.

    Each game is drawn from `parts`, the number of its tile and how many games that tile has had. Rewards are payoffs
    times `payoff_scale`.
    """

    render_mode = None

    def __init__(
        self,
        arena: Arena,
        learner: int,
        start_distribution: StartDistribution,
        *parts: str | int,
        payoff_scale: float = 1.0,
    ) -> None:
        super().__init__(arena.games, OBSERVATION_SPACE, ACTION_SPACE)
        self.arena, self._learner, self._payoff_scale = arena, learner, payoff_scale
        self._actions = np.zeros((arena.games, len(arena.seats), ACTIONS))
        self._finished: list[Finished] = []
        self.sample_from(start_distribution, *parts)

    def sample_from(self, start_distribution: StartDistribution, *parts: str | int) -> None:
        """Draw the games to come like this, from these named parts; `reset` starts them."""
        self._games = AutoReset(self.arena, start_distribution, *parts)
        self._payoff = np.zeros(self.num_envs)

    def reset(self) -> FloatArray:
        """Start every game anew: observations [G, SIZE]."""
        self._games.reset(range(self.num_envs))
        return self.arena.observation[:, self._learner].copy()

    def step_async(self, actions: FloatArray) -> None:
        """Take the learner's actions [G, 2]."""
        self._actions[:, self._learner] = actions

    def step_wait(self) -> tuple[FloatArray, FloatArray, Any, list[dict[str, Any]]]:
        """Play a step; ended games restart at once, their last observation in `infos` as SB3 expects it.

        Raises as `Arena.step` does.
        """
        step = self.arena.step(self._actions)
        payoff = step.payoff[:, self._learner].astype(np.float32)
        self._payoff += payoff
        done = ~self.arena.state.running[:, self._learner]
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        ended = np.flatnonzero(done)
        if len(ended):
            for game in ended:
                infos[game] = {"terminal_observation": self.arena.observation[game, self._learner].copy()}
                self._finish(int(game))
            self._games.reset(ended.tolist())
        return self.arena.observation[:, self._learner].copy(), payoff * self._payoff_scale, done, infos

    def take_finished(self) -> list[Finished]:
        """The games that ended since the last call."""
        finished, self._finished = self._finished, []
        return finished

    def close(self) -> None:
        """Give SUMO back."""
        self.arena.close()

    def _finish(self, game: int) -> None:
        state = self.arena.state
        outcome = Outcome(int(state.outcome[game, self._learner]))
        self._finished.append(Finished(float(self._payoff[game]), int(state.step[game]), outcome))
        self._payoff[game] = 0.0

    # --- what SB3 asks of a vector environment and an arena has not ----------------------------------------------

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """The attribute once for each game asked for."""
        return [getattr(self, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Raises AttributeError: the games have nothing of their own to set."""
        raise AttributeError(f"an arena's games share everything; {attr_name!r} can't be set for some of them")

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        """Call a method once for each game asked for."""
        method: Callable[..., Any] = getattr(self, method_name)
        return [method(*args, **kwargs) for _ in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """Games are not wrapped."""
        return [False for _ in self._get_indices(indices)]
