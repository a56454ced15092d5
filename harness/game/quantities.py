"""What can be said of the players at one moment: the quantities that observations, payoffs and metrics share.

Each is worked out when first asked for, once per step, so that a quantity nobody uses costs nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.bicycle import Actuators, lateral_acceleration_mps2
from harness.game.geometry import Box, distance_to_nearest_box, time_to_first_contact
from harness.game.jit import compiled
from harness.game.road import MARGIN_M, SPACING_M, Along, Road, Routes, row_at
from harness.game.state import Bodies, Outcome, State

PATH_M = np.array([-20.0, -10.0, 0.0, 5.0, 10.0, 20.0, 30.0, 50.0])  # where the way is looked at, from a player
SIGHT_M = 60.0  # beyond it a body is not taken for a leader
REACH_M = 10.0  # clearances are known up to here
_PATH_ROWS = np.rint(PATH_M / SPACING_M).astype(np.int64)


@dataclass(frozen=True)
class World:
    """What does not change during a game: road, cars, step length. Sizes are [P]."""

    road: Road
    actuators: Actuators
    length_m: FloatArray
    width_m: FloatArray
    step_s: float
    time_limit_s: float

    @property
    def steps(self) -> int:
        """Steps until time is up."""
        return round(self.time_limit_s / self.step_s)


class Path(NamedTuple):
    """The route at `PATH_M` ahead of each player, [G, P, K]; edges are offsets from the route's line."""

    heading_rad: FloatArray
    left_edge_m: FloatArray
    right_edge_m: FloatArray


class OnPath(NamedTuple):
    """Bodies along each player's route, [G, P, B]: centres from the player's, and half the room they take."""

    ahead_m: FloatArray
    left_m: FloatArray
    half_length_m: FloatArray
    half_width_m: FloatArray


