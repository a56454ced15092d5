"""Stable-Baselines3's policy as the arrays of the kernels, and back."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, cast

import numpy as np
import torch
from stable_baselines3.common.policies import ActorCriticPolicy

from harness.game.arrays import FloatArray
from harness.training.actor_critic_kernel import Networks


def networks_of(policy: ActorCriticPolicy) -> Networks:
    """A copy of the policy's networks, as `ppo_kernel` takes them."""
    extractor: Any = policy.mlp_extractor
    layers = [*zip(_linear(extractor.policy_net), _linear(extractor.value_net), strict=True)]
    layers.append((cast(Any, policy.action_net), cast(Any, policy.value_net)))
    return Networks(
        parameters=vector_of(parameter_order(policy)),
        actor_units=np.array([actor.out_features for actor, _ in layers]),
        critic_units=np.array([critic.out_features for _, critic in layers]),
        inputs=np.array([actor.in_features for actor, _ in layers]),
    )


def parameter_order(policy: ActorCriticPolicy) -> list[torch.Tensor]:
    """The policy's parameters in the order of `Networks.parameters`."""
    extractor: Any = policy.mlp_extractor
    layers = [*zip(_linear(extractor.policy_net), _linear(extractor.value_net), strict=True)]
    order: list[Any] = []
    for actor, critic in [*layers, (policy.action_net, policy.value_net)]:
        order += [actor.weight, critic.weight, actor.bias, critic.bias]
    return [*order, cast(Any, policy.log_std)]


def _linear(network: torch.nn.Sequential) -> list[torch.nn.Linear]:
    return [each for each in network if isinstance(each, torch.nn.Linear)]


def vector_of(tensors: Sequence[torch.Tensor]) -> FloatArray:
    """The entries of tensors, one tensor after the other."""
    return np.concatenate([each.detach().numpy().ravel() for each in tensors])


def put_vector(vector: FloatArray, tensors: Sequence[torch.Tensor]) -> None:
    """Copy a vector's parts into tensors, in place."""
    ends = np.cumsum([0, *(each.numel() for each in tensors)])
    with torch.no_grad():
        for tensor, (start, end) in zip(tensors, pairwise(ends), strict=True):
            tensor.copy_(torch.from_numpy(vector[start:end]).reshape(tensor.shape))
