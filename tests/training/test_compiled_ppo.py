"""The compiled update of PPO: every number is that of Stable-Baselines3 and of autograd, but for rounding."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import Any

import gymnasium
import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.utils import set_random_seed
from stable_baselines3.common.vec_env import DummyVecEnv

from harness.training.actor_critic_kernel import Networks, backward, forward, workspace_of
from harness.training.compiled_ppo import CompiledPPO
from harness.training.policy_arrays import networks_of, parameter_order
from harness.training.ppo_kernel import Adam, Objective, Samples, Update, adam_step, gradient

BOUND = 1e-6
"""Largest difference from autograd and from SB3, of numbers of the order of 1."""


class Chase(gymnasium.Env[Any, Any]):
    """Follow a target that jumps: the payoff is the negative distance. Episodes end or are cut off at random."""

    observation_space = gymnasium.spaces.Box(-1.0, 1.0, (5,), np.float32)
    action_space = gymnasium.spaces.Box(-1.0, 1.0, (2,), np.float32)

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        return self._observe(), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        payoff = -float(np.abs(action - self._observation[:2]).sum())
        ended, cut_off = self.np_random.uniform(size=2) < 0.05
        return self._observe(), payoff, bool(ended), bool(cut_off), {}

    def _observe(self) -> Any:
        self._observation = self.np_random.uniform(-1.0, 1.0, 5).astype(np.float32)
        return self._observation


def learner(kind: type[PPO], **changes: Any) -> PPO:
    """A learner of 4 games, rollouts of 64 steps and minibatches of 24, the last of 16."""
    set_random_seed(1)
    env = DummyVecEnv([Chase] * 4)
    env.seed(7)
    settings_of = {
        "n_steps": 16,
        "batch_size": 24,
        "n_epochs": 2,
        "learning_rate": 3e-4,
        "clip_range": 0.1,
        "ent_coef": 0.02,
        "policy_kwargs": {"net_arch": [16, 8], "log_std_init": -0.7},
        **changes,
    }
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "You have specified a mini-batch size")
        model = kind("MlpPolicy", env, device="cpu", **settings_of)
    model.set_logger(Logger(None, []))
    return model


def differences(one: PPO, other: PPO) -> list[float]:
    """The largest difference of each parameter, and of the optimiser's state."""
    pairs = list(zip(one.policy.parameters(), other.policy.parameters(), strict=True))
    states = [(one.policy.optimizer.state[a], other.policy.optimizer.state[b]) for a, b in pairs]
    tensors = [*pairs, *((a[name], b[name]) for a, b in states for name in ("step", "exp_avg", "exp_avg_sq"))]
    return [float((a - b).detach().abs().max()) for a, b in tensors]


def trained(steps: int, **changes: Any) -> list[PPO]:
    """Learners of both kinds, trained from the same state."""
    models = [learner(kind, **changes) for kind in (PPO, CompiledPPO)]
    for model in models:
        set_random_seed(2)
        model.learn(steps)
    return models


# --- from the same state ---


@pytest.mark.parametrize(("network", "updates"), [([16, 8], 100), ([16], 10), ([8, 8, 4], 10)], ids=str)
def test_learn__updates_are_those_of_stable_baselines3(network: list[int], updates: int) -> None:
    changes = {"policy_kwargs": {"net_arch": network, "log_std_init": -0.7}}
    models = trained(updates * 64, **changes)
    assert models[0]._n_updates == models[1]._n_updates == 2 * updates
    assert max(differences(*models)) < 10 * BOUND  # differences of single steps add up
    before, after = (each.policy.mlp_extractor.policy_net[0].weight for each in (learner(PPO, **changes), models[0]))
    assert float((after - before).detach().abs().max()) > 1000 * BOUND


