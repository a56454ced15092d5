"""Positions, angles and speeds of the vehicles in SUMO that are near enough to a player to affect the game."""

from __future__ import annotations

from itertools import chain
from typing import Any, NamedTuple

import numpy as np
from libsumo import _libsumo  # the same functions without Python wrappers, for frequent calls
from numpy.typing import NDArray

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.jit import compiled
from harness.game.state import NOTICED_M


class NearSearch(NamedTuple):
    """What decides which vehicles are near a player, and when to read the others again."""

    due_in: IntArray  # [G, N] the step in which to read each vehicle of a table again; written by `_near`
    length_m: FloatArray  # [G, N]
    max_speed_mps: FloatArray  # [G, N]
    offsets_m: FloatArray  # [G] y offsets of the games' tiles
    players_x_m: FloatArray  # [G, P]
    players_y_m: FloatArray
    players_present: BoolArray
    fastest_player_mps: float
    step: int  # the current one
    step_s: float
    longest_wait: int  # steps
    all_vehicles: bool  # count as near


def read_near(search: NearSearch, names: NDArray[np.object_], due: IntArray) -> tuple[IntArray, FloatArray]:
    """The vehicles near a player among those at flat places `due` [n] of a table [G, N]: their places [m] and motion.

    Motion [4, m] is x and y of the front bumper (m, without the offset of the tile), SUMO's angle (degrees) and speed
    (m/s). names [G, N] are the vehicles' names in SUMO. libsumo raises TraCIException for a vehicle that it does not
    have.
    """
    named = names.ravel()[due].tolist()
    fronts = np.fromiter(chain.from_iterable(map(_libsumo.vehicle_getPosition, named)), float, 2 * len(due))
    fronts_m = fronts.reshape(-1, 2)
    near = _near(tuple(search), due, fronts_m)
    named = [named[k] for k in near.tolist()]
    motion = np.empty((4, len(near)))
    motion[:2] = fronts_m[near].T
    motion[2] = np.fromiter(map(_libsumo.vehicle_getAngle, named), float, len(near))
    motion[3] = np.fromiter(map(_libsumo.vehicle_getSpeed, named), float, len(near))
    return due[near], motion


@compiled
def _near(columns: tuple[Any, ...], due: IntArray, fronts_m: FloatArray) -> IntArray:
    """[m] indices of the vehicles that may be near a player, of those at flat places [n] with front bumpers [n, 2].

    In place: the y of the bumpers loses the offset of the tile, and `due_in` becomes the step in which to read a
    vehicle again. A near vehicle is due in the next step, any other in the first step in which it may have come near,
    at most `longest_wait` steps from now.
    """
    search, near, count = NearSearch(*columns), np.empty(len(due), dtype=np.int64), 0
    room = search.due_in.shape[1]
    for k, place in enumerate(due):
        game, column = place // room, place % room
        fronts_m[k, 1] -= search.offsets_m[game]
        distance_m = np.inf
        for p in range(search.players_present.shape[1]):
            if search.players_present[game, p]:
                dx, dy = fronts_m[k, 0] - search.players_x_m[game, p], fronts_m[k, 1] - search.players_y_m[game, p]
                distance_m = min(distance_m, np.hypot(dx, dy))
        # distances count from a vehicle's centre, which is behind its front by less than its length
        spare_m = distance_m - NOTICED_M - search.length_m[game, column]
        reach_m = (search.max_speed_mps[game, column] + search.fastest_player_mps) * search.step_s
        search.due_in[game, column] = search.step + int(max(min(spare_m / reach_m, search.longest_wait), 1.0))
        if search.all_vehicles or spare_m <= 0.0:
            near[count] = k
            count += 1
    return near[:count]
