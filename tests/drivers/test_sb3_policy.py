"""Policies saved by Stable-Baselines3 and sb3-contrib drive as they do there; they are read only with the user's
permission."""

from __future__ import annotations

import base64
import pickle
import zipfile
from contextlib import closing
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
import sb3_contrib
import stable_baselines3
import torch
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

from harness.config.driver import StableBaselines3
from harness.drivers.external import find_driver
from harness.drivers.sb3_policy import Sb3Driver
from harness.errors import UsageError
from harness.game.observation_layout import SIZE
from harness.road.scene.open_scene import OpenScene
from tests.support.observations import Recorded
from tests.support.rollouts import arm, play

torch.set_num_threads(1)  # tiny networks: more threads only wait for each other

ALGORITHMS = ("PPO", "A2C", "SAC", "TD3", "DDPG", "TQC")
SHORT: dict[str, dict[str, Any]] = {"PPO": {"n_steps": 64, "batch_size": 32, "n_epochs": 1}, "A2C": {"n_steps": 16}}


def algorithm(name: str) -> Any:
    return getattr(stable_baselines3, name, None) or getattr(sb3_contrib, name)


GAMES = np.arange(20)
SEEN = np.random.default_rng(3).uniform(-1.0, 1.0, (20, SIZE)).astype(np.float32)
NOISE = np.random.default_rng(4).standard_normal((20, 2))


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A saved model of each algorithm, trained for 128 steps on the harness's environment."""
    folder = tmp_path_factory.mktemp("saved")
    with closing(gymnasium.make("harness:harness/Ego-v0", other="sumo")) as game:
        return {name: save(name, "MlpPolicy", game, folder, steps=128, **SHORT.get(name, {})) for name in ALGORITHMS}


def document(algorithm: str, **keys: Any) -> StableBaselines3:
    given = {"kind": "stable_baselines3", "file": f"{algorithm}.zip", "algorithm": algorithm, **keys}
    return StableBaselines3.model_validate(given)


@pytest.mark.parametrize("name", ALGORITHMS)
def test_saved__drives_as_stable_baselines3_does(name: str, saved: dict[str, Path]) -> None:
    model = algorithm(name).load(saved[name], device="cpu")
    expected, _ = model.predict(SEEN, deterministic=True)
    driver = Sb3Driver(document(name), saved[name], sampled=False)
    actions = driver.decide(GAMES, SEEN, NOISE)
    assert actions.shape == (20, 2)
    np.testing.assert_allclose(actions, expected, atol=1e-6)
    assert np.ptp(actions) > 0.0


@pytest.mark.parametrize("name", ["PPO", "A2C", "SAC", "TQC"])
def test_saved__samples_by_the_noise_and_its_own_deviation(name: str, saved: dict[str, Path]) -> None:
    policy = algorithm(name).load(saved[name], device="cpu").policy
    driver = Sb3Driver(document(name), saved[name], sampled=True)
    with torch.no_grad():
        seen = torch.from_numpy(SEEN)
        if name in ("SAC", "TQC"):
            mean, log_deviation, _ = policy.actor.get_action_dist_params(seen)
            expected = np.tanh(mean.numpy() + log_deviation.exp().numpy() * NOISE)
        else:
            mean = policy.get_distribution(seen).mode()
            expected = np.clip(mean.numpy() + policy.log_std.exp().numpy() * NOISE, -1.0, 1.0)
    np.testing.assert_allclose(driver.decide(GAMES, SEEN, NOISE), expected, atol=1e-5)
    mode = driver.decide(GAMES, SEEN, 0.0 * NOISE)
    np.testing.assert_allclose(
        mode, Sb3Driver(document(name), saved[name], False).decide(GAMES, SEEN, NOISE), atol=1e-5
    )


@pytest.mark.parametrize("name", ["TD3", "DDPG"])
def test_saved__a_deterministic_policy_can_not_be_sampled(name: str, saved: dict[str, Path]) -> None:
    with pytest.raises(UsageError, match=f"{name}'s policies are deterministic"):
        Sb3Driver(document(name), saved[name], sampled=True)


def test_saved__plays_games(saved: dict[str, Path], merge: OpenScene) -> None:
    name = "PPO"
    (game,) = play(arm(merge, Sb3Driver(document(name), saved[name], sampled=False), None), 1)
    assert game.record["error"] == ""


class Other(gymnasium.Env[Any, Any]):
    """An environment with other spaces."""

    def __init__(self, seen: int, low: float, actions: int) -> None:
        self.observation_space = gymnasium.spaces.Box(low, 1.0, (seen,), np.float32)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (actions,), np.float32)


