"""Where the time of an arena's step goes, part by part as the table in `harness.environments.arena` has them.

Each part is timed with a clock around it, less what the parts inside it take. A part that the arena no longer has
under its name is counted to the rest.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.bare import Placement, place_and_step, record
from benchmarks.games import GAMES, Played, merge
from benchmarks.traffic import write_scene
from harness.environments import arena as stepping
from harness.traffic.background_traffic import BackgroundTraffic
from harness.traffic.scene import open_scene

_ALONE_STEPS, _AMONG_OTHERS_STEPS = 300, 100
_PARTS = (
    ("drivers, attention, requests", "decide", stepping.Arena, "_decide"),
    ("the players' cars move", "drive", stepping, "move"),
    ("others near the players read", "read", BackgroundTraffic, "read"),
    ("where each is along its route", "locate", stepping.Arena, "_locate"),
    ("contact, goal, time", "terminations", stepping.Arena, "_terminations"),
    ("payoffs", "pay", stepping.Arena, "_payoffs"),
    ("everyone looks", "observe", stepping, "observe"),
    ("who ended leaves or stands", "settle", stepping.Arena, "_finish"),
    ("ended games start anew", "start", Played, "start"),
)


class _Clock:
    """Seconds of each part, less those of the parts inside it."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.kept: dict[str, float] = {}
        self._inside = [0.0]

    def keep(self) -> None:
        """Add what was measured since the last time to what is kept."""
        for part, taken in self.seconds.items():
            self.kept[part] = self.kept.get(part, 0.0) + taken
        self.seconds.clear()

    def around(self, part: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def timed(*arguments: Any, **keywords: Any) -> Any:
            self._inside.append(0.0)
            began = time.perf_counter()
            try:
                return function(*arguments, **keywords)
            finally:
                taken = time.perf_counter() - began
                self.seconds[part] = self.seconds.get(part, 0.0) + taken - self._inside.pop()
                self._inside[-1] += taken

        return timed


def step_table(seconds: float, others: int = 0) -> str:
    """The parts of a step of 64 games in Markdown, in microseconds of a game-step: on the merge, where games that end
    start anew; or with so many others a game on the merge with longer roads, again and again from the same start.

    It patches the arena for good: for a process of its own.
    """
    if not others:
        return _table(Played(merge(), GAMES), seconds, _ALONE_STEPS, restart=True)
    with tempfile.TemporaryDirectory(prefix="benchmark-") as scratch:
        scene = open_scene(write_scene(Path(scratch) / "scene", others))
        return _table(Played(scene, GAMES), seconds, _AMONG_OTHERS_STEPS, restart=False)


def _table(played: Played, seconds: float, stretch: int, restart: bool) -> str:
    played.begin_again()
    placements = record(played, stretch, restart)
    played.begin_again()
    bare_us = _bare_us(placements)
    clock = _Clock()
    for _, part, owner, name in _PARTS:
        if hasattr(owner, name):
            setattr(owner, name, clock.around(part, getattr(owner, name)))
    simulation: Any = played.arena.simulation
    simulation.step = clock.around("simulation", simulation.step)
    whole = clock.around("rest", lambda: played.step(restart))
    steps, until = 0, time.perf_counter() + seconds
    while time.perf_counter() < until:
        played.begin_again()
        clock.seconds.clear()  # what it takes to begin is no part of a step
        for _ in range(stretch):
            whole()
        clock.keep()
        steps += stretch
    played.arena.close()
    microseconds = {part: 1e6 * taken / (steps * GAMES) for part, taken in clock.kept.items()}
    rows = [(words, microseconds.get(part, 0.0)) for words, part, *_ in _PARTS if part in microseconds]
    rows.insert(2, ("SUMO alone: placements and its step", bare_us))
    rows.insert(3, ("around SUMO: poses there, readings back", microseconds["simulation"] - bare_us))
    rows.append(("the rest", microseconds["rest"]))
    whole_us = sum(taken for _, taken in rows)
    lines = ["| part | µs a game-step | share |", "| --- | ---: | ---: |"]
    lines += [f"| {words} | {taken:.2f} | {taken / whole_us:.0%} |" for words, taken in rows]
    return "\n".join([*lines, f"| all | {whole_us:.2f} | {1e6 / whole_us:,.0f} game-steps/s |"])


def _bare_us(placements: list[list[Placement]]) -> float:
    began = time.perf_counter()
    for each in placements:
        place_and_step(each)
    return 1e6 * (time.perf_counter() - began) / (len(placements) * GAMES)
