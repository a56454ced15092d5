"""Stable-Baselines3's PPO with its gradient steps in machine code (`harness.training.ppo_kernel`).

Rollouts, buffer, minibatches, logging and saving are Stable-Baselines3's, and the numbers of an update are its numbers
but for rounding.
"""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import scipy.linalg.cython_blas  # noqa: F401 - numba's matrix products; loaded before its threads are limited
import torch
from gymnasium.spaces import Box
from stable_baselines3 import PPO
from stable_baselines3.common.buffers import RolloutBuffer
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.utils import explained_variance
from stable_baselines3.common.vec_env import VecEnv
from threadpoolctl import ThreadpoolController

from harness.game.arrays import FloatArray
from harness.training.actor_critic_kernel import forward, log_probabilities, workspace_of
from harness.training.policy_arrays import networks_of, parameter_order, put_vector, vector_of
from harness.training.ppo_kernel import (
    APPROXIMATE_KL,
    CLIP_FRACTION,
    ENTROPY_LOSS,
    POLICY_LOSS,
    VALUE_LOSS,
    Adam,
    Objective,
    Samples,
    Update,
    epoch,
)

_one_thread = ThreadpoolController().wrap(limits=1, user_api="blas")
"""One thread for BLAS: for matrices of this size more threads wait for each other."""


class CompiledPPO(PPO):
    """PPO for the policy that the harness trains: a diagonal Gaussian whose actor and critic have hidden layers of tanh
    units of the same sizes and share none, in float32 on the CPU, by Adam, with normalised advantages, and without
    clipping of values or a largest KL divergence."""

    @_one_thread
    def collect_rollouts(
        self, env: VecEnv, callback: BaseCallback, rollout_buffer: RolloutBuffer, n_rollout_steps: int
    ) -> bool:
        """Play the steps of a rollout, and write them into the buffer.

        Returns whether to go on: false if a callback ended the rollout.
        """
        bounds = cast(Box, self.action_space)
        self.policy.set_training_mode(False)
        rollout_buffer.reset()
        callback.on_rollout_start()
        actor_critic = _ActorCritic(self.policy, env.num_envs)
        for step in range(n_rollout_steps):
            observations = np.asarray(self._last_obs, dtype=np.float32)
            actions, values, log_probs = actor_critic.sample(observations)
            clipped_actions = np.clip(actions, bounds.low, bounds.high)
            step_results: Any = env.step(clipped_actions)
            new_obs, rewards, dones, infos = step_results
            self.num_timesteps += env.num_envs
            callback.update_locals(locals())
            if not callback.on_step():
                return False
            ended = np.flatnonzero(dones)
            self._update_info_buffer([infos[game] for game in ended], dones[ended])
            for game in ended:
                if infos[game].get("TimeLimit.truncated", False):  # the episode goes on, unseen
                    rewards[game] += self.gamma * actor_critic.values(infos[game]["terminal_observation"])[0]
            rollout_buffer.observations[step] = observations
            rollout_buffer.actions[step] = actions
            rollout_buffer.rewards[step] = rewards
            rollout_buffer.episode_starts[step] = self._last_episode_starts
            rollout_buffer.values[step] = values
            rollout_buffer.log_probs[step] = log_probs
            self._last_obs, self._last_episode_starts = new_obs, dones
        rollout_buffer.pos, rollout_buffer.full = n_rollout_steps, True
        values = actor_critic.values(new_obs)
        rollout_buffer.compute_returns_and_advantage(last_values=torch.from_numpy(values), dones=dones)
        callback.update_locals(locals())
        callback.on_rollout_end()
        return True

    @_one_thread
    def train(self) -> None:
        """Update the policy from the rollout buffer.

        Raises FloatingPointError if a loss is not finite.
        """
        self.policy.set_training_mode(True)
        self._update_learning_rate(self.policy.optimizer)
        order = parameter_order(self.policy)
        optimizer = self.policy.optimizer
        networks = networks_of(self.policy)
        state = [optimizer.state[each] for each in order]
        adam, taken = _adam(self, state, len(networks.parameters)), int(state[0]["step"]) if state[0] else 0
        samples = _samples(self)
        minibatch = min(self.batch_size, len(samples.returns))
        objective = Objective(
            clip=float(cast(Any, self.clip_range)(self._current_progress_remaining)),
            value_coefficient=float(self.vf_coef),
            entropy_coefficient=float(self.ent_coef),
        )
        update = Update(networks, adam, samples, objective, workspace_of(networks, minibatch))
        losses: list[FloatArray] = []
        for _ in range(self.n_epochs):
            shuffled = np.random.permutation(len(samples.returns))  # noqa: NPY002 - as SB3 draws it
            of_epoch = epoch(update, shuffled, minibatch, taken)
            losses.append(of_epoch)
            if not np.isfinite(of_epoch).all():
                raise FloatingPointError("a loss of PPO is not finite")
            taken += len(of_epoch)
            self._n_updates += 1
        put_vector(networks.parameters, order)
        for name, moment in (("exp_avg", adam.first_moment), ("exp_avg_sq", adam.second_moment)):
            for each in order:
                optimizer.state[each].setdefault(name, torch.zeros_like(each))
            put_vector(moment, [optimizer.state[each][name] for each in order])
        for each in order:
            optimizer.state[each]["step"] = torch.tensor(float(taken))
        self._log(losses, objective)

    def _log(self, losses: list[FloatArray], objective: Objective) -> None:
        """Record what Stable-Baselines3 records, from the losses [gradient steps, LOSSES] of each epoch."""
        mean = np.concatenate(losses).mean(axis=0)
        policy, value, entropy = losses[-1][-1, [POLICY_LOSS, VALUE_LOSS, ENTROPY_LOSS]]
        record = self.logger.record
        record("train/entropy_loss", mean[ENTROPY_LOSS])
        record("train/policy_gradient_loss", mean[POLICY_LOSS])
        record("train/value_loss", mean[VALUE_LOSS])
        record("train/approx_kl", losses[-1][:, APPROXIMATE_KL].mean())
        record("train/clip_fraction", mean[CLIP_FRACTION])
        record("train/loss", policy + objective.entropy_coefficient * entropy + objective.value_coefficient * value)
        buffer: Any = self.rollout_buffer
        record("train/explained_variance", explained_variance(buffer.values.flatten(), buffer.returns.flatten()))
        record("train/std", torch.exp(cast(Any, self.policy.log_std)).mean().item())
        record("train/n_updates", self._n_updates, exclude="tensorboard")
        record("train/clip_range", objective.clip)


