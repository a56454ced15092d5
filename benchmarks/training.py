"""Training as in a campaign: against SB3's own learner, on an environment that costs nothing, on SB3's subprocesses.

All sides call `harness.training.ppo.train` with a campaign's own settings; only the learner or the environment differs.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import SubprocVecEnv, VecEnv

from benchmarks.budget import Budget
from benchmarks.figures import Measured
from benchmarks.games import GAMES, MERGE, coasting_policy, merge_scene, persona, persona_file
from benchmarks.sides import LapTimer, OnProgress, Side, best_rate, raw_numbers, take_turns
from harness.campaign.execution.worker_pool import cores
from harness.config.training import Retraining, Training
from harness.drivers.mixture import mixture_of
from harness.drivers.policy_file import LearnedDriver, write_policy
from harness.environments.gymnasium_env import DrivingEnv
from harness.environments.vector_env import ACTION_SPACE, OBSERVATION_SPACE
from harness.game.arrays import FloatArray
from harness.game.roles import EGO
from harness.training.ppo import train
from harness.training.training_games import LearningPlace, TrainingSpec

_ENDLESS = 1_000_000_000
_WARM_UP_UPDATES = 3
_OPPONENT = "paper_speedy"


def training_spec(settings: Training) -> TrainingSpec:
    """The ego's retraining against a persona with a policy."""
    opponent = persona(_OPPONENT)
    driver = LearnedDriver(coasting_policy(), sampled=opponent.decisions == "sampled")
    return TrainingSpec(
        personas=(persona("careful"),),
        places=(LearningPlace(scene=merge_scene(), player=EGO, drivers=(None, mixture_of(driver, opponent))),),
        alone_share=Retraining().alone_share,
        attentive_share=0.0,
        initial=coasting_policy(),
        settings=settings,
        parts=("benchmarks", 1),
    )


def endless_training(**changes: Any) -> Training:
    """A campaign's own settings, without an end."""
    return Training.model_validate({"steps": _ENDLESS, "early_convergence": False, **changes})


def train_in_laps(timer: LapTimer, settings: Training, values: Callable[[], dict[str, float]] = dict) -> None:
    """Count training steps in laps, after the first few thousand. `values` is called at the end of each lap."""
    is_warm, last = False, 0

    def report(done: int, total: int) -> None:
        nonlocal is_warm, last
        if not is_warm and done >= _WARM_UP_UPDATES * settings.buffer:
            timer.ready()
            is_warm, last = True, done
        elif is_warm and timer.lap_is_over():
            steps, last = done - last, done
            timer.finish_lap(steps, **values())

    with tempfile.TemporaryDirectory(prefix="benchmark-") as scratch:
        train(
            training_spec(settings),
            checkpoint=Path(scratch) / "checkpoint",
            key="benchmark",
            card={},
            tensorboard=Path(scratch) / "tensorboard",
            on_progress=report,
        )


def arena_side(timer: LapTimer) -> None:
    """Training on the arena."""
    train_in_laps(timer, endless_training())


def sb3_side(timer: LapTimer) -> None:
    """Training on the arena with Stable-Baselines3's own learner."""
    train_in_laps(timer, endless_training(learner="stable_baselines3"))