@dataclass
class Quantities:
    """The quantities of one moment. Arrays are [G, P], against every body [G, P, B], on the path [G, P, K]."""

    world: World
    state: State
    bodies: Bodies
    advanced_m: FloatArray  # along the route since the step before
    lateral_offset_m: FloatArray  # to the left of the route's line

    # --- the way ahead -----------------------------------------------------------------------------------------

    @cached_property
    def path_rows(self) -> IntArray:
        """[G, P, K] the rows of the table of routes at `PATH_M`."""
        routes = self.world.road.routes
        return _path_rows(routes.rows(self.state.station_m), routes.first_row, routes.last_row)

    @cached_property
    def path(self) -> Path:
        """The route at `PATH_M`."""
        return Path(*(getattr(self.world.road.routes, name)[self.path_rows] for name in Path._fields))

    @property
    def speed_mps(self) -> FloatArray:
        return self.state.speed_mps

    @cached_property
    def _along(self) -> Along:
        return self.world.road.routes.along(self.state.station_m, self.lateral_offset_m)

    @property
    def speed_limit_mps(self) -> FloatArray:
        return self._along.speed_limit_mps

    @cached_property
    def speed_over_limit(self) -> FloatArray:
        """Speed over the limit as a share of it; negative below."""
        return self.state.speed_mps / self.speed_limit_mps - 1.0

    @property
    def lane_offset_m(self) -> FloatArray:
        """Distance from the centre of the nearest lane."""
        return self._along.lane_offset_m

    @cached_property
    def lane_end_m(self) -> FloatArray:
        """Distance until the lane the player is in ends; inf if it goes on."""
        return np.maximum(self._along.lane_end_m - self.state.station_m, 0.0)

    @cached_property
    def goal_m(self) -> FloatArray:
        """Distance to the goal along the route; 0 or less once it is reached."""
        return self.world.road.routes.goal_m - self.state.station_m

    @cached_property
    def lateral_acceleration_mps2(self) -> FloatArray:
        return lateral_acceleration_mps2(self.state, self.world.actuators)

    # --- the others ----------------------------------------------------------------------------------------------

    @cached_property
    def visible(self) -> BoolArray:
        """[G, P, B] bodies that are there and are not the player itself."""
        return _visible(self.state.present, self.bodies.present)

    @cached_property
    def on_path(self) -> OnPath:
        """Bodies along the player's route, each seen from the nearest of the route's frames at `PATH_M`."""
        bodies = self.bodies
        boxes = (bodies.x_m, bodies.y_m, bodies.heading_rad, bodies.length_m, bodies.width_m)
        return OnPath(*_on_path(self.state.station_m, self.lateral_offset_m, tuple(self.world.road.routes), *boxes))

    @cached_property
    def leader_gap_m(self) -> FloatArray:
        """Trailing distance: gap to the nearest body ahead in the player's way, bumper to bumper along the route;
        inf where nobody leads."""
        path = self.on_path
        overlaps = np.abs(path.left_m) < path.half_width_m + 0.5 * self.world.width_m[:, None]
        leads = self.visible & overlaps & (path.ahead_m > 0.0) & (path.ahead_m < SIGHT_M)
        gap = path.ahead_m - path.half_length_m - 0.5 * self.world.length_m[:, None]
        return np.where(leads, np.maximum(gap, 0.0), np.inf).min(-1)

    @cached_property
    def time_gap_s(self) -> FloatArray:
        """Time headway without the leader's length: gap over own speed; inf where nobody leads."""
        return self.leader_gap_m / np.maximum(self.state.speed_mps, 0.1)

    # --- surfaces ------------------------------------------------------------------------------------------------

    @cached_property
    def _cars(self) -> Box:
        """The players' boxes: places [G, P], sizes [P]."""
        state, world = self.state, self.world
        return Box(state.x_m, state.y_m, state.heading_rad, world.length_m, world.width_m)

    @cached_property
    def _boxes(self) -> Box:
        """The bodies' boxes, [G, B]."""
        return Box(*(getattr(self.bodies, name) for name in Box._fields))

    @cached_property
    def vehicle_clearance_m(self) -> FloatArray:
        """Distance to the nearest other body; 0 where they touch, never over `REACH_M`."""
        return _vehicle_clearance_m(self._cars, self._boxes, self.state.present, self.bodies.present)

    @cached_property
    def rail_clearance_m(self) -> FloatArray:
        """Distance to the nearest edge of the drivable area; 0 where the car is on it, never over `REACH_M`."""
        return self.world.road.rails.distance_m(self._cars, REACH_M)

    @cached_property
    def clearance_m(self) -> FloatArray:
        """Distance to the nearest surface, vehicle or rail."""
        return np.minimum(self.vehicle_clearance_m, self.rail_clearance_m)

    @cached_property
    def touches_vehicle(self) -> BoolArray:
        return self.vehicle_clearance_m <= 0.0

    @cached_property
    def touches_rail(self) -> BoolArray:
        return self.rail_clearance_m <= 0.0

    @cached_property
    def time_to_collision_s(self) -> FloatArray:
        """Seconds until contact with another body if all keep heading and speed; inf if none would touch."""
        return time_to_first_contact(self._cars, self._boxes, self.state.speed_mps, self.bodies.speed_mps, self.visible)


@compiled
def terminations(
    outcome: IntArray,
    drove: BoolArray,
    taken_over: BoolArray,
    time_is_up: BoolArray,
    goal_m: FloatArray,
    vehicle_clearance_m: FloatArray,
    rail_clearance_m: FloatArray,
) -> None:
    """How the game of each player that drove [G, P] ended, if it did, in place: a contact counts before the goal, and
    the goal before time [G]. Players that SUMO drives [P] touch no rail."""
    for g, p in np.ndindex(outcome.shape):
        if drove[g, p]:
            if vehicle_clearance_m[g, p] <= 0.0:
                outcome[g, p] = Outcome.COLLISION
            elif rail_clearance_m[g, p] <= 0.0 and taken_over[p]:
                outcome[g, p] = Outcome.RAIL
            elif goal_m[g, p] <= 0.0:
                outcome[g, p] = Outcome.GOAL
            elif time_is_up[g]:
                outcome[g, p] = Outcome.TIMEOUT