def test_learn__logs_what_stable_baselines3_logs() -> None:
    expected, found = (
        {name: float(value) for name, value in model.logger.name_to_value.items() if name.startswith("train/")}
        for model in trained(3 * 64)
    )
    assert {"train/loss", "train/approx_kl", "train/clip_fraction"} <= expected.keys()
    assert found == pytest.approx(expected, abs=1e-5)


def test_learn__the_rollout_is_that_of_stable_baselines3() -> None:
    models = trained(2 * 64, learning_rate=0.0)  # the buffer is that of the last rollout
    columns = "observations actions rewards episode_starts values log_probs advantages returns"
    for name in columns.split():
        one, other = (getattr(each.rollout_buffer, name).reshape(64, -1) for each in models)
        one, other = (np.sort(each, axis=0) for each in (one, other))  # SB3's is in the order of its minibatches
        assert other == pytest.approx(one, abs=10 * BOUND), name
    assert models[1].rollout_buffer.episode_starts.any()


def test_learn__a_callback_ends_the_rollout() -> None:
    class Stop(BaseCallback):
        def _on_step(self) -> bool:
            return self.n_calls < 5

    model = learner(CompiledPPO)
    model.learn(64, callback=Stop())
    assert model.num_timesteps == 5 * 4
    assert model._n_updates == 0


def test_learn__a_loss_that_is_not_finite_ends_it() -> None:
    model = learner(CompiledPPO)
    with torch.no_grad():
        model.policy.value_net.weight[0, 0] = float("nan")
    with pytest.raises(FloatingPointError, match="loss"):
        model.learn(64)


# --- the kernel, term by term ---


def samples_of(random: np.random.Generator, count: int, model: PPO) -> Samples:
    """Samples whose probability ratios are on both sides of the clip range, with advantages of both signs."""
    observations = random.uniform(-1.0, 1.0, (count, 5)).astype(np.float32)
    with torch.no_grad():
        actions, _, log_probs = model.policy(torch.from_numpy(observations))
    return Samples(
        observations=observations,
        actions=actions.numpy(),
        log_probs=(log_probs.numpy() + random.normal(0.0, 0.15, count)).astype(np.float32),
        advantages=random.standard_normal(count).astype(np.float32),
        returns=random.standard_normal(count).astype(np.float32),
    )


def loss_of_autograd(model: PPO, samples: Samples, objective: Objective) -> tuple[torch.Tensor, ...]:
    """Equations 7 and 9 of the paper of PPO, term by term: policy, value, entropy."""
    values, log_probs, entropy = model.policy.evaluate_actions(
        torch.from_numpy(samples.observations), torch.from_numpy(samples.actions)
    )
    advantages = torch.from_numpy(samples.advantages)
    if len(advantages) > 1:
        advantages = (advantages - advantages.mean()) / (advantages.std() + 1e-8)
    ratio = torch.exp(log_probs - torch.from_numpy(samples.log_probs))
    clipped = torch.clamp(ratio, 1.0 - objective.clip, 1.0 + objective.clip)
    policy = -torch.min(advantages * ratio, advantages * clipped).mean()
    value = torch.nn.functional.mse_loss(torch.from_numpy(samples.returns), values.flatten())
    assert entropy is not None
    return policy, value, -entropy.mean()


TERMS = {"policy": (1.0, 0.0, 0.0), "value": (0.0, 1.0, 0.0), "entropy": (0.0, 0.0, 1.0), "all": (1.0, 0.5, 0.02)}


