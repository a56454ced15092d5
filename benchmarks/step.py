"""Where the time of an arena's step goes: the parts of the table in `harness.environments.arena`.

Each part is timed on its own, without the time of the parts inside it. An AttributeError says that a function of
a part has been renamed.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.bare_sumo import Placement, place_and_step, record_placements
from benchmarks.games import GAMES, CoastingGames, merge_scene
from benchmarks.profiler import Profiler
from benchmarks.traffic import write_scene
from harness.environments import arena as arena_module
from harness.environments.knowledge import Knowledge
from harness.game.road import Routes
from harness.road.scene.open_scene import open_scene
from harness.sumo.background_traffic import BackgroundTraffic

_MERGE_STEPS, _TRAFFIC_STEPS = 300, 100
_PARTS = (
    ("drivers, attention, requests", "decide", arena_module.Arena, "_decide"),
    ("the players' cars move", "drive", arena_module, "move"),
    ("background traffic near the players is read", "read", BackgroundTraffic, "read"),
    ("players are located along their routes", "locate", Routes, "locate"),
    ("outcomes", "terminations", arena_module, "terminations"),
    ("payoffs", "payoffs", arena_module.Arena, "_payoffs"),
    ("observations", "observe", Knowledge, "observations"),
    ("players that ended are removed or halted", "finish", arena_module.Arena, "_finish"),
    ("ended games are reset", "reset", CoastingGames, "reset"),
)


def step_table(seconds: float, background: int = 0) -> str:
    """The parts of a step of 64 games in Markdown, in microseconds per game-step.

    Without background traffic the scene is the merge, and games that end are reset. With `background` vehicles per
    game it is the merge with longer roads, from the same start again and again.
    The arena stays patched: call this once per process.
    """
    if not background:
        return _table(CoastingGames(merge_scene(), GAMES), seconds, _MERGE_STEPS, reset_ended=True)
    with tempfile.TemporaryDirectory(prefix="benchmark-") as scratch:
        scene = open_scene(write_scene(Path(scratch) / "scene", background))
        return _table(CoastingGames(scene, GAMES), seconds, _TRAFFIC_STEPS, reset_ended=False)


def _table(coasting: CoastingGames, seconds: float, steps_per_pass: int, reset_ended: bool) -> str:
    coasting.reset_all()
    placements = record_placements(coasting, steps_per_pass, reset_ended)
    coasting.reset_all()
    bare_us = _bare_us(placements)
    microseconds = _time_parts(coasting, seconds, steps_per_pass, reset_ended)
    rows = [(words, microseconds[part]) for words, part, *_ in _PARTS if part in microseconds]
    rows.insert(2, ("SUMO alone: placements and its step", bare_us))
    rows.insert(3, ("around SUMO: poses in, readings out", microseconds["simulation"] - bare_us))
    rows.append(("contact and the rest", microseconds["rest"]))
    whole_us = sum(part_us for _, part_us in rows)
    lines = ["| part | µs per game-step | share |", "| --- | ---: | ---: |"]
    lines += [f"| {words} | {part_us:.2f} | {part_us / whole_us:.0%} |" for words, part_us in rows]
    return "\n".join([*lines, f"| all | {whole_us:.2f} | {1e6 / whole_us:,.0f} game-steps/s |"])


def _time_parts(coasting: CoastingGames, seconds: float, steps_per_pass: int, reset_ended: bool) -> dict[str, float]:
    """Microseconds per game-step of each part; `simulation` and `rest` included."""
    profiler = Profiler()
    for _, part, owner, name in _PARTS:
        setattr(owner, name, profiler.wrap(part, getattr(owner, name)))
    simulation: Any = coasting.arena.simulation
    for name in ("place", "step"):
        setattr(simulation, name, profiler.wrap("simulation", getattr(simulation, name)))
    step = profiler.wrap("rest", lambda: coasting.step(reset_ended))
    steps, end_s = 0, time.perf_counter() + seconds
    while time.perf_counter() < end_s:
        coasting.reset_all()
        profiler.discard()  # a reset of everything is no part of a step
        for _ in range(steps_per_pass):
            step()
        profiler.commit()
        steps += steps_per_pass
    coasting.arena.close()
    return {part: 1e6 * total_s / (steps * GAMES) for part, total_s in profiler.total_s.items()}


def _bare_us(placements: list[list[Placement]]) -> float:
    start_s = time.perf_counter()
    for of_step in placements:
        place_and_step(of_step)
    return 1e6 * (time.perf_counter() - start_s) / (len(placements) * GAMES)