@compiled
def row_ahead(row: int, k: int, first_row: int, last_row: int) -> int:
    """The row of a route at `PATH_M[k]` from a row of it."""
    return min(max(row + _PATH_ROWS[k], first_row), last_row)


@compiled
def _path_rows(rows: IntArray, first_row: IntArray, last_row: IntArray) -> IntArray:
    found = np.empty((*rows.shape, len(_PATH_ROWS)), dtype=rows.dtype)
    for g, p in np.ndindex(rows.shape):
        for k in range(len(_PATH_ROWS)):
            found[g, p, k] = row_ahead(rows[g, p], k, first_row[p], last_row[p])
    return found


@compiled
def _visible(players: BoolArray, bodies: BoolArray) -> BoolArray:
    found = np.empty((players.shape[0], players.shape[1], bodies.shape[1]), dtype=np.bool_)
    for g, p, b in np.ndindex(found.shape):
        found[g, p, b] = players[g, p] and bodies[g, b] and p != b
    return found


@compiled
def _vehicle_clearance_m(cars: Box, boxes: Box, players: BoolArray, bodies: BoolArray) -> FloatArray:
    return distance_to_nearest_box(cars, boxes, _visible(players, bodies), REACH_M)


@compiled
def _on_path(
    station_m: FloatArray,
    lateral_offset_m: FloatArray,
    table: tuple[Any, ...],
    x_m: FloatArray,
    y_m: FloatArray,
    heading_rad: FloatArray,
    length_m: FloatArray,
    width_m: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    routes = Routes(*table)
    shape = (station_m.shape[0], station_m.shape[1], x_m.shape[1])
    ahead, left, half_length, half_width = np.empty(shape), np.empty(shape), np.empty(shape), np.empty(shape)
    for g, p in np.ndindex(station_m.shape):
        station, offset = station_m[g, p], lateral_offset_m[g, p]
        row = row_at(station, routes.first_row[p], routes.last_row[p])
        for b in range(x_m.shape[1]):
            box = (x_m[g, b], y_m[g, b], heading_rad[g, b], length_m[g, b], width_m[g, b])
            room = along_route(row, station, offset, p, routes, *box)
            ahead[g, p, b], left[g, p, b], half_length[g, p, b], half_width[g, p, b] = room
    return ahead, left, half_length, half_width


@compiled
def along_route(
    row: int,
    station_m: float,
    offset_m: float,
    player: int,
    routes: Routes,
    x_m: float,
    y_m: float,
    heading_rad: float,
    length_m: float,
    width_m: float,
) -> tuple[float, float, float, float]:
    """A body along the route of a player at a row, station and lateral offset: how far its centre is ahead and to the
    left, and half the room it takes, in the nearest of the route's frames at `PATH_M`."""
    first, last = routes.first_row[player], routes.last_row[player]
    nearest, nearest2 = 0, np.inf
    for k in range(len(_PATH_ROWS)):
        there = row_ahead(row, k, first, last)
        away2 = (x_m - routes.x_m[there]) ** 2 + (y_m - routes.y_m[there]) ** 2
        if away2 < nearest2:
            nearest, nearest2 = k, away2
    there = row_ahead(row, nearest, first, last)
    dx, dy = x_m - routes.x_m[there], y_m - routes.y_m[there]
    cosine, sine = routes.cos[there], routes.sin[there]
    ahead, left = dx * cosine + dy * sine + PATH_M[nearest], dy * cosine - dx * sine
    to_row_m = (row - first) * SPACING_M - MARGIN_M - station_m  # the rounding of rows
    turned = heading_rad - routes.heading_rad[there]
    along, across = abs(np.cos(turned)), abs(np.sin(turned))
    half_length = 0.5 * (length_m * along + width_m * across)
    return ahead + to_row_m, left - offset_m, half_length, 0.5 * (length_m * across + width_m * along)
