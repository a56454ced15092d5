"""Steps a second of the environments on the scene merge: a single game, and 64 games in one simulation.

Laps of all take turns, because the speed of a machine changes; the best lap of each counts. Actions are random numbers
that are drawn before.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

import harness

GAMES, LAPS, LAP_S = 64, 12, 0.5


def main() -> None:
    """Measure and print a table in Markdown."""
    random = np.random.default_rng(1)
    single = harness.DrivingEnv(other="sumo")
    many = harness.make_vec(GAMES, other="sumo")
    learners = harness.make_vec(GAMES, other="sumo", interface="sb3", seed=1)
    single.reset(seed=1), many.reset(seed=1), learners.reset()
    one, all_of = random.uniform(-1.0, 1.0, (1000, 2)), random.uniform(-1.0, 1.0, (1000, GAMES, 2))

    def step_single(action: Any) -> None:
        *_, terminated, truncated, _ = single.step(action)
        if terminated or truncated:
            single.reset()

    sides: dict[str, tuple[Callable[[Any], object], Any, int]] = {
        "`harness.DrivingEnv`": (step_single, one, 1),
        f"`harness.make_vec({GAMES})`": (many.step, all_of, GAMES),
        f'`harness.make_vec({GAMES}, interface="sb3")`': (learners.step, all_of, GAMES),
    }
    best = dict.fromkeys(sides, 0.0)
    for _ in range(LAPS):
        for name, (step, actions, games) in sides.items():
            best[name] = max(best[name], games * _steps_per_s(step, actions))
    print("| environment | game-steps/s | in multiples |\n| --- | --- | --- |")
    for name, per_s in best.items():
        print(f"| {name} | {per_s:,.0f} | {per_s / best['`harness.DrivingEnv`']:.1f} |")
    for each in (single, many, learners):
        each.close()


def _steps_per_s(step: Callable[[Any], object], actions: Any) -> float:
    started, steps = time.perf_counter(), 0
    while time.perf_counter() - started < LAP_S:
        step(actions[steps % len(actions)])
        steps += 1
    return steps / (time.perf_counter() - started)


if __name__ == "__main__":
    main()
