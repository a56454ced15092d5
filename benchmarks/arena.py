"""The arena against SUMO alone, against TraCI, and against itself with more or fewer games."""

from __future__ import annotations

import itertools
from typing import Any

from benchmarks.bare import own_sumo, place_and_step, record
from benchmarks.budget import Budget
from benchmarks.games import GAMES, Played, merge
from benchmarks.sides import Pace, Side, Tell, best, described, take_turns

_WARM_UP_STEPS = 200
_RECORDED_STEPS = 300
_GAMES_MEASURED = (1, 8, GAMES, 256)


def arena_side(pace: Pace, games: int) -> None:
    """Game-steps of an arena of two learners, restarts included."""
    played = Played(merge(), games)
    played.start(list(range(games)))
    for _ in range(_WARM_UP_STEPS):
        played.step()
    pace.begin()
    try:
        while True:
            done = 0
            while not pace.due():
                played.step()
                done += games
            pace.lap(done)
    finally:
        played.arena.close()


def libsumo_side(pace: Pace, games: int, by_socket: bool = False) -> None:
    """Steps of SUMO alone, in libsumo or through a socket, that places the same vehicles on the same net where such an
    arena had them. Counted in game-steps."""
    scene = merge()
    played = Played(scene, games)
    played.start(list(range(games)))
    placements = itertools.cycle(record(played, _RECORDED_STEPS))
    played.arena.close()
    with own_sumo(scene, games, by_socket) as api:
        for _ in range(_WARM_UP_STEPS):
            place_and_step(next(placements), api)
        pace.begin()
        while True:
            done = 0
            while not pace.due():
                place_and_step(next(placements), api)
                done += games
            pace.lap(done)


def arena_vs_libsumo(budget: Budget, tell: Tell) -> tuple[dict[str, float], dict[str, Any]]:
    """The arena's share of what SUMO alone reaches."""
    sides = {"arena": Side(arena_side, (GAMES,)), "libsumo": Side(libsumo_side, (GAMES,))}
    laps = take_turns(sides, budget.repeats, budget.stretch_s, tell)
    value = best(laps["arena"]) / best(laps["libsumo"])
    return {"arena_vs_libsumo": value}, {"unit": "game-steps/s", "games": GAMES, **described(laps)}


def libsumo_vs_traci(budget: Budget, tell: Tell) -> tuple[dict[str, float], dict[str, Any]]:
    """What it brings to have SUMO in the process rather than behind a socket."""
    sides = {"libsumo": Side(libsumo_side, (1,)), "traci": Side(libsumo_side, (1, True))}
    laps = take_turns(sides, budget.repeats, budget.stretch_s, tell)
    value = best(laps["libsumo"]) / best(laps["traci"])
    return {"libsumo_vs_traci": value}, {"unit": "steps/s of one game", **described(laps)}


def cost_of_games(budget: Budget, tell: Tell) -> tuple[dict[str, float], dict[str, Any]]:
    """What a game-step costs with 256 games at once, as a multiple of what it costs with 64."""
    sides = {str(games): Side(arena_side, (games,)) for games in _GAMES_MEASURED}
    laps = take_turns(sides, budget.repeats, budget.stretch_s, tell)
    cost_us = {games: 1e6 / best(each) for games, each in laps.items()}
    details = {"unit": "game-steps/s, by games at once", "us_per_game_step": cost_us, **described(laps)}
    return {"cost_256_over_64": cost_us["256"] / cost_us["64"]}, details
