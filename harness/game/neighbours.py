"""Which of the others are near enough to a player to matter to the game."""

from __future__ import annotations

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.jit import compiled

NOTICED_M = 120.0  # nobody farther than this from every player matters to the game


@compiled
def who_is_near(
    due: IntArray,
    fronts_m: FloatArray,
    due_in: IntArray,
    length_m: FloatArray,
    max_speed_mps: FloatArray,
    offsets_m: FloatArray,
    players_x_m: FloatArray,
    players_y_m: FloatArray,
    players_there: BoolArray,
    fastest_player_mps: float,
    step: int,
    step_s: float,
    longest_wait: int,
    everyone: bool,
) -> IntArray:
    """Those of the vehicles `due` [n] for a look, by their places in a table [G, N], that are near a player [G, P] of
    their game; or everyone.

    In place: the y of their fronts [n, 2] loses the offset of the game's tile [G]; and in the table `due_in`, the step
    in which to look again: the next at who is near, at the others the first in which they may have come near, and never
    more than the longest wait from now.
    """
    near, count, room = np.empty(len(due), dtype=np.int64), 0, due_in.shape[1]
    for k in range(len(due)):
        game, place = due[k] // room, due[k] % room
        fronts_m[k, 1] -= offsets_m[game]
        away_m = np.inf
        for p in range(players_there.shape[1]):
            if players_there[game, p]:
                dx, dy = fronts_m[k, 0] - players_x_m[game, p], fronts_m[k, 1] - players_y_m[game, p]
                away_m = min(away_m, np.hypot(dx, dy))
        spare_m = away_m - NOTICED_M - length_m[game, place]  # it is the middle of a vehicle that is near or not
        if everyone or spare_m <= 0.0:
            near[count] = k
            count += 1
        closing_mps = max_speed_mps[game, place] + fastest_player_mps
        due_in[game, place] = step + int(max(min(spare_m / (closing_mps * step_s), longest_wait), 1.0))
    return near[:count]


@compiled
def by_game(games: IntArray, count: int, columns: FloatArray) -> tuple[FloatArray, BoolArray]:
    """[C, G, M] columns [C, n] of vehicles that are sorted by their games [n], with a row for each of so many games;
    and which places in the rows are taken."""
    first = np.searchsorted(games, np.arange(count + 1))
    most = 0
    for g in range(count):
        most = max(most, first[g + 1] - first[g])
    spread, present = np.zeros((len(columns), count, most)), np.zeros((count, most), dtype=np.bool_)
    for g in range(count):
        for slot in range(first[g + 1] - first[g]):
            present[g, slot] = True
            for column in range(len(columns)):
                spread[column, g, slot] = columns[column, first[g] + slot]
    return spread, present