@pytest.mark.parametrize("term", TERMS)
@settings(max_examples=15, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10_000), count=st.integers(1, 40) | st.just(512), clip=st.sampled_from([0.05, 0.1, 0.3]))
def test_gradient__of_each_term_is_that_of_autograd(term: str, seed: int, count: int, clip: float) -> None:
    """A mean over few samples has the rounding of single samples, in autograd as well."""
    bound = BOUND if count == 512 else 10 * BOUND
    random = np.random.default_rng(seed)
    model = learner(CompiledPPO)
    policy_weight, value_weight, entropy_weight = TERMS[term]
    samples = samples_of(random, count, model)
    if not policy_weight:
        samples = samples._replace(advantages=np.zeros(count, dtype=np.float32))
    objective = Objective(
        clip=clip,
        value_coefficient=value_weight,
        entropy_coefficient=entropy_weight,
    )
    policy, value, entropy = loss_of_autograd(model, samples, objective)
    (policy + value_weight * value + entropy_weight * entropy).backward()
    order = parameter_order(model.policy)
    expected = np.concatenate(
        [(np.zeros(each.shape) if each.grad is None else each.grad.numpy()).ravel() for each in order]
    )

    networks = networks_of(model.policy)
    work = workspace_of(networks, count)
    losses = gradient(Update(networks, adam(0), samples, objective, work), np.arange(count))

    assert losses[:3] == pytest.approx([policy.item(), value.item(), entropy.item()], abs=bound)
    assert np.abs(work.gradient - expected).max() <= bound


def test_forward__tanh_is_exact_to_float32_over_its_whole_range() -> None:
    """One unit passes its input on: the output is the tanh of the observation."""
    x = np.concatenate([np.linspace(-12.0, 12.0, 20_001), [-1e30, 0.0, 1e30]]).astype(np.float32)
    ones = np.array([1, 1])
    # layer 1: weights of actor and critic, biases; layer 2: the same; the log-deviation
    parameters = np.array([1, 1, 0, 0, 1, 1, 0, 0, 0], dtype=np.float32)
    networks = Networks(parameters=parameters, actor_units=ones, critic_units=ones, inputs=ones)
    output = forward(networks, x[:, None], workspace_of(networks, len(x)).activations)
    assert np.abs(output[0] - np.tanh(x.astype(np.float64))).max() < 4e-7


def test_backward__by_hand() -> None:
    """Actor and critic of one unit each: output = w₂ tanh(w₁ x + b₁) + b₂."""
    ones = np.array([1, 1])
    parameters = np.array([0.5, -1.0, 0.1, 0.2, 2.0, 3.0, 0.0, 0.0, 0.0], dtype=np.float32)
    networks = Networks(parameters=parameters, actor_units=ones, critic_units=ones, inputs=ones)
    work = workspace_of(networks, 1)
    x = np.array([[0.4]], dtype=np.float32)
    forward(networks, x, work.activations)
    work.deltas[-2:] = [1.0, 10.0]  # the loss's derivatives by the outputs
    backward(networks, x, work)
    actor, critic = np.tanh(0.5 * 0.4 + 0.1), np.tanh(-1.0 * 0.4 + 0.2)
    by_actor, by_critic = 2.0 * (1.0 - actor**2), 10.0 * 3.0 * (1.0 - critic**2)
    expected = [by_actor * 0.4, by_critic * 0.4, by_actor, by_critic, actor, 10.0 * critic, 1.0, 10.0, 0.0]
    assert work.gradient == pytest.approx(expected, abs=BOUND)


def adam(size: int, **changes: Any) -> Adam:
    moments = {"first_moment": np.zeros(size, dtype=np.float32), "second_moment": np.zeros(size, dtype=np.float32)}
    settings_of = {"learning_rate": 0.1, "beta1": 0.9, "beta2": 0.999, "epsilon": 1e-5, "max_norm": 1e9}
    return Adam(**{**moments, **settings_of, **changes})


def test_adam_step__a_long_gradient_is_scaled_down() -> None:
    state = adam(2, max_norm=0.5)
    adam_step(np.zeros(2, dtype=np.float32), np.array([3.0, 4.0], dtype=np.float32), state, 1)
    assert state.first_moment == pytest.approx([0.1 * 0.3, 0.1 * 0.4], abs=BOUND)


@pytest.fixture(autouse=True)
def _one_thread() -> Iterator[None]:
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)