@pytest.mark.parametrize(
    ("spaces", "message"),
    [
        ((12, -1.0, 2), "observation_space: its observation space is Box(-1.0, 1.0, (12,), float32), not Box(-1.0, 1"),
        ((SIZE, 0.0, 2), "its observation space is Box(0.0, 1.0, (98,), float32), not"),
        ((SIZE, -1.0, 1), "action_space: its action space is Box(-1.0, 1.0, (1,), float32), not Box(-1.0, 1.0, (2,)"),
    ],
)
def test_saved__a_policy_with_other_spaces_is_refused(spaces: Any, message: str, tmp_path: Path) -> None:
    file = tmp_path / "PPO.zip"
    stable_baselines3.PPO("MlpPolicy", Other(*spaces), n_steps=8, batch_size=8, device="cpu").save(file)
    with pytest.raises(UsageError) as caught:
        Sb3Driver(document("PPO"), file, sampled=False)
    assert message in str(caught.value)


@pytest.mark.parametrize(("name", "named"), [("SAC", "PPO"), ("PPO", "TD3"), ("TQC", "SAC")])
def test_saved__the_file_says_which_algorithm_saved_it(name: str, named: str, saved: dict[str, Path]) -> None:
    with pytest.raises(UsageError, match=f'{name} saved this file, not {named} \\(algorithm = "{name}"\\)'):
        Sb3Driver(document(named), saved[name], sampled=False)


@pytest.mark.parametrize("name", ["QRDQN", "MaskablePPO", "TRPO"])
def test_saved__an_algorithm_that_is_not_supported_is_refused_by_what_the_file_holds(name: str, tmp_path: Path) -> None:
    file = save(name, "MlpPolicy", Recorded(discrete=name != "TRPO"), tmp_path)
    named = "DQN" if name == "QRDQN" else "PPO"
    with pytest.raises(UsageError, match=f"{name} saved this file, not {named} .policies of {name} are not supported"):
        Sb3Driver(document(named), file, sampled=False)


def save(name: str, policy: str, env: Any, folder: Path, steps: int = 0, **more: Any) -> Path:
    """A file of an algorithm, trained for some steps."""
    small = {"policy_kwargs": {"net_arch": [8], **more.pop("policy_kwargs", {})}}
    if name in ("DQN", "QRDQN", "SAC", "TD3", "DDPG", "TQC"):
        small |= {"buffer_size": 500, "learning_starts": 100, "batch_size": 16}
    model = algorithm(name)(policy, env, device="cpu", seed=1, **small, **more)
    if steps:
        model.learn(steps)
    model.save(folder / f"{name}.zip")
    return folder / f"{name}.zip"


