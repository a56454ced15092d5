"""Selection of the background vehicles that are near enough to a player to affect the game."""

from __future__ import annotations

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.jit import compiled

NOTICED_M = 120.0  # a vehicle farther than this from every player does not affect the game


@compiled
def near_players(
    due: IntArray,
    fronts_m: FloatArray,
    due_in: IntArray,
    length_m: FloatArray,
    max_speed_mps: FloatArray,
    offsets_m: FloatArray,
    players_x_m: FloatArray,
    players_y_m: FloatArray,
    players_present: BoolArray,
    fastest_player_mps: float,
    step: int,
    step_s: float,
    longest_wait: int,
    all_vehicles: bool,
) -> IntArray:
    """[m] indices into `due` of the vehicles near a player of their game; all indices with `all_vehicles`.

    due [n] are flat positions in a table [G, N], fronts_m [n, 2] the vehicles' front bumpers; length_m and
    max_speed_mps [G, N] are the table's columns, offsets_m [G] the y offsets of the games' tiles; players_x_m,
    players_y_m and players_present are [G, P].

    In place: the y of `fronts_m` loses the offset of the game's tile; `due_in` [G, N] becomes the step in which to read
    each vehicle again. A near vehicle is due in the next step, any other in the first step in which it may have come
    near, at most `longest_wait` steps from now.
    """
    near, count, room = np.empty(len(due), dtype=np.int64), 0, due_in.shape[1]
    for k in range(len(due)):
        game, place = due[k] // room, due[k] % room
        fronts_m[k, 1] -= offsets_m[game]
        distance_m = np.inf
        for p in range(players_present.shape[1]):
            if players_present[game, p]:
                dx, dy = fronts_m[k, 0] - players_x_m[game, p], fronts_m[k, 1] - players_y_m[game, p]
                distance_m = min(distance_m, np.hypot(dx, dy))
        # distances count from a vehicle's centre, which is behind its front by less than its length
        spare_m = distance_m - NOTICED_M - length_m[game, place]
        if all_vehicles or spare_m <= 0.0:
            near[count] = k
            count += 1
        closing_mps = max_speed_mps[game, place] + fastest_player_mps
        due_in[game, place] = step + int(max(min(spare_m / (closing_mps * step_s), longest_wait), 1.0))
    return near[:count]


@compiled
def rows_by_game(games: IntArray, count: int, columns: FloatArray) -> tuple[FloatArray, BoolArray]:
    """[C, G, M] the columns [C, n] of n vehicles, one row for each of G = `count` games, and [G, M] the places taken.

    `games` [n] are the vehicles' games, in ascending order. M is the largest number of vehicles in a game.
    """
    first = np.searchsorted(games, np.arange(count + 1))
    most = 0
    for g in range(count):
        most = max(most, first[g + 1] - first[g])
    rows, present = np.zeros((len(columns), count, most)), np.zeros((count, most), dtype=np.bool_)
    for g in range(count):
        for slot in range(first[g + 1] - first[g]):
            present[g, slot] = True
            for column in range(len(columns)):
                rows[column, g, slot] = columns[column, first[g] + slot]
    return rows, present
