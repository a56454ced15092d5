"""The arena against highway-env, the driving environment that most papers of this field use."""

from __future__ import annotations

import importlib.metadata
import importlib.util
from typing import Any

import gymnasium
from gymnasium.envs.registration import load_env_creator

from benchmarks.arena import arena_side
from benchmarks.budget import Budget
from benchmarks.figures import Measured
from benchmarks.games import GAMES
from benchmarks.sides import LapTimer, OnProgress, Side, SideFailed, best_rate, raw_numbers, take_turns

_WARM_UP_STEPS = 50
_ACTIONS_KEPT = 509
_IDLE = 1  # the discrete action that changes no lane


def newest_merge() -> str:
    """The newest merge environment that the installed highway-env registers."""
    importlib.import_module("highway_env")
    names = [name for name in gymnasium.registry if name.startswith("merge-v")]
    return max(names, key=lambda name: int(name.rpartition("v")[2]))


def highway_env_side(timer: LapTimer) -> None:
    """Steps of its merge with its own defaults, except for the harness's 10 Hz and continuous actions."""
    config = {"policy_frequency": 10, "simulation_frequency": 10, "action": {"type": "ContinuousAction"}}
    name = newest_merge()
    merge: Any = load_env_creator(str(gymnasium.spec(name).entry_point))
    # The reward of this scene accepts only discrete actions (1.12): it gets the one that changes no lane.
    rewards = merge._rewards
    merge._rewards = lambda self, action: rewards(self, _IDLE)
    environment = gymnasium.make(name, config=config, disable_env_checker=True)
    game: Any = environment.unwrapped
    environment.reset(seed=1)
    environment.action_space.seed(1)
    actions = [0.1 * environment.action_space.sample() for _ in range(_ACTIONS_KEPT)]
    steps = 0

    def step() -> None:
        nonlocal steps
        *_, terminated, truncated, _ = environment.step(actions[steps % _ACTIONS_KEPT])
        steps += 1
        if terminated or truncated:
            environment.reset()

    for _ in range(_WARM_UP_STEPS):
        step()
    timer.ready()
    while True:
        before = steps
        while not timer.lap_is_over():
            step()
        timer.finish_lap(steps - before, vehicles=len(game.road.vehicles))


def vs_highway_env(budget: Budget, on_progress: OnProgress) -> Measured:
    """Game-steps per second of one process on the arena, in multiples of those on highway-env.

    Raises SideFailed without highway-env.
    """
    if importlib.util.find_spec("highway_env") is None:
        raise SideFailed("highway-env is not installed: pip install -e '.[bench]'")
    sides = {"arena": Side(run=arena_side, arguments=(GAMES,)), "highway_env": Side(run=highway_env_side)}
    laps = take_turns(sides, repeats=budget.repeats, lap_s=budget.lap_s, on_progress=on_progress)
    details = {
        "unit": "game-steps/s of one process",
        "environment": newest_merge(),
        "version": importlib.metadata.version("highway-env"),
        **raw_numbers(laps),
    }
    return {"vs_highway_env": best_rate(laps["arena"]) / best_rate(laps["highway_env"])}, details
