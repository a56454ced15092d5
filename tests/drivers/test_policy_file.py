"""Policies: read back exactly, refused if damaged, free of code, and driving as their PPO models would."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
import torch
from stable_baselines3 import PPO

from harness.drivers.policy_file import LearnedDriver, Policy, read_policy, write_policy
from harness.drivers.protocol import Driver
from harness.drivers.sumo import SumoDriver
from harness.environments.vector_env import ACTION_SPACE, OBSERVATION_SPACE
from harness.errors import UsageError
from harness.game.observation_layout import SIZE
from harness.training.policy_arrays import policy_of, put_policy
from tests.support.policies import some_policy


def test_policy__is_read_back_exactly(tmp_path: Path) -> None:
    policy = some_policy()
    write_policy(policy, tmp_path / "naive")
    again = read_policy(tmp_path / "naive")
    assert set(again.tensors) == set(policy.tensors)
    for name, tensor in policy.tensors.items():
        assert again.tensors[name].dtype == tensor.dtype
        np.testing.assert_array_equal(again.tensors[name], tensor)
    assert again.card["stage"] == "naive-seed1"
    assert [weight.shape for weight, _ in again.layers("actor")] == [(5, SIZE), (2, 5)]


def test_policy__equal_policies_are_equal_bytes(tmp_path: Path) -> None:
    policy = some_policy()
    shuffled = Policy({k: np.asfortranarray(policy.tensors[k]) for k in reversed(policy.tensors)}, policy.card)
    write_policy(policy, tmp_path / "a")
    write_policy(shuffled, tmp_path / "b")
    write_policy(some_policy(seed=1), tmp_path / "c")
    files = {each: (tmp_path / each / "policy.safetensors").read_bytes() for each in "abc"}
    assert files["a"] == files["b"] != files["c"]
    assert (tmp_path / "a" / "policy.json").read_bytes() == (tmp_path / "b" / "policy.json").read_bytes()


def test_read_policy__a_misspelt_parameter_is_named_with_the_nearest(tmp_path: Path) -> None:
    """Further damage is in `tests/hostile/bad_documents.py`."""
    tensors = dict(some_policy().tensors)
    tensors["actor.1.wieght"] = tensors.pop("actor.1.weight")
    write_policy(Policy(tensors), tmp_path)
    with pytest.raises(UsageError, match=r"'actor\.1\.wieght': did you mean 'actor\.1\.weight'"):
        read_policy(tmp_path)


def test_read_policy__a_file_that_is_too_large_is_refused_unread(tmp_path: Path) -> None:
    write_policy(some_policy(), tmp_path)
    with (tmp_path / "policy.safetensors").open("ab") as file:
        file.truncate(10**12)  # sparse: it takes no space on disk
    with pytest.raises(UsageError, match="too large"):
        read_policy(tmp_path)


def test_read_policy__imports_nothing_that_can_run_code(tmp_path: Path) -> None:
    write_policy(some_policy(), tmp_path)
    program = (
        "import sys; from pathlib import Path; from harness.drivers.policy_file import read_policy\n"
        "import pickle, builtins, codecs\n"
        "def refuse(*_, **__): raise SystemExit('something was unpickled or evaluated')\n"
        "pickle.load = pickle.loads = pickle.Unpickler = builtins.eval = builtins.exec = refuse\n"
        f"read_policy(Path({str(tmp_path)!r})); assert 'torch' not in sys.modules"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


# --- driving --------------------------------------------------------------------------------------------------------

GAMES = np.arange(300)


class Spaces(gymnasium.Env[Any, Any]):
    """Only the spaces, which a learner needs."""

    observation_space, action_space = OBSERVATION_SPACE, ACTION_SPACE


def learner(network: list[int], seed: int = 3) -> PPO:
    """A learner with large weights, so that its actions spread over the whole range and beyond."""
    model = PPO("MlpPolicy", Spaces(), n_steps=8, batch_size=8, policy_kwargs={"net_arch": network}, device="cpu")
    generator = torch.Generator().manual_seed(seed)
    with torch.no_grad():
        for parameter in model.policy.parameters():
            parameter.copy_(0.5 * torch.randn(parameter.shape, generator=generator))
    return model


def observations(seed: int = 5) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (len(GAMES), SIZE)).astype(np.float32)


@pytest.mark.parametrize("network", [[64, 64], [7], [16, 8, 4]])
def test_learned__drives_by_the_learners_most_likely_action(network: list[int]) -> None:
    model = learner(network)
    driver = LearnedDriver(policy_of(model, {}), sampled=False)
    inputs = observations()
    expected, _ = model.predict(inputs, deterministic=True)
    actions = driver.decide(GAMES, inputs, np.full((len(GAMES), 2), 9.0))
    assert 0.05 < np.mean(np.abs(expected) < 1.0) < 0.95  # some are clipped
    np.testing.assert_allclose(actions, expected, atol=1e-5)


def test_learned__samples_by_the_noise_and_the_policys_deviation() -> None:
    model = learner([16])
    inputs = observations()
    noise = np.random.default_rng(7).standard_normal((len(GAMES), 2))
    with torch.no_grad():
        mean = model.policy.get_distribution(torch.from_numpy(inputs)).mode().numpy()
        deviation = np.exp(model.policy.log_std.numpy())
    driver = LearnedDriver(policy_of(model, {}), sampled=True)
    expected = np.clip(mean + deviation * noise, -1.0, 1.0)
    np.testing.assert_allclose(driver.decide(GAMES, inputs, noise), expected, atol=1e-5)
    np.testing.assert_array_equal(driver.decide(GAMES, inputs, noise), driver.decide(GAMES, inputs, noise))


@pytest.mark.parametrize("games", [1, 7, 64])
@pytest.mark.parametrize("sampled", [False, True])
def test_learned__decides_apart_with_the_bits_of_each_game_alone(games: int, sampled: bool) -> None:
    driver, rng = LearnedDriver(some_policy(), sampled), np.random.default_rng(games)
    observation, noise = rng.normal(size=(games, SIZE)), rng.normal(size=(games, 2))
    alone = [driver.decide(np.array([k]), observation[k : k + 1], noise[k : k + 1])[0] for k in range(games)]
    np.testing.assert_array_equal(driver.decide_apart(observation, noise), alone)


def test_policy__survives_a_round_trip_through_a_learner() -> None:
    policy = policy_of(learner([8, 6]), {})
    other = learner([8, 6], seed=4)
    put_policy(other, policy, deviation=0.5)
    again = policy_of(other, {})
    for name, tensor in policy.tensors.items():
        if name != "log_deviation":
            np.testing.assert_array_equal(again.tensors[name], tensor)
    np.testing.assert_allclose(np.exp(again.tensors["log_deviation"]), 0.5, rtol=1e-6)


@pytest.mark.parametrize("network", [[8], [8, 7], [9, 6]])
def test_policy__that_does_not_fit_a_learner_is_refused(network: list[int]) -> None:
    policy: Policy = policy_of(learner([8, 6]), {})
    with pytest.raises(ValueError, match="the initial actor has"):
        put_policy(learner(network), policy, deviation=0.5)


def test_drivers__implement_the_protocol() -> None:
    assert isinstance(LearnedDriver(some_policy(), sampled=False), Driver)
    assert isinstance(SumoDriver(), Driver)
    assert not SumoDriver().takes_over
    with pytest.raises(RuntimeError):
        SumoDriver().decide(GAMES, observations(), np.zeros((len(GAMES), 2)))
