"""The interfaces of the arena: Gymnasium, PettingZoo and SB3, any number of environments in one process."""

from __future__ import annotations

import gc
import itertools
import os
import subprocess
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import libsumo
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from pettingzoo.test import parallel_api_test, parallel_seed_test

import harness
from harness import DrivingEnv, Outcome, ParallelDrivingEnv, UsageError, make_vec, read_document
from harness.config.persona import Persona
from harness.drivers.policy_file import write_policy
from harness.game.observation_layout import LAYOUT
from harness.road.scene.open_scene import OpenScene
from harness.sumo.libsumo_simulation import LibsumoSimulation
from harness.sumo.subprocess_simulation import SubprocessSimulation
from tests.support.policies import constant_policy
from tests.support.repository import REPOSITORY
from tests.support.scenes import build_scene
from tests.support.shipped import FOLDER, PERSON_BY_NAME, SPEEDY

STRAIGHT_ON = np.zeros(2, dtype=np.float32)
SWERVE = np.array([0.0, 1.0], dtype=np.float32)
Open = Callable[..., Any]


@pytest.fixture(scope="module")
def busy(tmp_path_factory: pytest.TempPathFactory) -> OpenScene:
    """A straight road with background traffic and a time limit of 3 s."""
    flow = '<flow id="f" type="van" begin="0" probability="0.5" departLane="random"><route edges="road"/></flow>'
    return build_scene(tmp_path_factory.mktemp("scenes") / "busy", others=flow, time_limit_s=3.0)


@pytest.fixture
def policy(tmp_path: Path) -> Path:
    """The folder of a policy that brakes as hard as it can."""
    write_policy(constant_policy(pedals=-1.0), tmp_path / "brakes")
    return tmp_path / "brakes"


def played(environment: Any, action: Any = STRAIGHT_ON, steps: int = 1000) -> list[Any]:
    """Steps until the game has ended."""
    taken = []
    while len(taken) < steps and not (taken and any(taken[-1][2:4])):
        taken.append(environment.step(action))
    return taken


def run(program: str, *arguments: str, cwd: Path = REPOSITORY) -> str:
    done = subprocess.run(
        [sys.executable, *arguments, "-c", program],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(REPOSITORY)},
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


