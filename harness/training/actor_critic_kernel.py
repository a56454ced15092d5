"""Actor and critic as machine code: their output, and the gradient by their parameters.

Two networks with the same hidden layers of tanh units, no layer shared, in float32. The matrix products are those of
SciPy's BLAS.

B is the size of a minibatch, D of an observation, A of an action, L the number of layers of each network, the output
included. Activations are [units, B], the actor's units first: those of each network are contiguous, and the first
layer, in which both networks have the same inputs, is one product.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from harness.game.arrays import FloatArray, IntArray
from harness.game.jit import compiled

HALF_LOG_2PI = 0.5 * math.log(2.0 * math.pi)


class Networks(NamedTuple):
    """Actor and critic. `parameters` has, layer by layer: the actor's weights [units, inputs], the critic's, the
    actor's biases, the critic's; and at its end the logarithms of the action's standard deviations [A]."""

    parameters: FloatArray
    actor_units: IntArray
    """[L]"""
    critic_units: IntArray
    """[L]"""
    inputs: IntArray
    """[L], of a unit of each layer."""


class Workspace(NamedTuple):
    """Arrays that gradient steps overwrite; `workspace_of` makes them."""

    gradient: FloatArray
    activations: FloatArray
    deltas: FloatArray
    observations: FloatArray
    advantages: FloatArray
    ones: FloatArray


def workspace_of(networks: Networks, minibatch: int) -> Workspace:
    """A workspace for minibatches of up to `minibatch` samples."""
    units = int((networks.actor_units + networks.critic_units).sum()) * minibatch
    return Workspace(
        gradient=np.zeros_like(networks.parameters),
        activations=np.zeros(units, dtype=np.float32),
        deltas=np.zeros(units, dtype=np.float32),
        observations=np.zeros(int(networks.inputs[0]) * minibatch, dtype=np.float32),
        advantages=np.zeros(minibatch, dtype=np.float32),
        ones=np.ones(minibatch, dtype=np.float32),
    )


@compiled
def forward(networks: Networks, observations: FloatArray, activations: FloatArray) -> FloatArray:
    """The output [A + 1, B] for observations [B, D]: the action's mean, and the value in the last row.

    It is the last part of `activations`, which holds the units of every layer afterwards.
    """
    size = observations.shape[0]
    weight, unit = 0, 0
    below = activations[:0].reshape(0, size)
    for layer in range(len(networks.inputs)):
        actor, critic = networks.actor_units[layer], networks.critic_units[layer]
        inputs, units = networks.inputs[layer], actor + critic
        weights = networks.parameters[weight : weight + units * inputs].reshape(units, inputs)
        weight += units * inputs
        biases = networks.parameters[weight : weight + units]
        weight += units
        here = activations[unit * size : (unit + units) * size].reshape(units, size)
        unit += units
        if layer == 0:
            np.dot(weights, observations.T, here)
        else:
            np.dot(weights[:actor], below[:inputs], here[:actor])
            np.dot(weights[actor:], below[inputs:], here[actor:])
        _activate(here, biases, layer < len(networks.inputs) - 1)
        below = here
    return below


@compiled
def _activate(units: FloatArray, biases: FloatArray, hidden: bool) -> None:
    """Add the biases, in place; of hidden units take tanh.

    tanh is a rational minimax approximation on ±9, beyond which it is 1 in float32: x p(x²) / q(x²), with the
    coefficients that the Eigen library uses. Its error is below 4e-7; unlike the C library's it is vectorised.
    """
    for unit in range(units.shape[0]):
        bias = biases[unit]
        row = units[unit]
        if not hidden:
            for sample in range(len(row)):
                row[sample] += bias
            continue
        for sample in range(len(row)):
            x = min(max(row[sample] + bias, np.float32(-9.0)), np.float32(9.0))
            x2 = x * x
            p = np.float32(-2.76076847742355e-16) * x2 + np.float32(2.00018790482477e-13)
            p = p * x2 + np.float32(-8.60467152213735e-11)
            p = p * x2 + np.float32(5.12229709037114e-08)
            p = p * x2 + np.float32(1.48572235717979e-05)
            p = p * x2 + np.float32(6.37261928875436e-04)
            p = p * x2 + np.float32(4.89352455891786e-03)
            q = np.float32(1.19825839466702e-06) * x2 + np.float32(1.18534705686654e-04)
            q = q * x2 + np.float32(2.26843463243900e-03)
            q = q * x2 + np.float32(4.89352518554385e-03)
            row[sample] = x * p / q


@compiled
def log_probabilities(mean: FloatArray, log_deviation: FloatArray, actions: FloatArray) -> FloatArray:
    """Log-probability [B] of actions [B, A] in normal distributions of means [A, B] and log-deviations [A]."""
    result = np.zeros(actions.shape[0], dtype=np.float32)
    for axis in range(len(log_deviation)):
        per_deviation = math.exp(-log_deviation[axis])
        constant = log_deviation[axis] + HALF_LOG_2PI
        for sample in range(len(result)):
            z = (actions[sample, axis] - mean[axis, sample]) * per_deviation
            result[sample] -= np.float32(0.5 * z * z + constant)
    return result


@compiled
def backward(networks: Networks, observations: FloatArray, work: Workspace) -> None:
    """The gradient by weights and biases, from the derivatives by the output at the end of `work.deltas`."""
    size = observations.shape[0]
    weight = len(networks.parameters) - networks.actor_units[-1]
    unit = networks.actor_units.sum() + networks.critic_units.sum()
    for layer in range(len(networks.inputs) - 1, -1, -1):
        actor, critic = networks.actor_units[layer], networks.critic_units[layer]
        inputs, units = networks.inputs[layer], actor + critic
        delta = work.deltas[(unit - units) * size : unit * size].reshape(units, size)
        np.dot(delta, work.ones[:size], work.gradient[weight - units : weight])
        weight -= units + units * inputs
        by_weights = work.gradient[weight : weight + units * inputs].reshape(units, inputs)
        unit -= units
        if layer == 0:
            np.dot(delta, observations, by_weights)
            return
        weights = networks.parameters[weight : weight + units * inputs].reshape(units, inputs)
        below = work.activations[(unit - 2 * inputs) * size : unit * size].reshape(2 * inputs, size)
        delta_below = work.deltas[(unit - 2 * inputs) * size : unit * size].reshape(2 * inputs, size)
        np.dot(delta[:actor], below[:inputs].T, by_weights[:actor])
        np.dot(delta[actor:], below[inputs:].T, by_weights[actor:])
        np.dot(weights[:actor].T, delta[:actor], delta_below[:inputs])
        np.dot(weights[actor:].T, delta[actor:], delta_below[inputs:])
        one = np.float32(1.0)
        for row in range(2 * inputs):
            for sample in range(size):
                delta_below[row, sample] *= one - below[row, sample] * below[row, sample]
