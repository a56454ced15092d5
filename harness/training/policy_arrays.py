"""Stable-Baselines3's policy as arrays: for a policy's file, for the kernels, and back."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.policies import ActorCriticPolicy

from harness.drivers.policy_file import Policy
from harness.game.arrays import FloatArray
from harness.training.actor_critic_kernel import Networks


def layers_of(policy: ActorCriticPolicy) -> dict[str, list[torch.nn.Linear]]:
    """The layers of the actor and of the critic, the output last."""
    parts: Any = policy
    networks = {"actor": (parts.mlp_extractor.policy_net, parts.action_net)}
    networks["critic"] = (parts.mlp_extractor.value_net, parts.value_net)
    return {
        part: [*(each for each in hidden if isinstance(each, torch.nn.Linear)), output]
        for part, (hidden, output) in networks.items()
    }


def policy_of(model: PPO, card: dict[str, Any]) -> Policy:
    """The learner's policy, with the metadata `card`."""
    deviation: Any = model.policy.log_std
    tensors = {"log_deviation": deviation.detach().numpy().copy()}
    for part, layers in layers_of(model.policy).items():
        for k, layer in enumerate(layers):
            tensors[f"{part}.{k}.weight"] = layer.weight.detach().numpy().copy()
            tensors[f"{part}.{k}.bias"] = layer.bias.detach().numpy().copy()
    return Policy(tensors, card)


def put_policy(model: PPO, policy: Policy, deviation: float) -> None:
    """Copy a policy's networks into a learner, and set the standard deviation of its actions to `deviation`. Raises
    ValueError if the networks do not fit."""
    log_deviation: Any = model.policy.log_std
    with torch.no_grad():
        for part, layers in layers_of(model.policy).items():
            initial = policy.layers(part)
            if [weight.shape for weight, _ in initial] != [layer.weight.shape for layer in layers]:
                raise ValueError(f"the initial {part} has other layer sizes than this training's network")
            for layer, (weight, bias) in zip(layers, initial, strict=True):
                layer.weight.copy_(torch.from_numpy(weight))
                layer.bias.copy_(torch.from_numpy(bias))
        log_deviation.fill_(float(np.log(deviation)))


def networks_of(policy: ActorCriticPolicy) -> Networks:
    """A copy of the policy's networks, as `ppo_kernel` takes them."""
    actor, critic = layers_of(policy).values()
    return Networks(
        parameters=vector_of(parameter_order(policy)),
        actor_units=np.array([layer.out_features for layer in actor]),
        critic_units=np.array([layer.out_features for layer in critic]),
        inputs=np.array([layer.in_features for layer in actor]),
    )


def parameter_order(policy: ActorCriticPolicy) -> list[torch.Tensor]:
    """The policy's parameters in the order of `Networks.parameters`."""
    order: list[Any] = []
    for actor, critic in zip(*layers_of(policy).values(), strict=True):
        order += [actor.weight, critic.weight, actor.bias, critic.bias]
    return [*order, policy.log_std]


def vector_of(tensors: Sequence[torch.Tensor]) -> FloatArray:
    """The entries of tensors, one tensor after the other."""
    return np.concatenate([each.detach().numpy().ravel() for each in tensors])


def put_vector(vector: FloatArray, tensors: Sequence[torch.Tensor]) -> None:
    """Copy a vector's parts into tensors, in place."""
    ends = np.cumsum([0, *(each.numel() for each in tensors)])
    with torch.no_grad():
        for tensor, (start, end) in zip(tensors, pairwise(ends), strict=True):
            tensor.copy_(torch.from_numpy(vector[start:end]).reshape(tensor.shape))
