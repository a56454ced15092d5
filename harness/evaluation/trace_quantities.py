"""The quantities of a recorded game in every step, computed from its trace for all steps at once.

The games' axis of `game.quantities`, on which payoffs and metrics are based, is the steps' axis here: row t of the
arrays [T, P] is step t.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.junctions import SIGNALS, Signal
from harness.game.quantities import Quantities
from harness.game.road import MARGIN_M, SPACING_M, Routes
from harness.game.state import Bodies, State
from harness.game.world import World


@dataclass(frozen=True, kw_only=True)
class Series:
    """[T, P] of the players while they drove, NaN otherwise; inf without a leader or a collision course."""

    leader_gap_m: FloatArray
    time_to_collision_s: FloatArray


def series_of(trace: pd.DataFrame, world: World, sizes_m: Mapping[str, tuple[float, float]]) -> Series:
    """The series of one game's trace. `sizes_m` are length and width of each road user in it, by its name."""
    quantities = quantities_of(trace, world, sizes_m)
    drove = drove_in(trace, world.roles)
    return Series(
        leader_gap_m=np.where(drove, quantities.leader_gap_m, np.nan),
        time_to_collision_s=np.where(drove, quantities.time_to_collision_s, np.nan),
    )


def sizes_by_name(trace: pd.DataFrame, types_m: Mapping[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
    """Length and width of each road user in a trace, by its name, given those of vehicle types; by default SUMO's."""
    kinds = trace.drop_duplicates("player")
    return {
        str(name): types_m.get(str(kind), _USUAL_SIZE_M)
        for name, kind in zip(kinds["player"], kinds["vehicle_type"], strict=True)
    }


def obstacle_names(world: World) -> list[str]:
    """The names of the obstacles in traces, in the order of the scene."""
    return [f"obstacle_{number}" for number in range(1, len(world.hiding.obstacles) + 1)]


def body_names(trace: pd.DataFrame, world: World) -> list[str]:
    """The names of the bodies of `quantities_of`, in their order: players, other road users, obstacles."""
    obstacles = obstacle_names(world)
    others = set(trace["player"]) - {*world.roles, *obstacles}
    return [*world.roles, *sorted(others), *obstacles]


def quantities_of(
    trace: pd.DataFrame,
    world: World,
    sizes_m: Mapping[str, tuple[float, float]],
) -> Quantities:
    """The quantities of every step of one game. They do not depend on the previous step (advanced_m is 0).

    The position along the route is located separately in each step: on a route that crosses itself, a player on the
    crossing may be located on the other branch.
    """
    roles = world.roles
    names = body_names(trace, world)
    players, places = len(roles), _places(trace, names)
    present = _filled(places, np.ones(len(trace), dtype=bool))
    motion = {name: _filled(places, trace[name].to_numpy()) for name in _MOTION}
    sizes = np.array([sizes_m.get(name, (0.0, 0.0)) for name in names])
    state = State.empty(len(present), players, len(world.right_of_way.signal_links))
    state.friction[:] = world.actuators.friction  # that of the game is not in its trace
    state.signals = _signals(trace, len(present), world.right_of_way.signal_links)
    for name in ("x_m", "y_m", "heading_rad", "speed_mps", "acceleration_mps2", "steering_rad", "lapsed"):
        setattr(state, name, motion[name][:, :players].copy())
    state.present = present[:, :players].copy()
    state.friction[:] = world.actuators.friction
    bodies = Bodies(
        motion["x_m"],
        motion["y_m"],
        motion["heading_rad"],
        motion["speed_mps"],
        np.tile(sizes[:, 0], (len(present), 1)),
        np.tile(sizes[:, 1], (len(present), 1)),
        present,
    )
    station_m = _stations_m(world.road.routes, state.x_m, state.y_m)
    state.station_m, offset_m = world.road.routes.locate(state.x_m, state.y_m, station_m)
    return Quantities(world, state, bodies, np.zeros_like(offset_m), offset_m)


def _signals(trace: pd.DataFrame, steps: int, links: Sequence[tuple[str, int]]) -> IntArray:
    """[T, L] states of signal links; off in a trace without them."""
    states = np.zeros((steps, len(links)), dtype=np.int8)
    if not links or "signals" not in trace:
        return states
    by_step = trace.drop_duplicates("step")
    for step, text in zip(by_step["step"].tolist(), by_step["signals"].tolist(), strict=True):
        states[step] = _states_of(str(text), tuple(links))
    return states


@lru_cache(maxsize=1024)
def _states_of(text: str, links: tuple[tuple[str, int], ...]) -> tuple[int, ...]:
    """The states of links in a cell of the trace, `id=state` of each light separated by spaces."""
    lights = dict(each.rpartition("=")[::2] for each in text.split())  # an id may contain '='
    letters = (lights.get(light, "")[link : link + 1] for light, link in links)
    return tuple(int(SIGNALS.get(letter, Signal.OFF)) for letter in letters)


def drove_in(trace: pd.DataFrame, roles: Sequence[str]) -> BoolArray:
    """[T, P] whether each player (`roles` [P]) was driving: present, and its game had not ended in an earlier step."""
    places = _places(trace, roles)
    there = _filled(places, np.ones(len(trace), dtype=bool))
    running = _filled(places, (trace["outcome"] == "").to_numpy())
    return there & np.concatenate((np.ones((1, len(roles)), dtype=bool), running[:-1]))


_USUAL_SIZE_M = (5.0, 1.8)  # of SUMO's default vehicle type
_MOTION = ("x_m", "y_m", "heading_rad", "speed_mps", "acceleration_mps2", "steering_rad", "lapsed")
_Places = tuple[tuple[int, int], BoolArray, IntArray, IntArray]


def _places(trace: pd.DataFrame, names: Sequence[str]) -> _Places:
    """The shape [T, names] of a trace, which of its rows are of `names`, and the step and column of each of those."""
    column = trace["player"].map({name: place for place, name in enumerate(names)})
    known = column.notna().to_numpy()
    steps = trace["step"].to_numpy(dtype=np.int64)
    shape = (int(steps.max()) + 1, len(names))
    return shape, known, steps[known], column[known].to_numpy(dtype=np.int64)


def _filled(places: _Places, values: NDArray) -> NDArray:
    shape, known, steps, columns = places
    filled = np.zeros(shape, dtype=values.dtype)
    filled[steps, columns] = values[known]
    return filled


def _stations_m(routes: Routes, x_m: FloatArray, y_m: FloatArray) -> FloatArray:
    """[T, P] the table's station nearest to each player."""
    stations = []
    for player in range(x_m.shape[1]):
        rows = slice(routes.first_row[player], routes.last_row[player] + 1)
        away = (routes.x_m[rows] - x_m[:, player, None]) ** 2 + (routes.y_m[rows] - y_m[:, player, None]) ** 2
        stations.append(away.argmin(1) * SPACING_M - MARGIN_M)
    return np.stack(stations, axis=1)
