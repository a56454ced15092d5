"""Policies saved by Stable-Baselines3 drive as they do there; they are read only with the user's permission."""

from __future__ import annotations

import base64
import pickle
import zipfile
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
import stable_baselines3
import torch

import harness
from harness.config.driver import StableBaselines3
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.drivers.external import find_driver
from harness.drivers.sb3_policy import Sb3Driver
from harness.environments.rollout import Arm, assess
from harness.errors import UsageError
from harness.game.observation_layout import SIZE
from harness.traffic.scene import OpenScene
from tests.support.tiny import CAREFUL

torch.set_num_threads(1)  # tiny networks: more threads only wait for each other

ALGORITHMS = ("PPO", "A2C", "SAC", "TD3")
SHORT: dict[str, dict[str, Any]] = {
    "PPO": {"n_steps": 64, "batch_size": 32, "n_epochs": 1},
    "A2C": {"n_steps": 16},
    "SAC": {"learning_starts": 50, "batch_size": 16, "buffer_size": 500},
    "TD3": {"learning_starts": 50, "batch_size": 16, "buffer_size": 500},
}
GAMES = np.arange(20)
SEEN = np.random.default_rng(3).uniform(-1.0, 1.0, (20, SIZE)).astype(np.float32)
NOISE = np.random.default_rng(4).standard_normal((20, 2))


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A saved model of each algorithm, trained for 128 steps on the harness's environment."""
    folder = tmp_path_factory.mktemp("saved")
    assert harness.__version__  # importing the harness registers its environments
    game = gymnasium.make("harness/Ego-v0", other="sumo")
    try:
        for name in ALGORITHMS:
            algorithm = getattr(stable_baselines3, name)
            model = algorithm("MlpPolicy", game, seed=1, device="cpu", policy_kwargs={"net_arch": [16]}, **SHORT[name])
            model.learn(128)
            model.save(folder / f"{name}.zip")
    finally:
        game.close()
    return {name: folder / f"{name}.zip" for name in ALGORITHMS}


def document(algorithm: str, **keys: Any) -> StableBaselines3:
    given = {"kind": "stable_baselines3", "file": f"{algorithm}.zip", "algorithm": algorithm, **keys}
    return StableBaselines3.model_validate(given)


@pytest.mark.parametrize("name", ALGORITHMS)
def test_saved__drives_as_stable_baselines3_does(name: str, saved: dict[str, Path]) -> None:
    model = getattr(stable_baselines3, name).load(saved[name], device="cpu")
    expected, _ = model.predict(SEEN, deterministic=True)
    driver = Sb3Driver(document(name), saved[name], sampled=False)
    actions = driver.decide(GAMES, SEEN, NOISE)
    assert actions.shape == (20, 2)
    np.testing.assert_allclose(actions, expected, atol=1e-6)
    assert np.ptp(actions) > 0.0


@pytest.mark.parametrize("name", ["PPO", "A2C", "SAC"])
def test_saved__samples_by_the_noise_and_its_own_deviation(name: str, saved: dict[str, Path]) -> None:
    policy = getattr(stable_baselines3, name).load(saved[name], device="cpu").policy
    driver = Sb3Driver(document(name), saved[name], sampled=True)
    with torch.no_grad():
        seen = torch.from_numpy(SEEN)
        if name == "SAC":
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


def test_saved__a_deterministic_policy_can_not_be_sampled(saved: dict[str, Path]) -> None:
    with pytest.raises(UsageError, match="TD3's policies are deterministic"):
        Sb3Driver(document("TD3"), saved["TD3"], sampled=True)


@pytest.mark.parametrize("name", ALGORITHMS)
def test_saved__plays_games(name: str, saved: dict[str, Path], merge: OpenScene) -> None:
    careful = read_document(CAREFUL, Persona)
    driver = Sb3Driver(document(name), saved[name], sampled=False)
    (game,) = assess(
        Arm(name="naive_alone", scene=merge, drivers=(driver, None), personas=(careful, careful), seed=1), 1
    )
    assert game.record["error"] == ""


class Other(gymnasium.Env[Any, Any]):
    """An environment with other spaces."""

    def __init__(self, seen: int, low: float, actions: int) -> None:
        self.observation_space = gymnasium.spaces.Box(low, 1.0, (seen,), np.float32)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (actions,), np.float32)


@pytest.mark.parametrize(
    ("spaces", "message"),
    [
        (
            (12, -1.0, 2),
            "observation_space: its observation space is Box(-1.0, 1.0, (12,), float32), not Box(-1.0, 1.0, (98,)",
        ),
        ((SIZE, 0.0, 2), "its observation space is Box(0.0, 1.0, (98,), float32), not"),
        ((SIZE, -1.0, 1), "action_space: its action space is Box(-1.0, 1.0, (1,), float32), not Box(-1.0, 1.0, (2,)"),
    ],
)
def test_saved__a_policy_with_other_spaces_is_refused(
    spaces: tuple[int, float, int], message: str, tmp_path: Path
) -> None:
    file = tmp_path / "PPO.zip"
    stable_baselines3.PPO("MlpPolicy", Other(*spaces), n_steps=8, batch_size=8, device="cpu").save(file)
    with pytest.raises(UsageError) as caught:
        Sb3Driver(document("PPO"), file, sampled=False)
    assert message in str(caught.value)


@pytest.mark.parametrize(("name", "named"), [("SAC", "PPO"), ("PPO", "TD3"), ("TD3", "SAC")])
def test_saved__a_wrong_algorithm_is_an_error(name: str, named: str, saved: dict[str, Path]) -> None:
    with pytest.raises(UsageError, match=f"can't be read as a policy of {named}.*is the algorithm right"):
        Sb3Driver(document(named), saved[name], sampled=False)


def test_saved__a_file_that_is_no_zip_is_refused(tmp_path: Path) -> None:
    (tmp_path / "PPO.zip").write_bytes(b"PK nothing")
    with pytest.raises(UsageError, match="can't be read as a policy of PPO"):
        Sb3Driver(document("PPO"), tmp_path / "PPO.zip", sampled=False)


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
