"""What can be said of the players at one moment: the quantities that observations, payoffs and metrics share.

Each is worked out when first asked for, once per step, so that a quantity nobody uses costs nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from harness.compiling import compiled
from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.bicycle import Actuators, lateral_acceleration_mps2
from harness.game.geometry import Box, distance_to_nearest_box, time_to_first_contact
from harness.game.road import MARGIN_M, SPACING_M, Road
from harness.game.state import Bodies, State

PATH_M = np.array([-20.0, -10.0, 0.0, 5.0, 10.0, 20.0, 30.0, 50.0])  # where the way is looked at, from a player
SIGHT_M = 60.0  # beyond it a body is not taken for a leader
REACH_M = 10.0  # clearances are known up to here
_OF_PLACES = {"_rows", "path_rows", "path", "speed_limit_mps", "_lane", "lane_end_m", "goal_m", "relative", "on_path"}
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


class Relative(NamedTuple):
    """Bodies in each player's own frame, [G, P, B]."""

    ahead_m: FloatArray
    left_m: FloatArray
    distance_m: FloatArray
    turned_rad: FloatArray


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

    def in_places(self, state: State, bodies: Bodies) -> Quantities:
        """The quantities of the same moment with everyone in the same place, though some are slower, or gone."""
        others = Quantities(self.world, state, bodies, self.advanced_m, self.lateral_offset_m)
        vars(others).update((name, kept) for name, kept in vars(self).items() if name in _OF_PLACES)
        return others

    # --- the way ahead -----------------------------------------------------------------------------------------

    @cached_property
    def _rows(self) -> IntArray:
        return self.world.road.routes.rows(self.state.station_m)

    @cached_property
    def path_rows(self) -> IntArray:
        """[G, P, K] the rows of the table of routes at `PATH_M`."""
        routes = self.world.road.routes
        return _path_rows(self._rows, routes.first_row, routes.last_row)

    @cached_property
    def path(self) -> Path:
        """The route at `PATH_M`."""
        return Path(*(getattr(self.world.road.routes, name)[self.path_rows] for name in Path._fields))

    @property
    def speed_mps(self) -> FloatArray:
        return self.state.speed_mps

    @cached_property
    def speed_limit_mps(self) -> FloatArray:
        return self.world.road.routes.speed_limit_mps[self._rows]

    @cached_property
    def speed_over_limit(self) -> FloatArray:
        """Speed over the limit as a share of it; negative below."""
        return self.state.speed_mps / self.speed_limit_mps - 1.0

    @cached_property
    def _lane(self) -> tuple[FloatArray, FloatArray]:
        return self.world.road.routes.nearest_lane(self._rows, self.lateral_offset_m)

    @cached_property
    def lane_offset_m(self) -> FloatArray:
        """Distance from the centre of the nearest lane."""
        return self._lane[0]

    @cached_property
    def lane_end_m(self) -> FloatArray:
        """Distance until the lane the player is in ends; inf if it goes on."""
        return np.maximum(self._lane[1] - self.state.station_m, 0.0)

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
    def seen(self) -> BoolArray:
        """[G, P, B] visible bodies that the player does not overlook."""
        return self.visible & (self.relative.ahead_m >= self.state.overlooked_m[..., None])

    @cached_property
    def relative(self) -> Relative:
        """Bodies in the player's own frame."""
        state, bodies = self.state, self.bodies
        own = (state.x_m, state.y_m, state.heading_rad)
        return Relative(*_relative(*own, bodies.x_m, bodies.y_m, bodies.heading_rad))

    @cached_property
    def on_path(self) -> OnPath:
        """Bodies along the player's route, each seen from the nearest of the route's frames at `PATH_M`."""
        bodies, routes = self.bodies, self.world.road.routes
        lines = (routes.x_m, routes.y_m, routes.heading_rad, routes.cos, routes.sin)
        boxes = (bodies.x_m, bodies.y_m, bodies.heading_rad, bodies.length_m, bodies.width_m)
        ahead, left, half_length, half_width = _on_path(self.path_rows, *lines, *boxes)
        to_row_m = (self._rows - routes.first_row) * SPACING_M - MARGIN_M - self.state.station_m  # the rounding of rows
        ahead += to_row_m[..., None]
        left -= self.lateral_offset_m[..., None]
        return OnPath(ahead, left, half_length, half_width)

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
        return distance_to_nearest_box(self._cars, self._boxes, self.visible, REACH_M)

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
def _path_rows(rows: IntArray, first_row: IntArray, last_row: IntArray) -> IntArray:
    found = np.empty((*rows.shape, len(_PATH_ROWS)), dtype=rows.dtype)
    for g, p in np.ndindex(rows.shape):
        for k in range(len(_PATH_ROWS)):
            found[g, p, k] = min(max(rows[g, p] + _PATH_ROWS[k], first_row[p]), last_row[p])
    return found