class _ActorCritic:
    def __init__(self, policy: ActorCriticPolicy, games: int) -> None:
        self._networks = networks_of(policy)
        self._activations = workspace_of(self._networks, games).activations
        self._log_deviation = self._networks.parameters[-self._networks.actor_units[-1] :]
        self._deviation = np.exp(self._log_deviation)

    def sample(self, observations: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Actions [G, A], values [G] and the actions' log-probabilities [G] for observations [G, D]."""
        output = forward(self._networks, observations, self._activations)
        mean, shape = output[:-1], (len(observations), len(output) - 1)
        noise = torch.randn(shape).numpy()  # the numbers that torch's distribution draws
        actions = mean.T + noise * self._deviation
        return actions, output[-1].copy(), log_probabilities(mean, self._log_deviation, actions)

    def values(self, observations: FloatArray) -> FloatArray:
        """The values [G] of observations [G, D] or [D]."""
        observations = np.atleast_2d(np.asarray(observations, dtype=np.float32))
        return cast(FloatArray, forward(self._networks, observations, self._activations)[-1].copy())


def _adam(model: PPO, state: list[dict[str, torch.Tensor]], size: int) -> Adam:
    settings = model.policy.optimizer.param_groups[0]

    def moment(name: str) -> FloatArray:
        return vector_of([each[name] for each in state]) if state[0] else np.zeros(size, dtype=np.float32)

    return Adam(
        first_moment=moment("exp_avg"),
        second_moment=moment("exp_avg_sq"),
        learning_rate=float(settings["lr"]),
        beta1=float(settings["betas"][0]),
        beta2=float(settings["betas"][1]),
        epsilon=float(settings["eps"]),
        max_norm=float(model.max_grad_norm),
    )


def _samples(model: PPO) -> Samples:
    """The rollout's samples, in the order in which Stable-Baselines3 numbers them."""
    buffer = model.rollout_buffer
    flat = buffer.swap_and_flatten
    return Samples(
        observations=flat(buffer.observations),
        actions=flat(buffer.actions),
        log_probs=flat(buffer.log_probs)[:, 0],
        advantages=flat(buffer.advantages)[:, 0],
        returns=flat(buffer.returns)[:, 0],
    )
