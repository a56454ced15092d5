"""G games in one simulation: Gymnasium's vector environment and Stable-Baselines3's, by `make_vec`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import libsumo
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from harness import DrivingEnv, Outcome, UsageError, VectorDrivingEnv, make_vec
from harness.drivers.policy_file import write_policy
from harness.game.observation_layout import LAYOUT, SIZE
from harness.road.scene.open_scene import OpenScene
from tests.support.policies import constant_policy
from tests.support.repository import REPOSITORY
from tests.support.scenes import build_scene

GAMES = 4


def actions(pedals: float = 0.0, wheel: float = 0.0) -> Any:
    return np.tile([pedals, wheel], (GAMES, 1))


def test_gymnasium__makes_it_by_name(opened: Callable[..., Any]) -> None:
    environment = opened(gymnasium.make_vec, "harness/NonEgo-v0", num_envs=GAMES, persona="speedy")
    assert isinstance(environment.unwrapped, VectorDrivingEnv)
    observations, info = environment.reset(seed=1)
    assert environment.observation_space.contains(observations)
    assert observations.shape == (GAMES, SIZE)
    assert info["outcome"].tolist() == [Outcome.RUNNING] * GAMES
    assert environment.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP


def test_seed__gives_the_same_games(opened: Callable[..., Any], short: OpenScene) -> None:
    environment = opened(VectorDrivingEnv, GAMES, scene=short, other="sumo")

    def games(seed: int) -> list[Any]:
        first = environment.reset(seed=seed)[0]
        return [first, *(environment.step(actions(0.3))[0] for _ in range(40))]

    first, again, other = games(5), games(5), games(6)
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first[0], other[0])


def test_step__the_time_limit_truncates_and_the_next_game_starts_in_the_same_step(
    opened: Callable[..., Any], short: OpenScene
) -> None:
    environment = opened(VectorDrivingEnv, GAMES, scene=short)
    environment.reset(seed=1)
    for _ in range(29):
        _, _, terminated, truncated, info = environment.step(actions())
        assert not (terminated | truncated).any()
        assert "final_obs" not in info
    observations, _, terminated, truncated, info = environment.step(actions())
    assert truncated.all()
    assert not terminated.any()
    assert info["final_info"]["outcome"].tolist() == [Outcome.TIMEOUT] * GAMES
    assert info["time_s"].tolist() == [0.0] * GAMES
    speed = LAYOUT.index("speed_mps")  # of the game that ended: the car is not stopped yet
    last = np.stack(info["final_obs"])[:, speed] * 30.0
    np.testing.assert_allclose(last, info["final_info"]["speed_mps"], rtol=1e-5)
    assert (last > 1.0).all()
    assert not np.array_equal(observations, np.stack(info["final_obs"]))


def test_step__a_wreck_terminates(opened: Callable[..., Any]) -> None:
    environment = opened(VectorDrivingEnv, GAMES)
    environment.reset(seed=1)
    info: dict[str, Any] = {}
    while "final_info" not in info:
        _, _, terminated, truncated, info = environment.step(actions(1.0, 1.0))
    assert not truncated.any()
    ended = info["_final_info"]
    np.testing.assert_array_equal(terminated, ended)
    assert set(info["final_info"]["outcome"][ended].tolist()) == {Outcome.RAIL}
    assert not info["final_info"]["is_success"].any()


def test_last_observation__is_of_what_a_slow_learner_knows(opened: Callable[..., Any], tmp_path: Path) -> None:
    """A game that goes on shows the same in that step. The other player brakes: where it is known to be differs from
    where it is."""
    careful = (REPOSITORY / "personas" / "careful.toml").read_text(encoding="utf-8")
    exact = "\n[perception]\ndistance_error = 0.0\nclosing_error_per_s = 0.0\n[reaction]\ndelay_s = [0.5, 0.5]\n"
    (tmp_path / "slow.toml").write_text(careful + exact, encoding="utf-8")
    write_policy(constant_policy(pedals=-1.0), tmp_path / "brakes")
    persona, other = tmp_path / "slow.toml", tmp_path / "brakes"
    arguments: dict[str, Any] = {"player": "non_ego", "persona": persona, "other": other}
    ends, goes_on = (build_scene(tmp_path / f"{end:g}", time_limit_s=end) for end in (1.0, 2.0))

    def tenth_of_one(scene: OpenScene) -> Any:
        environment = opened(DrivingEnv, scene, **arguments)
        environment.reset(seed=1)
        return [environment.step(np.zeros(2))[0] for _ in range(10)][-1]

    def tenth_of_many(scene: OpenScene) -> Any:
        environment = opened(make_vec, GAMES, scene=scene, **arguments)
        environment.reset(seed=1)
        observations, _, _, ended, info = [environment.step(actions()) for _ in range(10)][-1]
        return np.stack(info["final_obs"]) if ended.all() else observations

    def tenth_of_sb3(scene: OpenScene) -> Any:
        environment = opened(make_vec, GAMES, scene=scene, interface="sb3", **arguments)
        environment.reset()
        observations, _, ended, infos = [environment.step(actions()) for _ in range(10)][-1]
        return np.stack([info["terminal_observation"] for info in infos]) if ended.all() else observations

    for tenth in (tenth_of_one, tenth_of_many, tenth_of_sb3):
        np.testing.assert_array_equal(tenth(ends), tenth(goes_on), err_msg=tenth.__name__)


@pytest.mark.parametrize(
    "wrong", [np.zeros(2), np.zeros((GAMES, 3)), np.full((GAMES, 2), np.nan)], ids=["one game", "three", "nan"]
)
def test_step__wrong_actions_are_refused(opened: Callable[..., Any], short: OpenScene, wrong: Any) -> None:
    environment = opened(VectorDrivingEnv, GAMES, scene=short)
    with pytest.raises(gymnasium.error.ResetNeeded):
        environment.step(actions())
    environment.reset(seed=1)
    with pytest.raises(ValueError, match=r"shape|finite"):
        environment.step(wrong)


def test_arguments__wrong_ones_are_usage_errors(short: OpenScene) -> None:
    for wrong in ({"n": 0}, {"n": 2, "interface": "gym"}, {"n": 2, "render_mode": "rgb_array"}):
        with pytest.raises(UsageError):
            make_vec(**wrong)
    assert not libsumo.isLoaded()


def test_sb3__learns_on_it_and_the_seed_gives_the_same_games(opened: Callable[..., Any]) -> None:
    from stable_baselines3 import PPO

    environments = [opened(make_vec, GAMES, interface="sb3", seed=seed, other="sumo") for seed in (1, 1, 2)]
    first, again, other = (each.reset() for each in environments)
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)
    with pytest.raises(ValueError, match="shape"):
        environments[0].step(np.zeros((GAMES, 3)))
    model = PPO("MlpPolicy", environments[0], n_steps=16, batch_size=32, n_epochs=1, device="cpu").learn(64)
    assert model.num_timesteps == 64
