"""Positions, angles and speeds of the vehicles in SUMO that are near enough to a player to affect the game.

Most of the time of a libsumo call from Python goes into the conversion of arguments and result; the C++ function takes
a third of it. On Linux x86-64, a compiled loop therefore calls the C++ functions of libsumo's public interface, in the
library that Python has loaded. The names of the functions there, and the layouts of the string and of the position
that they exchange, are fixed by the platform's C++ ABI. Elsewhere, and if the library has no such functions, Python
calls them. The numbers are the same.

A C++ function ends the process if it does not know a vehicle. `BackgroundTraffic` makes sure that SUMO has every
vehicle that is read directly.
"""

from __future__ import annotations

import ctypes
import platform
from itertools import chain
from typing import Any, NamedTuple

import numpy as np
from libsumo import _libsumo  # the same functions without Python wrappers, for frequent calls
from llvmlite import binding
from numba import types
from numpy.typing import NDArray

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.jit import compiled
from harness.game.state import NOTICED_M

_STRING = "RKNSt7__cxx1112basic_stringIcSt11char_traitsIcESaIcEEE"  # const std::string&
_SYMBOLS = {
    "harness_vehicle_position": f"_ZN7libsumo7Vehicle11getPositionE{_STRING}b",
    "harness_vehicle_angle": f"_ZN7libsumo7Vehicle8getAngleE{_STRING}",
    "harness_vehicle_speed": f"_ZN7libsumo7Vehicle8getSpeedE{_STRING}",
}
# A position is returned in memory of the caller, whose address is the first argument. It is a TraCIPosition: the
# address of its virtual functions, then x, y, z.
_position: Any = types.ExternalFunction("harness_vehicle_position", types.void(types.intp, types.intp, types.int32))
_angle: Any = types.ExternalFunction("harness_vehicle_angle", types.float64(types.intp))
_speed: Any = types.ExternalFunction("harness_vehicle_speed", types.float64(types.intp))
_X, _Y, _ROOM = 1, 2, 8  # a position in units of 8 bytes; the room exceeds it
_RECORD_BYTES = 32


def _found() -> bool:
    """Whether libsumo has the C++ functions. Compiled code finds them from now on."""
    if (platform.system(), platform.machine()) != ("Linux", "x86_64"):
        return False
    library = ctypes.CDLL(_libsumo.__file__)
    for name, symbol in _SYMBOLS.items():
        function = getattr(library, symbol, None)
        if function is None:
            return False
        binding.add_symbol(name, ctypes.cast(function, ctypes.c_void_p).value)
    return True


DIRECT = _found()
"""Whether vehicles can be read directly in this process."""


def string_record(text: bytes) -> tuple[int, int, int, int]:
    """The contents of a std::string [4] of 8 bytes each with this text. The text must outlive it."""
    return ctypes.cast(ctypes.c_char_p(text), ctypes.c_void_p).value or 0, len(text), 0, 0


class NearSearch(NamedTuple):
    """What decides which vehicles are near a player, and when to read the others again."""

    due_in: IntArray  # [G, N] the step in which to read each vehicle of a table again; written by `_is_near`
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


def read_near(
    search: NearSearch, names: NDArray[np.object_], *, records: NDArray[np.uint64], due: IntArray, direct: bool
) -> tuple[IntArray, FloatArray]:
    """The vehicles near a player among those at flat places `due` [n] of a table [G, N]: their places [m] and motion.

    Motion [4, m] is x and y of the front bumper (m, without the offset of the tile), SUMO's angle (degrees) and speed
    (m/s). names [G, N] and records [G, N, 4] are the vehicles' names in SUMO, as text and as `string_record`. With
    `direct`, SUMO must have the vehicles; otherwise libsumo raises TraCIException for a vehicle that it does not have.
    """
    if direct:
        return _read_near(search, records, due)
    named = names.ravel()[due].tolist()
    fronts = np.fromiter(chain.from_iterable(map(_libsumo.vehicle_getPosition, named)), float, 2 * len(due))
    fronts_m = fronts.reshape(-1, 2)
    near = _near(search, due, fronts_m)
    named = [named[k] for k in near.tolist()]
    motion = np.empty((4, len(near)))
    motion[:2] = fronts_m[near].T
    motion[2] = np.fromiter(map(_libsumo.vehicle_getAngle, named), float, len(near))
    motion[3] = np.fromiter(map(_libsumo.vehicle_getSpeed, named), float, len(near))
    return due[near], motion


@compiled
def _is_near(search: NearSearch, place: int, front_x_m: float, front_y_m: float) -> bool:
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
def _near(search: NearSearch, due: IntArray, fronts_m: FloatArray) -> IntArray:
    """[m] indices of the vehicles near a player, of those at flat places [n] with front bumpers [n, 2]. In place: the y
    of the bumpers loses the offset of the tile, and `due_in` is written as by `_is_near`."""
    near, count = np.empty(len(due), dtype=np.int64), 0
    for k in range(len(due)):
        fronts_m[k, 1] -= search.offsets_m[due[k] // search.due_in.shape[1]]
        if _is_near(search, due[k], fronts_m[k, 0], fronts_m[k, 1]):
            near[count] = k
            count += 1
    return near[:count]


@compiled
def _read_near(search: NearSearch, records: NDArray[np.uint64], due: IntArray) -> tuple[IntArray, FloatArray]:
    """One pass, so that a vehicle is still in the processor's caches when its angle and speed are read."""
    places, motion, count = np.empty(len(due), dtype=np.int64), np.empty((4, len(due))), 0
    position = np.empty(_ROOM)
    for place in due:
        name = records.ctypes.data + _RECORD_BYTES * place
        _position(position.ctypes.data, name, 0)
        x_m, y_m = position[_X], position[_Y] - search.offsets_m[place // records.shape[1]]
        if _is_near(search, place, x_m, y_m):
            places[count], motion[0, count], motion[1, count] = place, x_m, y_m
            motion[2, count], motion[3, count] = _angle(name), _speed(name)
            count += 1
    return places[:count], motion[:, :count]