def update_side(timer: LapTimer, learner: str) -> None:
    """Updates of a learner from one rollout, again and again. The unit is a gradient step."""
    settings = endless_training()

    class Repeated(BaseCallback):
        def _on_step(self) -> bool:
            return True

        def _on_rollout_end(self) -> None:
            gradient_steps = settings.epochs * -(-settings.buffer // settings.minibatch)
            model: Any = self.model
            for _ in range(_WARM_UP_UPDATES):
                model.train()
            timer.ready()
            while True:
                updates = 0
                while not timer.lap_is_over():
                    model.train()
                    updates += 1
                timer.finish_lap(updates * gradient_steps)

    with (
        _games_of(_FreeVecEnv),
        patch("harness.training.ppo._CurveRecorder", lambda *_, **__: Repeated()),
        tempfile.TemporaryDirectory(prefix="benchmark-") as scratch,
    ):
        spec = training_spec(endless_training(learner=learner))
        train(spec, checkpoint=Path(scratch) / "checkpoint", key="benchmark", card={})


def free_side(timer: LapTimer) -> None:
    """Training on an environment that costs nothing."""
    with _games_of(_FreeVecEnv):
        train_in_laps(timer, endless_training())


def subprocess_side(timer: LapTimer, environments: int, policy: Path) -> None:
    """Training on so many of the harness's Gymnasium environments, each in a process of SB3's SubprocVecEnv."""
    make_env = partial(
        DrivingEnv, MERGE, "ego", persona_file("careful"), other=policy, other_persona=persona_file(_OPPONENT)
    )
    default = Training()
    settings = endless_training(games=environments, buffer=default.buffer // environments * environments)
    with _games_of(lambda games: _SubprocessVecEnv([make_env] * games)):
        train_in_laps(timer, settings)


@contextmanager
def _games_of(environment_of: Callable[[int], VecEnv]) -> Iterator[None]:
    """Let `train` play in another environment, made from the number of games, whose games draw their own starts."""
    games: dict[str, Any] = {
        "open_games": lambda spec: environment_of(spec.settings.games),
        "sample": lambda *_, **__: None,
    }
    with patch.multiple("harness.training.ppo", **games):
        yield


class _FreeVecEnv(VecEnv):
    """Returns precomputed arrays of the arena's shapes; no game is played."""

    render_mode = None

    def __init__(self, games: int) -> None:
        super().__init__(games, OBSERVATION_SPACE, ACTION_SPACE)
        generator = np.random.default_rng(1)
        shape = (16, games, *OBSERVATION_SPACE.shape)
        self._observations = generator.uniform(-1.0, 1.0, shape).astype(np.float32)
        self._payoff = generator.standard_normal((16, games)).astype(np.float32)
        self._done = np.zeros(games, dtype=bool)
        self._infos: list[dict[str, Any]] = [{} for _ in range(games)]
        self._steps = 0

    def reload(self, seed: int) -> None:
        """No SUMO is running."""

    def take_finished(self) -> list[Any]:
        """No game ends."""
        return []

    def reset(self) -> FloatArray:
        return self._observations[0]

    def step_async(self, actions: FloatArray) -> None:
        """Actions have no effect."""

    def step_wait(self) -> tuple[FloatArray, FloatArray, Any, list[dict[str, Any]]]:
        self._steps = (self._steps + 1) % 16
        return self._observations[self._steps], self._payoff[self._steps], self._done, self._infos

    def close(self) -> None:
        """Nothing to close."""

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        return [getattr(self, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        raise AttributeError(attr_name)

    def env_method(self, method_name: str, *arguments: Any, indices: Any = None, **keywords: Any) -> list[Any]:
        raise AttributeError(method_name)

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        return [False for _ in self._get_indices(indices)]


class _SubprocessVecEnv(SubprocVecEnv):
    """SB3's own, with the methods that `train` calls on its environment."""

    def reload(self, seed: int) -> None:
        """Each environment reloads its own SUMO."""

    def take_finished(self) -> list[Any]:
        """Finished games are not counted."""
        return []


def training_vs_free_env(budget: Budget, on_progress: OnProgress) -> Measured:
    """Rate of training on the arena, as a share of its rate on an environment that costs nothing."""
    sides = {"arena": Side(run=arena_side), "free": Side(run=free_side)}
    laps = take_turns(sides, repeats=budget.repeats, lap_s=budget.training_lap_s, on_progress=on_progress)
    value = best_rate(laps["arena"]) / best_rate(laps["free"])
    return {"training_vs_free_env": value}, {"unit": "training steps/s", "games": GAMES, **raw_numbers(laps)}


def training_vs_sb3(budget: Budget, on_progress: OnProgress) -> Measured:
    """Rate of training on the arena, in multiples of its rate with Stable-Baselines3's own learner."""
    sides = {"compiled": Side(run=arena_side), "stable_baselines3": Side(run=sb3_side)}
    laps = take_turns(sides, repeats=budget.repeats, lap_s=budget.training_lap_s, on_progress=on_progress)
    value = best_rate(laps["compiled"]) / best_rate(laps["stable_baselines3"])
    return {"training_vs_sb3": value}, {"unit": "training steps/s", "games": GAMES, **raw_numbers(laps)}


def update_vs_sb3(budget: Budget, on_progress: OnProgress) -> Measured:
    """Rate of the learner's gradient steps, in multiples of Stable-Baselines3's own."""
    learners = ("compiled", "stable_baselines3")
    sides = {learner: Side(run=update_side, arguments=(learner,)) for learner in learners}
    laps = take_turns(sides, repeats=budget.repeats, lap_s=budget.lap_s, on_progress=on_progress)
    value = best_rate(laps["compiled"]) / best_rate(laps["stable_baselines3"])
    return {"update_vs_sb3": value}, {"unit": "gradient steps/s", **raw_numbers(laps)}


def vs_subproc(budget: Budget, on_progress: OnProgress) -> Measured:
    """Rate of training on an arena on one core, in multiples of its rate on Gymnasium environments on all cores.

    Of two numbers of environments, the faster one counts.
    """
    with tempfile.TemporaryDirectory(prefix="benchmark-") as scratch:
        policy = Path(scratch) / "policy"
        write_policy(coasting_policy(), policy)
        counts = sorted({max(cores(), 2), 4 * cores()})
        sides = {"arena": Side(run=arena_side)}
        sides |= {f"subprocesses_{count}": Side(run=subprocess_side, arguments=(count, policy)) for count in counts}
        laps = take_turns(sides, repeats=budget.repeats, lap_s=budget.training_lap_s, on_progress=on_progress)
    subprocess_rate = max(best_rate(of_side) for name, of_side in laps.items() if name != "arena")
    return {"vs_subproc": best_rate(laps["arena"]) / subprocess_rate}, {
        "unit": "training steps/s",
        "cores": cores(),
        **raw_numbers(laps),
    }
