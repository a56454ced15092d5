"""Where the time of an arena's step goes, part by part as the table in `harness.arena` has them.

Each part is timed with a clock around it, less what the parts inside it take. A part that the arena no longer has
under its name is counted to the rest.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from benchmarks.bare import place_and_step, record
from benchmarks.games import GAMES, Played, merge
from harness import arena as stepping

_WARM_UP_STEPS = 200
_PARTS = (
    ("drivers, attention, requests", "decide", stepping.Arena, "_decide"),
    ("the players' cars move", "drive", stepping, "drive"),
    ("where each is along its route", "locate", stepping.Arena, "_locate"),
    ("contact, goal, time", "judge", stepping.Arena, "_judge"),
    ("payoffs", "pay", stepping.Arena, "_pay"),
    ("everyone looks", "observe", stepping, "observe"),
    ("who ended leaves or stands", "settle", stepping.Arena, "_settle"),
    ("ended games start anew", "start", Played, "start"),
)


class _Clock:
    """Seconds of each part, less those of the parts inside it."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._inside = [0.0]

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


def step_table(seconds: float) -> str:
    """The parts of a step of 64 games in Markdown, in microseconds of a game-step.

    It patches the arena for good: for a process of its own.
    """
    played = Played(merge(), GAMES)
    played.start(list(range(GAMES)))
    for _ in range(_WARM_UP_STEPS):
        played.step()
    clock = _Clock()
    for _, part, owner, name in _PARTS:
        if hasattr(owner, name):
            setattr(owner, name, clock.around(part, getattr(owner, name)))
    simulation: Any = played.arena.simulation
    simulation.step = clock.around("simulation", simulation.step)
    whole = clock.around("rest", played.step)
    steps, until = 0, time.perf_counter() + seconds
    while time.perf_counter() < until:
        whole()
        steps += 1
    microseconds = {part: 1e6 * taken / (steps * GAMES) for part, taken in clock.seconds.items()}
    bare_us = _bare_us(played)
    played.arena.close()
    rows = [(words, microseconds.get(part, 0.0)) for words, part, *_ in _PARTS]
    rows.insert(2, ("SUMO alone: placements and its step", bare_us))
    rows.insert(3, ("around SUMO: poses there, readings back", microseconds["simulation"] - bare_us))
    rows.append(("the rest", microseconds["rest"]))
    whole_us = sum(taken for _, taken in rows)
    lines = ["| part | µs a game-step | share |", "| --- | ---: | ---: |"]
    lines += [f"| {words} | {taken:.2f} | {taken / whole_us:.0%} |" for words, taken in rows]
    return "\n".join([*lines, f"| all | {whole_us:.2f} | {1e6 / whole_us:,.0f} game-steps/s |"])


def _bare_us(played: Played) -> float:
    placements = record(played, 300)
    played.begin_again()
    began = time.perf_counter()
    for each in placements:
        place_and_step(each)
    return 1e6 * (time.perf_counter() - began) / (len(placements) * GAMES)
