"""What a player on foot costs: an arena with one against arenas with a car in its place.

    python -m benchmarks.walkers

prints microseconds per game-step, the best of several laps in turns, and the ratios.

    python -m benchmarks.walkers --soak 1000000

plays so many game-steps on the scenes with walkers and cyclists instead: a person with random actions, beside an ego
with random actions and beside one that SUMO drives. A simulation that dies ends the command with an error.
"""

from __future__ import annotations

import time

import numpy as np
import typer

from benchmarks.games import GAMES, REPOSITORY, CoastingGames
from harness.drivers.policy_file import ACTIONS
from harness.drivers.sumo import SumoDriver
from harness.environments.arena import Arena, Seat
from harness.environments.auto_reset import AutoReset
from harness.game.attention import HumanFactors
from harness.game.seeding import generator_of
from harness.traffic.scene import OpenScene, open_scene

STEPS = 100
PEOPLE = ("crossing", "zebra", "cyclist")
WALKER, CARS = "crossing", ("priority_crossing", "left_across")


def main(laps: int = 5, soak: int = 0) -> None:
    """Print the costs and the ratios, or soak."""
    if soak:
        _soak(soak)
        return
    names = (WALKER, *CARS)
    scenes = {name: open_scene(REPOSITORY / "networks" / name) for name in names}
    best_us = dict.fromkeys(names, float("inf"))
    for _ in range(laps):
        for name in names:
            best_us[name] = min(best_us[name], _lap_us(scenes[name]))
    for name in names:
        print(f"{name}: {best_us[name]:.2f} us a game-step")
    for name in CARS:
        print(f"{WALKER} / {name}: {best_us[WALKER] / best_us[name]:.2f}")


def _lap_us(scene: OpenScene) -> float:
    games = CoastingGames(scene, GAMES)
    try:
        games.reset_all()
        games.step()
        begin_s = time.perf_counter()
        for _ in range(STEPS):
            games.step(reset_ended=False)
        return (time.perf_counter() - begin_s) / (STEPS * GAMES) * 1e6
    finally:
        games.arena.close()


def _soak(game_steps: int) -> None:
    share = game_steps // (2 * len(PEOPLE))
    for name in PEOPLE:
        scene = open_scene(REPOSITORY / "networks" / name)
        for driver in (None, SumoDriver()):
            steps = share // GAMES
            arena = Arena(scene, GAMES, [Seat(driver), Seat(None)])
            starts = scene.start_distribution([HumanFactors()] * 2, [1.0, 1.0])
            games, generator = AutoReset(arena, starts, "soak"), generator_of("soak", name)
            games.reset(list(range(GAMES)))
            for _ in range(steps):
                arena.step(generator.uniform(-1.0, 1.0, (GAMES, 2, ACTIONS)))
                ended = np.flatnonzero(~arena.state.running.any(1))
                if len(ended):
                    games.reset(ended.tolist())
            arena.close()
            ego = "SUMO" if driver else "random actions"
            print(f"{name}, ego: {ego}: {steps * GAMES:,} game-steps", flush=True)


if __name__ == "__main__":
    typer.run(main)
