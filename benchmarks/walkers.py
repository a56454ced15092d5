"""What a player on foot costs: an arena with one against arenas with a car in its place.

    python -m benchmarks.walkers

prints microseconds per game-step, the best of several laps in turns, and the ratios.

    python -m benchmarks.walkers --soak 1000000

plays so many game-steps on the scenes with walkers and cyclists instead: a person with random actions, beside an ego
with random actions and beside one that SUMO drives. A simulation that dies ends the command with an error. Two more
scenes have cars and persons of a route file: `pavements` is the street of `crossing`, and on `shared_road`, the
junction of `cyclist`, the persons walk on the lanes of the cars. `--only NAME` soaks one scene.
"""

from __future__ import annotations

import shutil
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import typer

from benchmarks.games import GAMES, REPOSITORY, CoastingGames
from harness.drivers.policy_file import ACTIONS
from harness.drivers.sumo import SumoDriver
from harness.environments.arena import Arena, Seat
from harness.environments.auto_reset import AutoReset
from harness.game.human_factors import HumanFactors
from harness.game.seeding import generator_of
from harness.road.scene.open_scene import OpenScene, open_scene

STEPS = 100
PEOPLE = ("crossing", "zebra", "cyclist")
_TRAFFIC = """<flow id="cars" begin="0" end="100" period="8" from="{car}" to="{car}"/>
<personFlow id="with" begin="0" end="100" personsPerHour="1200" departPos="random">
    <walk edges="{first}" arrivalPos="random"/></personFlow>
<personFlow id="against" begin="0" end="100" probability="0.3" departPos="max">
    <walk edges="{second}" arrivalPos="20"/></personFlow>
</routes>"""
PERSONS = {
    "pavements": (
        "crossing",
        {"crossing.rou.xml": ("</routes>", _TRAFFIC.format(car="eastbound", first="eastbound", second="westbound"))},
    ),
    "shared_road": (
        "cyclist",
        {
            "cyclist.rou.xml": (
                "</routes>",
                _TRAFFIC.format(car="south_in", first="west_in east_out", second="west_out south_in"),
            ),
            "cyclist.net.xml": ('disallow="pedestrian bicycle"', 'disallow="bicycle"'),
        },
    ),
}
"""Scenes with cars and persons of the route file: the scene that each changes, and old and new text of its files."""
WALKER, CARS = "crossing", ("priority_crossing", "left_across")


def main(laps: int = 5, soak: int = 0, only: str = "") -> None:
    """Print the costs and the ratios, or soak."""
    if soak:
        _soak(soak, [only] if only else [*PEOPLE, *PERSONS])
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


def _soak(game_steps: int, names: Sequence[str]) -> None:
    for name in names:
        with tempfile.TemporaryDirectory() as folder:
            scene = open_scene(_with_persons(name, Path(folder)) if name in PERSONS else REPOSITORY / "networks" / name)
            for driver in (None, SumoDriver()):
                _soak_scene(name, scene, driver, game_steps // (2 * len(names) * GAMES))


def _soak_scene(name: str, scene: OpenScene, driver: SumoDriver | None, steps: int) -> None:
    arena = Arena(scene, GAMES, [Seat(driver), Seat(None)])
    starts = scene.start_distribution([HumanFactors()] * 2, [1.0, 1.0])
    games, generator = AutoReset(arena, starts, "soak"), generator_of("soak", name)
    games.reset(list(range(GAMES)))
    most = 0
    for _ in range(steps):
        arena.step(generator.uniform(-1.0, 1.0, (GAMES, 2, ACTIONS)))
        most = max(most, 0 if arena.reading is None else int(arena.reading.present.sum()))
        ended = np.flatnonzero(~arena.state.running.any(1))
        if len(ended):
            games.reset(ended.tolist())
    arena.close()
    ego = "SUMO" if driver else "random actions"
    others = f", up to {most:,} persons and cars near players at once" if most else ""
    print(f"{name}, ego: {ego}: {steps * GAMES:,} game-steps{others}", flush=True)


def _with_persons(name: str, place: Path) -> Path:
    """The folder of a scene of `PERSONS`."""
    scene, changes = PERSONS[name]
    folder = Path(shutil.copytree(REPOSITORY / "networks" / scene, place / name))
    for file, (old, new) in changes.items():
        text = (folder / file).read_text(encoding="utf-8")
        (folder / file).write_text(text.replace(old, new), encoding="utf-8")
    return folder


if __name__ == "__main__":
    typer.run(main)
