"""Stable-Baselines3's policy as the arrays of the kernels, and back."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, cast

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.distributions import DiagGaussianDistribution
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import FlattenExtractor

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


def obstacle(model: PPO) -> str:
    """What the kernel can't update; empty: nothing."""
    policy = model.policy
    if type(policy) is not ActorCriticPolicy or not isinstance(policy.action_dist, DiagGaussianDistribution):
        return "the policy is not a diagonal Gaussian of Stable-Baselines3's MlpPolicy"
    if model.device.type != "cpu" or any(each.dtype != torch.float32 for each in policy.parameters()):
        return "the policy's parameters are not float32 on the CPU"
    if len(policy.observation_space.shape or ()) != 1:
        return "an observation is not a vector"
    extractor: Any = policy.mlp_extractor
    nets = (extractor.policy_net, extractor.value_net)
    if not isinstance(policy.features_extractor, FlattenExtractor) or not all(map(_is_tanh_network, nets)):
        return "the networks are not layers of tanh units on the plain observation"
    if [each.out_features for each in _linear(nets[0])] != [each.out_features for each in _linear(nets[1])]:
        return "actor and critic have hidden layers of different sizes"
    optimizer = policy.optimizer
    plain = type(optimizer) is torch.optim.Adam and len(optimizer.param_groups) == 1
    if not plain or optimizer.defaults["weight_decay"] or optimizer.defaults["amsgrad"]:
        return "the optimiser is not plain Adam"
    if model.clip_range_vf is not None:
        return "clip_range_vf is set"
    return ""


def _is_tanh_network(network: torch.nn.Sequential) -> bool:
    layers = list(network)
    return (
        len(layers) >= 2
        and all(isinstance(each, torch.nn.Linear) and each.bias is not None for each in layers[::2])
        and all(isinstance(each, torch.nn.Tanh) for each in layers[1::2])
        and len(layers) % 2 == 0
    )
