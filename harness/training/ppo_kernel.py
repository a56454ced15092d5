"""The gradient steps of PPO as machine code: losses, gradient, Adam.

For a diagonal Gaussian policy. `harness.training.compiled_ppo` calls it with Stable-Baselines3's numbers; the axes are
those of `harness.training.actor_critic_kernel`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from harness.game.arrays import FloatArray, IntArray
from harness.game.jit import compiled
from harness.training.actor_critic_kernel import HALF_LOG_2PI, Networks, Workspace, backward, forward, log_probabilities

LOSSES = 5
"""Numbers of a gradient step: policy loss, value loss, entropy loss, approximate KL divergence, clipped fraction."""
POLICY_LOSS, VALUE_LOSS, ENTROPY_LOSS, APPROXIMATE_KL, CLIP_FRACTION = range(LOSSES)


class Adam(NamedTuple):
    """The optimiser's state and settings; gradients above `max_norm` are scaled down to it."""

    first_moment: FloatArray
    second_moment: FloatArray
    learning_rate: float
    beta1: float
    beta2: float
    epsilon: float
    max_norm: float


class Samples(NamedTuple):
    """The steps of a rollout, [N, ...]."""

    observations: FloatArray
    actions: FloatArray
    log_probs: FloatArray
    advantages: FloatArray
    returns: FloatArray


class Objective(NamedTuple):
    """The coefficients of PPO's loss."""

    clip: float
    value_coefficient: float
    entropy_coefficient: float


class Update(NamedTuple):
    """What the gradient steps of an update share."""

    networks: Networks
    adam: Adam
    samples: Samples
    objective: Objective
    work: Workspace


@compiled
def gradient(update: Update, chosen: IntArray) -> FloatArray:
    """The losses [LOSSES] of the samples `chosen`; the gradient of PPO's loss is in `work.gradient` afterwards.

    PPO: Schulman et al. 2017, equations 7 and 9, with the details of Stable-Baselines3: advantages are normalised per
    minibatch, and the value loss is the mean squared error to the returns.
    """
    networks, samples, work = update.networks, update.samples, update.work
    size, inputs, axes = len(chosen), samples.observations.shape[1], samples.actions.shape[1]
    observations = work.observations[: size * inputs].reshape(size, inputs)
    for sample in range(size):
        observations[sample] = samples.observations[chosen[sample]]
    _take_advantages(samples, chosen, work.advantages)
    output = forward(networks, observations, work.activations)
    units = networks.actor_units.sum() + networks.critic_units.sum()
    delta = work.deltas[(units - axes - 1) * size : units * size].reshape(axes + 1, size)
    losses = _loss(update, chosen, output, delta)
    backward(networks, observations, work)
    return losses


@compiled
def _take_advantages(samples: Samples, chosen: IntArray, advantages: FloatArray) -> None:
    size = len(chosen)
    total = 0.0
    for sample in range(size):
        advantages[sample] = samples.advantages[chosen[sample]]
        total += advantages[sample]
    if size < 2:
        return
    mean, squares = total / size, 0.0
    for sample in range(size):
        squares += (advantages[sample] - mean) ** 2
    deviation = math.sqrt(squares / (size - 1)) + 1e-8
    for sample in range(size):
        advantages[sample] = np.float32((advantages[sample] - mean) / deviation)


@compiled
def _loss(update: Update, chosen: IntArray, output: FloatArray, delta: FloatArray) -> FloatArray:
    """The losses, and the loss's derivative by the output, in `delta`, and by the log-deviations, in the gradient."""
    samples, objective, work = update.samples, update.objective, update.work
    size, axes = len(chosen), samples.actions.shape[1]
    log_deviation = update.networks.parameters[-axes:]
    by_deviation = work.gradient[-axes:]
    by_deviation[:] = 0.0
    actions = samples.actions[chosen]
    log_probs = log_probabilities(output[:axes], log_deviation, actions)
    variances = np.exp(2.0 * log_deviation.astype(np.float64))
    losses = np.zeros(LOSSES)
    for sample in range(size):
        advantage = work.advantages[sample]
        log_ratio = np.float64(log_probs[sample]) - samples.log_probs[chosen[sample]]
        ratio = math.exp(log_ratio)
        clipped = min(max(ratio, 1.0 - objective.clip), 1.0 + objective.clip)
        surrogate = min(advantage * ratio, advantage * clipped)
        losses[POLICY_LOSS] -= surrogate / size
        losses[APPROXIMATE_KL] += (ratio - 1.0 - log_ratio) / size
        losses[CLIP_FRACTION] += (abs(ratio - 1.0) > objective.clip) / size
        by_log_prob = -advantage * ratio / size if advantage * ratio <= advantage * clipped else 0.0
        for axis in range(axes):
            distance = np.float64(actions[sample, axis]) - output[axis, sample]
            delta[axis, sample] = by_log_prob * distance / variances[axis]
            by_deviation[axis] += np.float32(by_log_prob * (distance * distance / variances[axis] - 1.0))
        error = np.float64(output[axes, sample]) - samples.returns[chosen[sample]]
        losses[VALUE_LOSS] += error * error / size
        delta[axes, sample] = objective.value_coefficient * 2.0 * error / size
    for axis in range(axes):
        losses[ENTROPY_LOSS] -= 0.5 + HALF_LOG_2PI + log_deviation[axis]
        by_deviation[axis] -= np.float32(objective.entropy_coefficient)
    return losses


@compiled
def epoch(update: Update, order: IntArray, minibatch: int, steps: int) -> FloatArray:
    """One pass over the samples in `order` [N], a gradient step per minibatch, after `steps` gradient steps before.

    Returns the losses [minibatches, LOSSES]. One that is not finite is the last, and its gradient step is not taken.
    """
    losses = np.zeros(((len(order) + minibatch - 1) // minibatch, LOSSES))
    for batch in range(len(losses)):
        chosen = order[batch * minibatch : (batch + 1) * minibatch]
        losses[batch] = gradient(update, chosen)
        if not np.isfinite(losses[batch]).all():
            return losses[: batch + 1]
        adam_step(update.networks.parameters, update.work.gradient, update.adam, steps + batch + 1)
    return losses


@compiled
def adam_step(parameters: FloatArray, gradient: FloatArray, adam: Adam, step: int) -> None:
    """Scale the gradient down to the largest norm, and take a step of Adam (Kingma and Ba 2015), the `step`-th."""
    norm = math.sqrt(np.dot(gradient, gradient))
    scale = np.float32(min(adam.max_norm / (norm + 1e-6), 1.0))
    first_rate, second_rate = np.float32(1.0 - adam.beta1), np.float32(1.0 - adam.beta2)
    beta2 = np.float32(adam.beta2)
    size = np.float32(adam.learning_rate / (1.0 - adam.beta1**step))
    correction = np.float32(math.sqrt(1.0 - adam.beta2**step))
    epsilon = np.float32(adam.epsilon)
    first, second = adam.first_moment, adam.second_moment
    for k in range(len(parameters)):
        slope = gradient[k] * scale
        first[k] += (slope - first[k]) * first_rate
        second[k] = second[k] * beta2 + slope * slope * second_rate
        parameters[k] -= size * first[k] / (np.sqrt(second[k]) / correction + epsilon)
