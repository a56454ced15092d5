"""The arena against highway-env, the driving environment that most papers of this field start from."""

from __future__ import annotations

import importlib.metadata
import importlib.util
from typing import Any

import gymnasium
from gymnasium.envs.registration import load_env_creator

from benchmarks.arena import arena_side
from benchmarks.budget import Budget
from benchmarks.games import GAMES
from benchmarks.sides import Pace, Side, Tell, best, described, take_turns

_WARM_UP_STEPS = 50
_ACTIONS_KEPT = 509
_IDLE = 1  # of its discrete actions: no lane change


def newest_merge() -> str:
    """The newest merge environment that the installed highway-env registers."""
    importlib.import_module("highway_env")
    names = [name for name in gymnasium.registry if name.startswith("merge-v")]
    return max(names, key=lambda name: int(name.rpartition("v")[2]))


def highway_env_side(pace: Pace) -> None:
    """Steps of its merge, of its own defaults but for the harness's 10 Hz and pedals and wheel as actions."""
    config = {"policy_frequency": 10, "simulation_frequency": 10, "action": {"type": "ContinuousAction"}}
    name = newest_merge()
    merge: Any = load_env_creator(str(gymnasium.spec(name).entry_point))
    # The reward of this scene understands discrete actions alone (1.12): it gets the one of no lane change.
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
    pace.begin()
    while True:
        before = steps
        while not pace.due():
            step()
        pace.lap(steps - before, vehicles=len(game.road.vehicles))


def vs_highway_env(budget: Budget, tell: Tell) -> tuple[dict[str, float], dict[str, Any]]:
    """How many times as many game-steps one process plays on the arena."""
    if importlib.util.find_spec("highway_env") is None:
        return {}, {"not_measured": "highway-env is not installed: pip install -e '.[bench]'"}
    sides = {"arena": Side(arena_side, (GAMES,)), "highway_env": Side(highway_env_side)}
    laps = take_turns(sides, budget.repeats, budget.stretch_s, tell)
    details = {
        "unit": "game-steps/s of one process",
        "environment": newest_merge(),
        "version": importlib.metadata.version("highway-env"),
        **described(laps),
    }
    return {"vs_highway_env": best(laps["arena"]) / best(laps["highway_env"])}, details
