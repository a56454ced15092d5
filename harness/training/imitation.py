"""Imitation of a rule-based driver by a new policy, before its training (behaviour cloning).

An untrained driver ends nearly all games at the rail. Where the road bends, the first thing that it learns from its
payoff is to stand still, because that costs less, and it may never learn to drive. So a new policy first imitates an
adaptive cruise control with lane keeping; on foot it imitates an ordinary walker. Noise is added to what the
demonstrator does, so that its corrections are seen as well (Laskey et al. 2017, DART). The critic learns the discounted
payoffs of the same games. Everything after that is learned from the payoff alone.
"""

from __future__ import annotations

import numpy as np
import torch
from stable_baselines3 import PPO

from harness.drivers.rules_driver import lane_keeper
from harness.environments.vector_env import JoinedVecEnv
from harness.game.arrays import BoolArray, FloatArray
from harness.game.observation_layout import SIZE

_EPOCHS, _MINIBATCH, _LEARNING_RATE = 30, 512, 1e-3


def imitate(model: PPO, environment: JoinedVecEnv, *, steps: int, deviation: float, seed: int) -> None:
    """Fit a new model's actor to the demonstrator's actions, and its critic to the payoffs, in `steps` steps over all
    games. The noise added to an action has the standard deviation `deviation`, which is that of the new policy.

    Raises SimulationError if SUMO fails, FloatingPointError if a number of a game is impossible.
    """
    rounds = steps // environment.num_envs
    if not rounds:
        return
    noise = np.random.default_rng(seed)
    observations, actions, returns = _demonstrate(
        environment, rounds, discount=model.gamma, deviation=deviation, noise=noise
    )
    _fit(model, observations, actions, returns, order=torch.Generator().manual_seed(seed))


def _demonstrate(
    environment: JoinedVecEnv, rounds: int, *, discount: float, deviation: float, noise: np.random.Generator
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """What the learner saw [N, D], what the demonstrators did [N, 2], without the noise, in so many steps of every
    game, and their returns [N]; NaN in games that had not ended."""
    drivers = [lane_keeper(each.arena.world, each.learner) for each in environment.environments]
    games = [np.arange(each.num_envs) for each in environment.environments]
    for driver, own in zip(drivers, games, strict=True):
        driver.reset(own)
    observation = environment.reset()
    observations, actions, payoffs, ended = [], [], [], []
    for _ in range(rounds):
        of_drivers = zip(drivers, games, environment.split(observation), strict=True)
        decided = [driver.decide(own, seen[:, :SIZE], np.zeros((len(own), 2))) for driver, own, seen in of_drivers]
        wanted = np.concatenate(decided)
        observations.append(observation)
        actions.append(wanted)
        environment.step_async(np.clip(wanted + noise.normal(0.0, deviation, wanted.shape), -1.0, 1.0))
        observation, payoff, done, _ = environment.step_wait()
        payoffs.append(payoff)
        ended.append(done)
        for driver, own in zip(drivers, environment.split(done), strict=True):
            driver.reset(np.flatnonzero(own))
    environment.take_finished()  # they are not games of the training
    returns = returns_of(np.array(payoffs), np.array(ended), discount)
    return np.concatenate(observations), np.concatenate(actions), returns.ravel()


def returns_of(payoffs: FloatArray, ended: BoolArray, discount: float) -> FloatArray:
    """[T, G] sum of the payoffs [T, G] from each step to the end of its game, each step discounted once more.

    `ended` [T, G] marks the last steps of games. NaN where the game had not ended after T steps.

    >>> returns_of(np.array([[1.0], [2.0], [4.0], [8.0]]), np.array([[False], [False], [True], [False]]), 0.5).ravel()
    array([ 3.,  4.,  4., nan])
    """
    returns = np.empty(payoffs.shape)
    after = np.full(payoffs.shape[1], np.nan)
    for step in reversed(range(len(payoffs))):
        after = payoffs[step] + discount * np.where(ended[step], 0.0, after)
        returns[step] = after
    return returns


def _fit(model: PPO, *shown: FloatArray, order: torch.Generator) -> None:
    """Fit actor and critic to observations, actions and returns by Adam, with a step size that falls to zero. The
    training has an optimiser of its own."""
    observations, actions, returns = (torch.from_numpy(each).float() for each in shown)
    known = torch.isfinite(returns)
    returns = torch.where(known, returns, 0.0)
    policy = model.policy
    optimizer = torch.optim.Adam(policy.parameters(), lr=_LEARNING_RATE)
    schedule = torch.optim.lr_scheduler.LinearLR(optimizer, 1.0, 1.0 / _EPOCHS, total_iters=_EPOCHS)
    for _ in range(_EPOCHS):
        for batch in torch.randperm(len(observations), generator=order).split(_MINIBATCH):
            actor, critic = policy.mlp_extractor(observations[batch])
            wrong = (policy.action_net(actor) - actions[batch]).square().mean()
            misjudged = ((policy.value_net(critic)[:, 0] - returns[batch]).square() * known[batch]).mean()
            optimizer.zero_grad()
            (wrong + misjudged).backward()
            optimizer.step()
        schedule.step()