# --- Gymnasium --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["harness/Ego-v0", "harness/NonEgo-v0"])
@pytest.mark.parametrize("other", [None, "sumo"])
def test_gymnasium__passes_its_checker(
    opened: Open, name: str, other: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    for screen in ("DISPLAY", "WAYLAND_DISPLAY"):  # with one, the checker would open a window; see test_rendering.py
        monkeypatch.delenv(screen, raising=False)
    environment = opened(gymnasium.make, name, other=other)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(environment.unwrapped)


@pytest.mark.parametrize(
    "program",
    [
        "import gymnasium; gymnasium.make('harness:harness/Ego-v0')",
        "import gymnasium, harness; gymnasium.make('harness/NonEgo-v0').close()",
        "import harness, gymnasium; gymnasium.make('harness.environments:harness/Ego-v0')",
    ],
)
def test_gymnasium__knows_the_environments_in_any_order_of_imports(program: str, tmp_path: Path) -> None:
    run(program, "-W", "error", cwd=tmp_path)


def test_import__of_the_package_loads_no_large_library() -> None:
    loaded = run("import harness, sys; print(*sys.modules)").split()
    assert not {"numpy", "gymnasium", "libsumo", "torch", "pydantic"} & set(loaded)


def test_import__every_exported_name_exists() -> None:
    for name in harness.__all__:
        assert getattr(harness, name) is not None
    assert set(harness.__all__) <= set(dir(harness))
    with pytest.raises(AttributeError, match="DrivingEmv"):
        harness.DrivingEmv  # noqa: B018


def test_seed__gives_the_same_games_in_this_process_and_another(opened: Open, busy: OpenScene) -> None:
    environments = [opened(DrivingEnv, busy, other="sumo") for _ in range(2)]
    kinds = [type(each._game.arena.simulation) for each in environments]
    assert kinds == [LibsumoSimulation, SubprocessSimulation]

    def games(environment: DrivingEnv) -> list[Any]:
        first = [environment.reset(seed=5)[0], played(environment)]
        return [*first, environment.reset()[0], played(environment), environment.reset(seed=6)[0]]

    here, there, again = (games(environment) for environment in (*environments, environments[0]))
    for first, second in itertools.pairwise((here, there, again)):
        assert repr(first) == repr(second)
        np.testing.assert_array_equal(first[0], second[0])
    assert not np.array_equal(here[0], here[2])
    assert not np.array_equal(here[0], here[4])
    assert any(step[0][LAYOUT.index("other1_seen")] for step in here[1])


def test_step__reward_is_the_personas_payoff_by_terms(opened: Open) -> None:
    environment = opened(DrivingEnv)
    _, info = environment.reset(seed=1)
    assert info["outcome"] == Outcome.RUNNING
    steps = played(environment)
    assert environment.action_space.shape == (2,)
    for observation, reward, _, _, info in steps:
        assert environment.observation_space.contains(observation)
        assert reward == pytest.approx(sum(info["terms"].values()))
    careful = read_document(REPOSITORY / "personas/careful.toml", Persona)
    assert set(steps[0][4]["terms"]) == {each.name for each in careful.payoff.terms}
    *_, terminated, truncated, info = steps[-1]
    assert (terminated, truncated, info["outcome"], info["terms"]["goal"]) == (True, False, Outcome.GOAL, 5.0)
    assert info["goal_m"] <= 0.0
    assert info["time_s"] == pytest.approx(0.1 * len(steps))


def test_step__contact_terminates_with_the_observation_of_that_moment(opened: Open) -> None:
    environment = opened(DrivingEnv)
    environment.reset(seed=1)
    observation, _, terminated, truncated, info = played(environment, SWERVE)[-1]
    assert (terminated, truncated, info["outcome"]) == (True, False, Outcome.RAIL)
    assert info["speed_mps"] > 5.0
    assert observation[LAYOUT.index("speed_mps")] == pytest.approx(info["speed_mps"] / 30.0)


def test_step__the_time_limit_truncates(opened: Open, busy: OpenScene) -> None:
    environment = opened(DrivingEnv, busy)
    environment.reset(seed=1)
    steps = played(environment, np.array([-1.0, 0.0]))
    *_, terminated, truncated, info = steps[-1]
    assert (len(steps), terminated, truncated, info["outcome"]) == (30, False, True, Outcome.TIMEOUT)


def test_step__needs_a_running_game(opened: Open) -> None:
    environment = opened(DrivingEnv)
    with pytest.raises(gymnasium.error.ResetNeeded):
        environment.step(STRAIGHT_ON)
    environment.reset(seed=1)
    played(environment, SWERVE)
    with pytest.raises(gymnasium.error.ResetNeeded):
        environment.step(STRAIGHT_ON)


def test_other__a_policy_has_its_personas_attention(opened: Open, policy: Path) -> None:
    environment = opened(DrivingEnv, other=policy, other_persona="personas/texting.toml")
    lapsed, speeds = [], []
    for seed in range(5):
        environment.reset(seed=seed)
        for _ in range(40):
            *_, terminated, truncated, _ = environment.step(STRAIGHT_ON)
            if terminated or truncated:
                break
            speeds.append(environment._game.arena.state.speed_mps[0, 1])
            lapsed.append(bool(environment._game.arena.state.lapsed[0, 1]))
    assert 0 < sum(lapsed) < len(lapsed)
    assert min(speeds) == 0.0


@pytest.mark.parametrize("other", ["rss", "egos/adas.toml", "egos/examples/process/perl.toml"])
def test_other__may_be_what_a_campaign_takes_as_its_ego(opened: Open, other: str) -> None:
    environment = opened(DrivingEnv, other=other, allow_code=True)
    environment.reset(seed=1)
    before = environment._game.arena.state.station_m[0, 1]
    for _ in range(10):
        environment.step(STRAIGHT_ON)
    assert environment._game.arena.state.station_m[0, 1] > before + 1.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"other": "egos/examples/process/perl.toml"}, "--allow-code"),
        ({"player": "nonego"}, "did you mean 'non_ego'"),
        ({"scene": "networks/merg"}, "networks/merg"),
        ({"persona": "personas/carefull.toml"}, "carefull.toml"),
        ({"other": "nowhere"}, "nowhere"),
        ({"other": "sumo", "other_persona": "personas/careful.toml"}, "only a policy"),
    ],
)
def test_arguments__wrong_ones_are_usage_errors(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        DrivingEnv(**arguments)
    assert not libsumo.isLoaded()


def test_names__are_found_from_any_working_directory(
    opened: Open, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    opened(DrivingEnv, scene="merge", persona="speedy").reset(seed=1)
    name = "harness:harness/Ego-v0"
    opened(gymnasium.make, name, scene=FOLDER, other=PERSON_BY_NAME, other_persona=SPEEDY).reset(seed=1)


def test_garbage__an_environment_that_was_not_closed_closes_sumo() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        environment = DrivingEnv()
        environment.reset(seed=1)
        del environment
        gc.collect()
    assert not libsumo.isLoaded()


# --- PettingZoo -------------------------------------------------------------------------------------------------------


@pytest.mark.filterwarnings("error")
def test_pettingzoo__passes_its_tests(opened: Open) -> None:
    parallel_api_test(opened(ParallelDrivingEnv), num_cycles=300)
    parallel_seed_test(lambda: opened(ParallelDrivingEnv), num_cycles=200)


def test_parallel__an_agent_is_removed_at_its_end_and_the_other_continues(opened: Open) -> None:
    environment = opened(ParallelDrivingEnv, non_ego_persona="personas/speedy.toml")
    environment.reset(seed=2)
    actions = {"ego": STRAIGHT_ON, "non_ego": np.array([0.0, -1.0])}
    while len(environment.agents) == 2:
        _, _, terminations, _, infos = environment.step(actions)
    assert environment.agents == ["ego"]
    assert terminations == {"ego": False, "non_ego": True}
    assert infos["non_ego"]["outcome"] == Outcome.RAIL
    while environment.agents:
        observations, rewards, terminations, truncations, infos = environment.step({"ego": STRAIGHT_ON})
        assert {*observations, *rewards, *terminations, *truncations, *infos} == {"ego"}
    assert infos["ego"]["outcome"] == Outcome.GOAL
    assert environment.step({}) == ({}, {}, {}, {}, {})


def test_parallel__each_agent_has_the_payoff_of_its_persona(opened: Open) -> None:
    environment = opened(ParallelDrivingEnv, non_ego_persona="personas/speedy.toml")
    environment.reset(seed=2)
    _, rewards, _, _, infos = environment.step({"ego": STRAIGHT_ON, "non_ego": STRAIGHT_ON})
    for agent, persona in (("ego", "careful"), ("non_ego", "speedy")):
        terms = read_document(REPOSITORY / f"personas/{persona}.toml", Persona).payoff
        assert set(infos[agent]["terms"]) == {*(each.name for each in terms.terms), *terms.fuzzy}
        assert rewards[agent] == pytest.approx(sum(infos[agent]["terms"].values()))


# --- Stable-Baselines3 ------------------------------------------------------------------------------------------------


def test_sb3__trains_with_an_eval_callback_in_the_same_process(opened: Open) -> None:
    from stable_baselines3 import PPO
    from stable_baselines3.common.callbacks import EvalCallback
    from stable_baselines3.common.monitor import Monitor

    training = opened(make_vec, 4, other="sumo", interface="sb3")
    evaluation = opened(Monitor, DrivingEnv(other="sumo"))
    assert isinstance(evaluation.unwrapped._game.arena.simulation, SubprocessSimulation)
    callback = EvalCallback(evaluation, n_eval_episodes=2, eval_freq=256 // training.num_envs, verbose=0, warn=False)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Training and eval env are not of the same type")
        model = PPO("MlpPolicy", training, n_steps=256 // training.num_envs, batch_size=128, n_epochs=1, device="cpu")
        model.learn(512, callback=callback)
    assert model.num_timesteps == 512
    assert np.isfinite(callback.last_mean_reward)
