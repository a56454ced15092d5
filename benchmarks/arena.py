"""The arena against SUMO alone, SUMO in the process against SUMO behind a socket, and arenas of several sizes."""

from __future__ import annotations

import itertools

from benchmarks.bare_sumo import place_and_step, record_placements, start_bare_sumo
from benchmarks.budget import Budget
from benchmarks.figures import Measured
from benchmarks.games import GAMES, CoastingGames, junction_scene, merge_scene
from benchmarks.sides import LapTimer, OnProgress, Side, best_rate, raw_numbers, take_turns

_WARM_UP_STEPS = 200
_RECORDED_STEPS = 300
_GAMES_MEASURED = (1, 8, GAMES, 256)


def arena_side(timer: LapTimer, games: int, at_junction: bool = False) -> None:
    """Game-steps of an arena with two learners, resets included."""
    coasting = CoastingGames(junction_scene() if at_junction else merge_scene(), games)
    coasting.reset(list(range(games)))
    for _ in range(_WARM_UP_STEPS):
        coasting.step()
    timer.ready()
    try:
        while True:
            game_steps = 0
            while not timer.lap_is_over():
                coasting.step()
                game_steps += games
            timer.finish_lap(game_steps)
    finally:
        coasting.arena.close()


def libsumo_side(timer: LapTimer, games: int, by_socket: bool = False, at_junction: bool = False) -> None:
    """Steps of SUMO alone, in libsumo or through a socket, counted in game-steps.

    It places the same vehicles on the same net at the places where such an arena had them.
    """
    scene = junction_scene() if at_junction else merge_scene()
    coasting = CoastingGames(scene, games)
    coasting.reset(list(range(games)))
    placements = itertools.cycle(record_placements(coasting, _RECORDED_STEPS))
    coasting.arena.close()
    with start_bare_sumo(scene, games, by_socket) as api:
        for _ in range(_WARM_UP_STEPS):
            place_and_step(next(placements), api)
        timer.ready()
        while True:
            game_steps = 0
            while not timer.lap_is_over():
                place_and_step(next(placements), api)
                game_steps += games
            timer.finish_lap(game_steps)


def arena_vs_libsumo(budget: Budget, on_progress: OnProgress) -> Measured:
    """Rate of the arena as a share of the rate of SUMO alone."""
    sides = {
        "arena": Side(run=arena_side, arguments=(GAMES,)),
        "libsumo": Side(run=libsumo_side, arguments=(GAMES,)),
    }
    laps = take_turns(sides, repeats=budget.repeats, lap_s=budget.lap_s, on_progress=on_progress)
    value = best_rate(laps["arena"]) / best_rate(laps["libsumo"])
    return {"arena_vs_libsumo": value}, {"unit": "game-steps/s", "games": GAMES, **raw_numbers(laps)}


def arena_vs_libsumo_junction(budget: Budget, on_progress: OnProgress) -> Measured:
    """The same at a crossing with traffic lights, where the players' ways cross."""
    sides = {
        "arena": Side(run=arena_side, arguments=(GAMES, True)),
        "libsumo": Side(run=libsumo_side, arguments=(GAMES, False, True)),
    }
    laps = take_turns(sides, repeats=budget.repeats, lap_s=budget.lap_s, on_progress=on_progress)
    value = best_rate(laps["arena"]) / best_rate(laps["libsumo"])
    return {"arena_vs_libsumo_junction": value}, {"unit": "game-steps/s", "games": GAMES, **raw_numbers(laps)}


def libsumo_vs_traci(budget: Budget, on_progress: OnProgress) -> Measured:
    """Rate of SUMO in the process, in multiples of its rate behind a socket."""
    sides = {
        "libsumo": Side(run=libsumo_side, arguments=(1,)),
        "traci": Side(run=libsumo_side, arguments=(1, True)),
    }
    laps = take_turns(sides, repeats=budget.repeats, lap_s=budget.lap_s, on_progress=on_progress)
    value = best_rate(laps["libsumo"]) / best_rate(laps["traci"])
    return {"libsumo_vs_traci": value}, {"unit": "steps/s of one game", **raw_numbers(laps)}


def cost_of_games(budget: Budget, on_progress: OnProgress) -> Measured:
    """Cost of a game-step with 256 games at once, in multiples of its cost with 64."""
    sides = {str(games): Side(run=arena_side, arguments=(games,)) for games in _GAMES_MEASURED}
    laps = take_turns(sides, repeats=budget.repeats, lap_s=budget.lap_s, on_progress=on_progress)
    cost_us = {games: 1e6 / best_rate(of_side) for games, of_side in laps.items()}
    details = {"unit": "game-steps/s, by games at once", "us_per_game_step": cost_us, **raw_numbers(laps)}
    return {"cost_256_over_64": cost_us["256"] / cost_us["64"]}, details
