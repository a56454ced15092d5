"""Checkers and learners that others wrote, on the environments: a checker finds nothing, a learner learns.

More learners are in `tests/drivers/test_sb3_policy.py`, where SAC, TD3, DDPG, TQC, PPO and A2C train on the environment
before their policies drive.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest
import torch
from gymnasium.spaces import Discrete
from gymnasium.wrappers import TransformAction
from gymnasium.wrappers.vector import ClipAction, NormalizeReward, RecordEpisodeStatistics
from pettingzoo.test import api_test
from pettingzoo.utils.conversions import parallel_to_aec
from sb3_contrib import RecurrentPPO
from stable_baselines3 import DQN
from stable_baselines3.common.env_checker import check_env

from harness import DrivingEnv, OpenScene, ParallelDrivingEnv, VectorDrivingEnv

torch.set_num_threads(1)  # tiny networks: more threads only wait for each other

Open = Callable[..., Any]
CHOICES = np.array([[-1.0, 0.0], [0.0, 0.0], [1.0, 0.0]], dtype=np.float32)
"""Pedals and wheel of each of three discrete actions."""


# --- checkers ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["harness/Ego-v0", "harness/NonEgo-v0"])
def test_sb3_checker__finds_nothing(opened: Open, name: str) -> None:
    environment = opened(gymnasium.make, name, other="sumo")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(environment, warn=True, skip_render_check=True)  # the window has a test of its own


@pytest.mark.filterwarnings("error", "ignore:We recommend agents to be named")
def test_pettingzoo_checker__finds_nothing_where_agents_take_turns(opened: Open) -> None:
    """PettingZoo's own conversion to its other interface, in which agents act one after the other."""
    api_test(parallel_to_aec(opened(ParallelDrivingEnv)), num_cycles=100)


# --- learners ---------------------------------------------------------------------------------------------------------


def weights_of(model: Any) -> np.ndarray:
    """All weights of a model's policy, as one array."""
    return np.concatenate([each.detach().numpy().ravel() for each in model.policy.parameters()])


@pytest.mark.parametrize("name", ["RecurrentPPO", "DQN"])
def test_learner__learns(name: str, opened: Open, short: OpenScene) -> None:
    game = opened(DrivingEnv, scene=short, other="sumo")
    model: Any
    if name == "DQN":
        discrete = TransformAction(game, lambda index: CHOICES[index], Discrete(len(CHOICES)))
        model = DQN("MlpPolicy", discrete, learning_starts=32, batch_size=16, buffer_size=200, seed=1)
    else:
        sizes = {"net_arch": [16], "lstm_hidden_size": 8}
        model = RecurrentPPO("MlpLstmPolicy", game, n_steps=64, batch_size=32, n_epochs=1, policy_kwargs=sizes, seed=1)
    before = weights_of(model)
    model.learn(128)
    assert np.isfinite(weights_of(model)).all()
    assert (weights_of(model) != before).any()


class ActorCritic(torch.nn.Module):
    """A Gaussian policy and a value, in one file as CleanRL's are."""

    def __init__(self, observations: int, actions: int) -> None:
        super().__init__()
        self.mean = torch.nn.Sequential(
            torch.nn.Linear(observations, 16), torch.nn.Tanh(), torch.nn.Linear(16, actions)
        )
        self.value = torch.nn.Sequential(torch.nn.Linear(observations, 16), torch.nn.Tanh(), torch.nn.Linear(16, 1))
        self.log_deviation = torch.nn.Parameter(torch.full((actions,), -0.5))

    def distribution(self, observations: torch.Tensor) -> torch.distributions.Normal:
        return torch.distributions.Normal(self.mean(observations), self.log_deviation.exp())


def test_loop_of_ones_own__learns_on_many_games_at_once(opened: Open, short: OpenScene) -> None:
    """The loop of CleanRL's PPO for continuous actions on a vector environment, with Gymnasium's wrappers."""
    torch.manual_seed(1)
    games = RecordEpisodeStatistics(opened(VectorDrivingEnv, 8, scene=short, other="sumo"))
    games = NormalizeReward(ClipAction(games), gamma=0.99)
    agent = ActorCritic(games.single_observation_space.shape[0], games.single_action_space.shape[0])
    optimiser = torch.optim.Adam(agent.parameters(), lr=1e-3)
    observation, _ = games.reset(seed=1)
    returns: list[float] = []
    losses = []
    for _ in range(2):
        seen, taken, rewards, ends = [], [], [], []
        for _ in range(40):  # a game lasts 30 steps
            seen.append(torch.as_tensor(observation, dtype=torch.float32))
            with torch.no_grad():
                taken.append(agent.distribution(seen[-1]).sample())
            observation, reward, terminated, truncated, info = games.step(taken[-1].numpy())
            rewards.append(torch.as_tensor(reward, dtype=torch.float32))
            ends.append(torch.as_tensor(terminated | truncated, dtype=torch.float32))
            if "episode" in info:
                returns += info["episode"]["r"][info["_episode"]].tolist()
        wanted = [agent.value(torch.as_tensor(observation, dtype=torch.float32)).squeeze(1).detach()]
        for reward, end in zip(reversed(rewards), reversed(ends), strict=True):
            wanted.insert(0, reward + 0.99 * wanted[0] * (1.0 - end))
        at, action, target = torch.cat(seen), torch.cat(taken), torch.cat(wanted[:-1])
        value = agent.value(at).squeeze(1)
        likelihood = agent.distribution(at).log_prob(action).sum(1)
        loss = -(likelihood * (target - value).detach()).mean() + (target - value).square().mean()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        losses.append(loss.item())
    assert np.isfinite(losses).all()
    assert len(returns) >= 16  # 80 steps of 8 games that last 30 steps at most
    assert np.isfinite(returns).all()