@pytest.fixture(scope="module")
def recurrent(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recurrent policy."""
    folder, keys = tmp_path_factory.mktemp("recurrent"), {"policy_kwargs": {"lstm_hidden_size": 8}}
    return save("RecurrentPPO", "MlpLstmPolicy", Recorded(), folder, **keys)


def test_recurrent__drives_with_a_state_per_game_which_reset_discards(recurrent: Path) -> None:
    model = sb3_contrib.RecurrentPPO.load(recurrent, device="cpu")
    driver = Sb3Driver(document("RecurrentPPO"), recurrent, sampled=False)
    driver.reset(np.arange(3))
    states: dict[int, Any] = dict.fromkeys(range(3))
    for step in range(6):
        if step == 3:
            driver.reset(np.array([1]))
            states[1] = None
        games = np.array([0, 2, 1] if step % 2 else [0, 1, 2])  # their order may change, and one may be missing
        games = games[: 2 + step % 2]
        decided = driver.decide(games, SEEN[games + step], NOISE[games])
        for game, action in zip(games.tolist(), decided, strict=True):
            begins = np.array([states[game] is None])
            expected, states[game] = model.predict(
                SEEN[[game + step]], state=states[game], episode_start=begins, deterministic=True
            )
            np.testing.assert_allclose(action, expected[0], atol=1e-6)


def test_recurrent__samples_with_its_state(recurrent: Path) -> None:
    sampled = Sb3Driver(document("RecurrentPPO"), recurrent, sampled=True)
    mode = Sb3Driver(document("RecurrentPPO"), recurrent, sampled=False)
    for driver in (sampled, mode):
        driver.reset(GAMES)
    for _ in range(3):
        mean, drawn = mode.decide(GAMES, SEEN, NOISE), sampled.decide(GAMES, SEEN, NOISE)
        deviation = sampled._policy.log_std.detach().exp().numpy()
        np.testing.assert_allclose(drawn, np.clip(mean + deviation * NOISE, -1.0, 1.0), atol=1e-5)


def test_discrete__each_index_stands_for_pedals_and_wheel(tmp_path: Path) -> None:
    file = save("DQN", "MlpPolicy", Recorded(discrete=True), tmp_path)
    chosen, _ = stable_baselines3.DQN.load(file, device="cpu").predict(SEEN, deterministic=True)
    table = [[-1.0, 0.0], [0.0, 0.25], [0.5, 0.0]]
    driver = Sb3Driver(document("DQN", actions=table), file, sampled=False)
    np.testing.assert_array_equal(driver.decide(GAMES, SEEN, NOISE), np.array(table)[chosen])
    with pytest.raises(UsageError, match="discrete, 0 to 2, and the document has 2 `actions`"):
        Sb3Driver(document("DQN", actions=table[:2]), file, sampled=False)


@pytest.fixture(scope="module")
def normalised(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Path], Path]:
    """Policies trained under VecNormalize, and what its `save` wrote."""
    folder = tmp_path_factory.mktemp("normalised")
    env = VecNormalize(DummyVecEnv([Recorded]))
    files = {
        "PPO": save("PPO", "MlpPolicy", env, folder, steps=16, n_steps=16, batch_size=16),
        "SAC": save("SAC", "MlpPolicy", env, folder, steps=16),
    }
    env.save(str(folder / "vn.pkl"))
    return files, folder / "vn.pkl"


@pytest.mark.parametrize("name", ["PPO", "SAC"])
def test_normalised__sees_what_it_learned_from(name: str, normalised: tuple[dict[str, Path], Path]) -> None:
    files, scaling = normalised
    model = algorithm(name).load(files[name], device="cpu")
    seen = VecNormalize.load(str(scaling), DummyVecEnv([Recorded])).normalize_obs(SEEN)
    expected, _ = model.predict(seen, deterministic=True)
    driver = Sb3Driver(document(name, normalize="vn.pkl"), files[name], sampled=False, normalize=scaling)
    np.testing.assert_allclose(driver.decide(GAMES, SEEN, NOISE), expected, atol=1e-6)
    assert np.abs(expected - model.predict(SEEN, deterministic=True)[0]).max() > 0.01


@pytest.mark.parametrize("name", ["PPO", "SAC"])
def test_normalised__is_refused_without_the_scaling(name: str, normalised: tuple[dict[str, Path], Path]) -> None:
    with pytest.raises(UsageError, match=r"learned under VecNormalize.*norm_obs=False"):
        Sb3Driver(document(name), normalised[0][name], sampled=False)


@pytest.mark.parametrize(("name", "settings"), [("PPO", {"n_steps": 16, "batch_size": 16}), ("SAC", {})])
def test_normalised__rewards_alone_leave_observations_as_they_are(
    name: str, settings: dict[str, Any], tmp_path: Path
) -> None:
    env = VecNormalize(DummyVecEnv([Recorded]), norm_obs=False)
    file, scaling = save(name, "MlpPolicy", env, tmp_path, steps=16, **settings), tmp_path / "vn.pkl"
    env.save(str(scaling))
    expected, _ = algorithm(name).load(file, device="cpu").predict(SEEN, deterministic=True)
    driver = Sb3Driver(document(name, normalize="vn.pkl"), file, sampled=False, normalize=scaling)
    np.testing.assert_allclose(driver.decide(GAMES, SEEN, NOISE), expected, atol=1e-6)


class Trap:
    """The content of a malicious file."""

    def __init__(self, touched: Path) -> None:
        self.touched = touched

    def __reduce__(self) -> Any:
        return Path.touch, (self.touched,)


def test_saved__nothing_is_read_without_permission(tmp_path: Path) -> None:

    touched, file = tmp_path / "touched", tmp_path / "PPO.zip"
    payload = base64.b64encode(pickle.dumps(Trap(touched))).decode()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("data", f'{{"policy_class": {{":type:": "x", ":serialized:": "{payload}"}}}}')
    (tmp_path / "mine.toml").write_text('kind = "stable_baselines3"\nfile = "PPO.zip"\nalgorithm = "PPO"\n')
    with pytest.raises(UsageError) as caught:
        find_driver("mine.toml", tmp_path / "campaign.toml", "ego.driver", allow_code=False)
    (problem,) = caught.value.problems
    assert "pickles" in problem.message
    assert "--allow-code" in problem.remedy
    assert not touched.exists()
    allowed = find_driver("mine.toml", tmp_path / "campaign.toml", "ego.driver", allow_code=True)
    assert not touched.exists(), "the file is found without being read"
    with pytest.raises(UsageError):
        Sb3Driver(document("PPO"), file, sampled=False)
    assert touched.exists(), "reading the file runs its code"
    assert allowed.files == {str(file): allowed.files[str(file)]}
