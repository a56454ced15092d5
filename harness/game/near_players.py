"""Selection of the background vehicles that are near enough to a player to affect the game."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.jit import compiled

NEAREST = 16  # background vehicles in the bodies of a game
NOTICED_M = 120.0  # a vehicle farther than this from every player does not affect the game


class NearSearch(NamedTuple):
    """What decides which vehicles are near a player, and when to read the others again."""

    due_in: IntArray
    """[G, N] the step in which to read each vehicle of a table again; written by `is_near`."""
    length_m: FloatArray
    """[G, N]"""
    max_speed_mps: FloatArray
    """[G, N]"""
    offsets_m: FloatArray
    """[G] y offsets of the games' tiles"""
    players_x_m: FloatArray
    """[G, P]"""
    players_y_m: FloatArray
    """[G, P]"""
    players_present: BoolArray
    """[G, P]"""
    fastest_player_mps: float
    step: int
    """the current one"""
    step_s: float
    longest_wait: int
    """steps"""
    all_vehicles: bool
    """Whether every vehicle counts as near."""


@compiled
def is_near(search: NearSearch, place: int, front_x_m: float, front_y_m: float) -> bool:
    """Whether a vehicle may be near a player of its game. `place` is its flat position in the table [G, N].

    The front bumper is in the coordinates of the game, without the offset of its tile. In place: `due_in` becomes the
    step in which to read the vehicle again. A near vehicle is due in the next step, any other in the first step in
    which it may have come near, at most `longest_wait` steps from now.
    """
    room = search.due_in.shape[1]
    game, column = place // room, place % room
    distance_m = np.inf
    for p in range(search.players_present.shape[1]):
        if search.players_present[game, p]:
            dx, dy = front_x_m - search.players_x_m[game, p], front_y_m - search.players_y_m[game, p]
            distance_m = min(distance_m, np.hypot(dx, dy))
    # distances count from a vehicle's centre, which is behind its front by less than its length
    spare_m = distance_m - NOTICED_M - search.length_m[game, column]
    reach_m = (search.max_speed_mps[game, column] + search.fastest_player_mps) * search.step_s
    search.due_in[game, column] = search.step + int(max(min(spare_m / reach_m, search.longest_wait), 1.0))
    return search.all_vehicles or spare_m <= 0.0


@compiled
def near_players(search: NearSearch, due: IntArray, fronts_m: FloatArray) -> IntArray:
    """[m] indices into `due` of the vehicles that are near a player of their game.

    due [n] are flat positions in the table [G, N], fronts_m [n, 2] the vehicles' front bumpers. In place: the y of
    `fronts_m` loses the offset of the game's tile, and `due_in` is written as by `is_near`.
    """
    near, count = np.empty(len(due), dtype=np.int64), 0
    for k in range(len(due)):
        fronts_m[k, 1] -= search.offsets_m[due[k] // search.due_in.shape[1]]
        if is_near(search, due[k], fronts_m[k, 0], fronts_m[k, 1]):
            near[count] = k
            count += 1
    return near[:count]


@compiled
def rows_by_game(
    places: IntArray, motion: tuple[FloatArray, ...], sizes_m: tuple[FloatArray, ...]
) -> tuple[FloatArray, BoolArray, IntArray]:
    """[C, G, M] the columns of n vehicles, one row for each of G games; [G, M] whether there is a vehicle; [G, M] its
    index, n without one.

    `places` [n] are the vehicles' flat places in a table [G, N], in ascending order. The columns are those of `motion`,
    [n] each, followed by those of `sizes_m`, [G, N] each. M is the largest number of vehicles in a game.
    """
    count, room = sizes_m[0].shape
    first, most = np.searchsorted(places, np.arange(0, (count + 1) * room, room)), 0
    for g in range(count):
        most = max(most, first[g + 1] - first[g])
    rows = np.zeros((len(motion) + len(sizes_m), count, most))
    present, index = np.zeros((count, most), dtype=np.bool_), np.full((count, most), len(places))
    for g in range(count):
        for slot in range(first[g + 1] - first[g]):
            k = first[g] + slot
            present[g, slot], index[g, slot] = True, k
            for column in range(len(motion)):
                rows[column, g, slot] = motion[column][k]
            for column in range(len(sizes_m)):
                rows[len(motion) + column, g, slot] = sizes_m[column][g, places[k] - g * room]
    return rows, present, index