@compiled
def _visible(players: BoolArray, bodies: BoolArray) -> BoolArray:
    found = np.empty((players.shape[0], players.shape[1], bodies.shape[1]), dtype=np.bool_)
    for g, p, b in np.ndindex(found.shape):
        found[g, p, b] = players[g, p] and bodies[g, b] and p != b
    return found


@compiled
def _relative(
    own_x_m: FloatArray,
    own_y_m: FloatArray,
    own_heading_rad: FloatArray,
    x_m: FloatArray,
    y_m: FloatArray,
    heading_rad: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    shape = (own_x_m.shape[0], own_x_m.shape[1], x_m.shape[1])
    ahead, left, distance, turned = np.empty(shape), np.empty(shape), np.empty(shape), np.empty(shape)
    for g, p in np.ndindex(own_x_m.shape):
        cos, sin = np.cos(own_heading_rad[g, p]), np.sin(own_heading_rad[g, p])
        for b in range(x_m.shape[1]):
            dx, dy = x_m[g, b] - own_x_m[g, p], y_m[g, b] - own_y_m[g, p]
            ahead[g, p, b], left[g, p, b] = dx * cos + dy * sin, dy * cos - dx * sin
            distance[g, p, b] = np.hypot(dx, dy)
            turned[g, p, b] = heading_rad[g, b] - own_heading_rad[g, p]
    return ahead, left, distance, turned


@compiled
def _on_path(
    path_rows: IntArray,
    line_x_m: FloatArray,
    line_y_m: FloatArray,
    line_heading_rad: FloatArray,
    line_cos: FloatArray,
    line_sin: FloatArray,
    x_m: FloatArray,
    y_m: FloatArray,
    heading_rad: FloatArray,
    length_m: FloatArray,
    width_m: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Where bodies are from the middle row of the path and to the left of its line, and half the room they take."""
    shape = (path_rows.shape[0], path_rows.shape[1], x_m.shape[1])
    ahead, left, half_length, half_width = np.empty(shape), np.empty(shape), np.empty(shape), np.empty(shape)
    for g, p, b in np.ndindex(shape):
        nearest, nearest2 = 0, np.inf
        for k in range(path_rows.shape[2]):
            row = path_rows[g, p, k]
            away2 = (x_m[g, b] - line_x_m[row]) ** 2 + (y_m[g, b] - line_y_m[row]) ** 2
            if away2 < nearest2:
                nearest, nearest2 = k, away2
        row = path_rows[g, p, nearest]
        dx, dy = x_m[g, b] - line_x_m[row], y_m[g, b] - line_y_m[row]
        ahead[g, p, b] = dx * line_cos[row] + dy * line_sin[row] + PATH_M[nearest]
        left[g, p, b] = dy * line_cos[row] - dx * line_sin[row]
        turned = heading_rad[g, b] - line_heading_rad[row]
        cos, sin = abs(np.cos(turned)), abs(np.sin(turned))
        half_length[g, p, b] = 0.5 * (length_m[g, b] * cos + width_m[g, b] * sin)
        half_width[g, p, b] = 0.5 * (length_m[g, b] * sin + width_m[g, b] * cos)
    return ahead, left, half_length, half_width
