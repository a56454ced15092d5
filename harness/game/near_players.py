"""Selection of the background vehicles that are near enough to a player to affect the game."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.jit import compiled
from harness.game.state import NOTICED_M


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
