"""Training as campaigns train: against the same learner on an environment that costs nothing, and on one that is
stepped game by game in SB3's subprocesses.

All three sides are `harness.training.ppo.train` with a campaign's own settings; only the world under it is another.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any
from unittest.mock import patch

import gymnasium
import numpy as np
from stable_baselines3.common.vec_env import SubprocVecEnv, VecEnv

from benchmarks.budget import Budget
from benchmarks.games import GAMES, MERGE, coasting_policy, merge, persona, persona_file
from benchmarks.sides import Pace, Side, Tell, best, described, take_turns
from harness.campaign.execution.worker_pool import cores
from harness.config.campaign import Retraining, Training
from harness.drivers.policy import LearnedDriver
from harness.drivers.policy_file import write_policy
from harness.environments.gymnasium_env import DrivingEnv
from harness.environments.vector_env import ACTION_SPACE, OBSERVATION_SPACE
from harness.game.arrays import FloatArray
from harness.game.state import EGO
from harness.training.ppo import TrainingSpec, train

_ENDLESS = 1_000_000_000
_WARM_UP_UPDATES = 3
_OPPONENT = "speedy"


def lesson(settings: Training) -> TrainingSpec:
    """The ego's retraining against a person with a learned policy."""
    people = (persona("careful"), persona(_OPPONENT))
    opponent = LearnedDriver(coasting_policy(), people[1].decisions == "sampled")
    alone_share = Retraining().alone_share
    return TrainingSpec(
        scene=merge(),
        learner=EGO,
        personas=people,
        opponent=opponent,
        alone_share=alone_share,
        attentive_share=0.0,
        initial=coasting_policy(),
        settings=settings,
        parts=("benchmarks", 1),
    )


def endless(**changes: Any) -> Training:
    """A campaign's own settings, and no end."""
    return Training.model_validate({"steps": _ENDLESS, "early_convergence": False, **changes})


def train_in_laps(pace: Pace, settings: Training, values: Callable[[], dict[str, float]] = dict) -> None:
    """Training steps, after the first few thousand; `values` are asked for after each lap and go with it."""
    began, last = False, 0

    def report(done: int, total: int) -> None:
        nonlocal began, last
        if not began and done >= _WARM_UP_UPDATES * settings.buffer:
            pace.begin()
            began, last = True, done
        elif began and pace.due():
            so_many, last = done - last, done
            pace.lap(so_many, **values())

    with tempfile.TemporaryDirectory(prefix="benchmark-") as folder:
        train(
            lesson(settings),
            checkpoint=Path(folder) / "checkpoint",
            key="benchmark",
            card={},
            tensorboard=Path(folder) / "tensorboard",
            on_progress=report,
        )


def arena_side(pace: Pace) -> None:
    """On the arena."""
    train_in_laps(pace, endless())


def free_side(pace: Pace) -> None:
    """On nothing."""
    with patch.multiple("harness.training.ppo", Arena=_NoArena, ArenaVecEnv=_FreeGames):
        train_in_laps(pace, endless())


def subprocess_side(pace: Pace, environments: int, policy: Path) -> None:
    """On so many of the harness's Gymnasium environments, each in a process of SB3's SubprocVecEnv."""
    one = partial(DrivingEnv, MERGE, "ego", persona_file("careful"), policy, persona_file(_OPPONENT))
    default = Training()
    settings = endless(games=environments, buffer=default.buffer // environments * environments)
    with patch.multiple("harness.training.ppo", Arena=_NoArena, ArenaVecEnv=partial(_SubprocessGames, one)):
        train_in_laps(pace, settings)


class _NoArena:
    """Stands where `train` expects an arena."""

    def __init__(self, scene: Any, games: int, *how: Any, **more: Any) -> None:
        self.games = games

    def reload(self, seed: int) -> None:
        """There is no SUMO."""


class _FreeGames(VecEnv):
    """Arrays of the arena's shapes, made beforehand; nothing is played."""

    render_mode = None

    def __init__(self, arena: _NoArena, learner: int, start_distribution: Any, *parts: str | int, **how: Any) -> None:
        super().__init__(arena.games, OBSERVATION_SPACE, ACTION_SPACE)
        self.arena = arena
        generator = np.random.default_rng(1)
        shape = (16, arena.games, *OBSERVATION_SPACE.shape)
        self._seen = generator.uniform(-1.0, 1.0, shape).astype(np.float32)
        self._payoff = generator.standard_normal((16, arena.games)).astype(np.float32)
        self._done = np.zeros(arena.games, dtype=bool)
        self._infos: list[dict[str, Any]] = [{} for _ in range(arena.games)]
        self._steps = 0

    def sample_from(self, start_distribution: Any, *parts: str | int) -> None:
        """Nothing is drawn."""

    def take_finished(self) -> list[Any]:
        """No game ends."""
        return []

    def reset(self) -> FloatArray:
        return self._seen[0]

    def step_async(self, actions: FloatArray) -> None:
        """Nobody drives."""

    def step_wait(self) -> tuple[FloatArray, FloatArray, Any, list[dict[str, Any]]]:
        self._steps = (self._steps + 1) % 16
        return self._seen[self._steps], self._payoff[self._steps], self._done, self._infos

    def close(self) -> None:
        """Nothing is open."""

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        return [getattr(self, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        raise AttributeError(attr_name)

    def env_method(self, method_name: str, *arguments: Any, indices: Any = None, **keywords: Any) -> list[Any]:
        raise AttributeError(method_name)

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        return [False for _ in self._get_indices(indices)]


class _SubprocessGames(SubprocVecEnv):
    """SB3's own, with the words that `train` has for its games."""

    def __init__(
        self,
        one: Callable[[], gymnasium.Env[Any, Any]],
        arena: _NoArena,
        learner: int,
        start_distribution: Any,
        *parts: str | int,
        **how: Any,
    ) -> None:
        super().__init__([one] * arena.games)
        self.arena = arena

    def sample_from(self, start_distribution: Any, *parts: str | int) -> None:
        """Each environment draws its own games."""

    def take_finished(self) -> list[Any]:
        """Nobody counts them."""
        return []


def training_vs_free_env(budget: Budget, tell: Tell) -> tuple[dict[str, float], dict[str, Any]]:
    """What training keeps of its speed when the environment is an arena rather than nothing."""
    sides = {"arena": Side(arena_side), "free": Side(free_side)}
    laps = take_turns(sides, budget.repeats, budget.training_stretch_s, tell)
    value = best(laps["arena"]) / best(laps["free"])
    return {"training_vs_free_env": value}, {"unit": "training steps/s", "games": GAMES, **described(laps)}


def vs_subproc(budget: Budget, tell: Tell) -> tuple[dict[str, float], dict[str, Any]]:
    """Training on one core's arena against the same game on every core: the better of two numbers of environments."""
    with tempfile.TemporaryDirectory(prefix="benchmark-") as folder:
        policy = Path(folder) / "policy"
        write_policy(coasting_policy(), policy)
        counts = sorted({max(cores(), 2), 4 * cores()})
        sides = {"arena": Side(arena_side)}
        sides |= {f"subprocesses_{count}": Side(subprocess_side, (count, policy)) for count in counts}
        laps = take_turns(sides, budget.repeats, budget.training_stretch_s, tell)
    rival = max(best(each) for name, each in laps.items() if name != "arena")
    return {"vs_subproc": best(laps["arena"]) / rival}, {
        "unit": "training steps/s",
        "cores": cores(),
        **described(laps),
    }
