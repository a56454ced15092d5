"""What can be said of the players at one moment: the quantities that observations, payoffs and metrics share.

Each is worked out when first asked for, once per step, so that a quantity nobody uses costs nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from harness.game import geometry
from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.bicycle import Actuators, lateral_acceleration_mps2
from harness.game.geometry import Box
from harness.game.road import MARGIN_M, SPACING_M, Road
from harness.game.state import Bodies, State

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

    x_m: FloatArray
    y_m: FloatArray
    heading_rad: FloatArray
    cos: FloatArray
    sin: FloatArray
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

    # --- the way ahead -----------------------------------------------------------------------------------------

    @cached_property
    def _rows(self) -> IntArray:
        return self.world.road.routes.rows(self.state.station_m)

    @cached_property
    def path(self) -> Path:
        """The route at `PATH_M`."""
        routes = self.world.road.routes
        rows = self._rows[..., None] + _PATH_ROWS
        rows = np.minimum(np.maximum(rows, routes.first_row[:, None]), routes.last_row[:, None])
        return Path(*(getattr(routes, name)[rows] for name in Path._fields))

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
        routes = self.world.road.routes
        away = np.abs(routes.lane_offset_m[self._rows] - self.lateral_offset_m[..., None])
        away[np.isnan(away)] = np.inf
        return away.min(-1), _at(routes.lane_end_m[self._rows], away.argmin(-1))

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
        players = self.state.x_m.shape[1]
        others = np.arange(players)[:, None] != np.arange(self.bodies.x_m.shape[1])
        return self.bodies.present[:, None, :] & self.state.present[:, :, None] & others

    @cached_property
    def seen(self) -> BoolArray:
        """[G, P, B] visible bodies that the player does not overlook."""
        return self.visible & (self.relative.ahead_m >= self.state.overlooked_m[..., None])

    @cached_property
    def relative(self) -> Relative:
        """Bodies in the player's own frame."""
        state, bodies = self.state, self.bodies
        cos, sin = np.cos(state.heading_rad)[..., None], np.sin(state.heading_rad)[..., None]
        dx = bodies.x_m[:, None, :] - state.x_m[..., None]
        dy = bodies.y_m[:, None, :] - state.y_m[..., None]
        turned = bodies.heading_rad[:, None, :] - state.heading_rad[..., None]
        return Relative(dx * cos + dy * sin, dy * cos - dx * sin, np.hypot(dx, dy), turned)

    @cached_property
    def on_path(self) -> OnPath:
        """Bodies along the player's route, each seen from the nearest of the route's frames at `PATH_M`."""
        path, bodies = self.path, self.bodies
        cos, sin = path.cos[:, :, None, :], path.sin[:, :, None, :]
        dx = bodies.x_m[:, None, :, None] - path.x_m[:, :, None, :]
        dy = bodies.y_m[:, None, :, None] - path.y_m[:, :, None, :]
        along = dx * cos + dy * sin
        nearest = (dx * dx + dy * dy).argmin(-1)
        left = _at(dy * cos - dx * sin, nearest) - self.lateral_offset_m[..., None]
        turned = bodies.heading_rad[:, None, :] - _at(
            np.broadcast_to(path.heading_rad[:, :, None, :], along.shape), nearest
        )
        cos, sin = np.abs(np.cos(turned)), np.abs(np.sin(turned))
        half_length, half_width = 0.5 * bodies.length_m[:, None, :], 0.5 * bodies.width_m[:, None, :]
        routes = self.world.road.routes
        to_row_m = (self._rows - routes.first_row) * SPACING_M - MARGIN_M - self.state.station_m  # the rounding of rows
        return OnPath(
            _at(along, nearest) + PATH_M[nearest] + to_row_m[..., None],
            left,
            half_length * cos + half_width * sin,
            half_length * sin + half_width * cos,
        )

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

    def _pairs(self, pairs: BoolArray) -> tuple[IntArray, IntArray, IntArray, Box, Box]:
        """Game, player and body of the pairs marked in [G, P, B], and their boxes: the player's, the body's."""
        state, bodies, world = self.state, self.bodies, self.world
        g, p, b = np.nonzero(pairs)
        own = Box(state.x_m[g, p], state.y_m[g, p], state.heading_rad[g, p], world.length_m[p], world.width_m[p])
        other = Box(*(getattr(bodies, name)[g, b] for name in Box._fields))
        return g, p, b, own, other

    @cached_property
    def vehicle_clearance_m(self) -> FloatArray:
        """Distance to the nearest other body; 0 where they touch, never over `REACH_M`."""
        bodies, world = self.bodies, self.world
        radii = 0.5 * np.hypot(bodies.length_m, bodies.width_m)[:, None, :]
        radii = radii + 0.5 * np.hypot(world.length_m, world.width_m)[:, None]
        g, p, _, own, other = self._pairs(self.visible & (self.relative.distance_m - radii < REACH_M))
        nearest = np.full(self.state.x_m.shape, REACH_M)
        np.minimum.at(nearest, (g, p), geometry.box_distance(own, other))
        return nearest

    @cached_property
    def rail_clearance_m(self) -> FloatArray:
        """Distance to the nearest edge of the drivable area; 0 where the car is on it, never over `REACH_M`."""
        state, world = self.state, self.world
        segments = world.road.rails.near(state.x_m, state.y_m)
        shape = state.x_m.shape
        own = Box(
            state.x_m[..., None],
            state.y_m[..., None],
            state.heading_rad[..., None],
            np.broadcast_to(world.length_m, shape)[..., None],
            np.broadcast_to(world.width_m, shape)[..., None],
        )
        return np.minimum(geometry.box_segment_distance(own, segments).min(-1), REACH_M)

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
        state, bodies = self.state, self.bodies
        g, p, b, own, other = self._pairs(self.visible)
        own_speed, speed = state.speed_mps[g, p], bodies.speed_mps[g, b]
        velocity_x = speed * np.cos(other.heading_rad) - own_speed * np.cos(own.heading_rad)
        velocity_y = speed * np.sin(other.heading_rad) - own_speed * np.sin(own.heading_rad)
        soonest = np.full(state.x_m.shape, np.inf)
        np.minimum.at(soonest, (g, p), geometry.time_to_contact(own, other, velocity_x, velocity_y))
        return soonest


def _at(values: FloatArray, chosen: IntArray) -> FloatArray:
    """[...] the entry chosen [...] of the last axis of values [..., K]."""
    flat = values.reshape(-1, values.shape[-1])
    return flat[np.arange(flat.shape[0]), chosen.reshape(-1)].reshape(chosen.shape)
