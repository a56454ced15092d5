"""A policy saved by Stable-Baselines3 or sb3-contrib as a driver."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from harness.config.driver import StableBaselines3
from harness.drivers.sb3_file import DETERMINISTIC, SAC_LIKE, read_sb3_policy
from harness.errors import UsageError
from harness.game.arrays import FloatArray, IntArray


class Sb3Driver:
    """Drives by a policy of Stable-Baselines3: by its most likely action, or by a sample of its distribution. The state
    of a recurrent policy is kept per game."""

    takes_over = True

    def __init__(self, document: StableBaselines3, file: Path, sampled: bool, normalize: Path | None = None) -> None:
        """Read the policy. Raises UsageError as `read_sb3_policy` does, and if `sampled` is true for a policy without a
        distribution to sample."""
        self._policy, self._scaling, self._gives_index = read_sb3_policy(document, file, normalize)
        deterministic = document.algorithm in DETERMINISTIC
        if sampled and (deterministic or self._gives_index or getattr(self._policy, "use_sde", False)):
            what = f"{document.algorithm}'s policies are deterministic" if deterministic else "gSDE draws its own noise"
            what = "the noise samples no discrete actions" if self._gives_index and not deterministic else what
            remedy = 'give the ego a persona with decisions = "mode"'
            raise UsageError.of(file, "", f"the ego's persona samples its decisions, but {what}", remedy)
        self._sampled, self._squashed = sampled, document.algorithm in SAC_LIKE
        self._actions = np.array(document.actions, dtype=np.float64)
        self._memory = _Memory(self._policy) if document.algorithm == "RecurrentPPO" else None

    def reset(self, games: IntArray) -> None:
        """Reset games [N]: a recurrent policy forgets them; the decisions of others depend on the observation only."""
        if self._memory is not None:
            self._memory.forget(games)

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """Actions [N, 2] from observations [N, SIZE]; `noise` [N, 2] is used if decisions are sampled."""
        inputs = np.asarray(observation, dtype=np.float32)
        if self._scaling is not None:
            inputs = np.asarray(self._scaling.normalize_obs(inputs), dtype=np.float32)
        if not self._sampled:
            action = self._most_likely(games, inputs)
            if self._gives_index:
                return self._actions[np.asarray(action, dtype=np.int64)]
            return np.clip(np.asarray(action, dtype=np.float64), -1.0, 1.0)
        mean, deviation = self._distribution(games, inputs)
        action = mean + deviation * noise
        return np.tanh(action) if self._squashed else np.clip(action, -1.0, 1.0)

    def _most_likely(self, games: IntArray, inputs: FloatArray) -> Any:
        if self._memory is None:
            return self._policy.predict(inputs, deterministic=True)[0]
        state, starts = self._memory.recall(games)
        action, state = self._policy.predict(inputs, state=state, episode_start=starts, deterministic=True)
        self._memory.keep(games, state)
        return action

    def _distribution(self, games: IntArray, inputs: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and deviation [N, 2] of the normal distribution of actions; for SAC before the squashing."""
        import torch

        with torch.no_grad():
            seen = torch.from_numpy(inputs)
            if self._squashed:
                mean, log_deviation, _ = self._policy.actor.get_action_dist_params(seen)
                return mean.double().numpy(), log_deviation.double().exp().numpy()
            if self._memory is None:
                normal = self._policy.get_distribution(seen).distribution
            else:
                state, starts = self._memory.recall(games)
                tensors = tuple(torch.from_numpy(each) for each in state)
                found, new = self._policy.get_distribution(seen, tensors, torch.from_numpy(starts).float())
                self._memory.keep(games, tuple(each.numpy() for each in new))
                normal = found.distribution
            return normal.mean.double().numpy(), normal.stddev.double().numpy()


class _Memory:
    """The state of a recurrent policy in each game: hidden and cell, [layers, units]."""

    def __init__(self, policy: Any) -> None:
        layers, units = policy.lstm_hidden_state_shape[0], policy.lstm_hidden_state_shape[2]
        self._blank = np.zeros((2, layers, units), dtype=np.float32)
        self._of: dict[int, FloatArray] = {}

    def forget(self, games: IntArray) -> None:
        for game in games.tolist():
            self._of.pop(game, None)

    def recall(self, games: IntArray) -> tuple[tuple[FloatArray, FloatArray], FloatArray]:
        """Hidden and cell [layers, N, units], and which games [N] begin."""
        both = np.stack([self._of.get(game, self._blank) for game in games.tolist()], axis=2)
        starts = np.array([game not in self._of for game in games.tolist()])
        return (both[0], both[1]), starts

    def keep(self, games: IntArray, state: tuple[FloatArray, FloatArray]) -> None:
        both = np.stack(state)
        for place, game in enumerate(games.tolist()):
            self._of[game] = both[:, :, place].copy()
