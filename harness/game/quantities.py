"""The quantities of one moment that observations, payoffs and metrics share.

Each quantity is computed on first use, once per step. Unused quantities cost nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from operator import attrgetter

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.bicycle import lateral_acceleration_mps2
from harness.game.geometry import Box, distance_to_nearest_box, time_to_first_contact
from harness.game.jit import compiled
from harness.game.meetings import HORIZON_S, STANDING_MPS, Meetings, meetings, no_meetings
from harness.game.road import SPACING_M, Along, along
from harness.game.route_coordinates import PATH_M, OnPath, on_path
from harness.game.sight import hidden
from harness.game.state import Bodies, State
from harness.game.traffic_rules import TrafficRules, rules
from harness.game.world import World

SIGHT_M = 60.0  # a body farther ahead than this is not a leader
REACH_M = 10.0  # largest clearance that is computed


@dataclass
class Quantities:
    """The quantities of one moment: [G, P], per body [G, P, B], per distance on the path [G, P, K]."""

    world: World
    state: State
    bodies: Bodies
    advanced_m: FloatArray  # along the route since the previous step
    lateral_offset_m: FloatArray  # from the route's line, left positive
    gained_mps2: FloatArray  # change of the acceleration since the previous step

    # --- columns of `state`, `along` and `rules` that personas, metrics and rules use by name ---------------------

    speed_mps = property(attrgetter("state.speed_mps"))
    speed_limit_mps = property(attrgetter("along.speed_limit_mps"))
    lane_offset_m = property(attrgetter("along.lane_offset_m"))
    lane_end_m = property(attrgetter("along.lane_end_m"))
    goal_m = property(attrgetter("along.goal_m"))
    wrong_way = property(attrgetter("along.wrong_way"))
    passed_red_s = property(attrgetter("rules.passed_red_s"))
    due_mps = property(attrgetter("rules.due_mps"))

    # --- the route ahead ---------------------------------------------------------------------------------------

    @cached_property
    def path_heading_rad(self) -> FloatArray:
        """Headings of the route at `PATH_M`."""
        routes = self.world.road.routes
        rows = routes.rows(self.state.station_m)[..., None] + np.rint(PATH_M / SPACING_M).astype(np.int64)
        return routes.heading_rad[np.clip(rows, routes.first_row[:, None], routes.last_row[:, None])]

    @cached_property
    def along(self) -> Along:
        """The route at the players."""
        state, car = self.state, self.world.actuators
        players = (state.station_m, self.lateral_offset_m, state.speed_mps)
        wheels = (car.wheelbase_m, car.steering_lag_s)
        return Along(*along(players, state.limit_share, wheels, tuple(self.world.road.routes)))

    @cached_property
    def speed_over_limit(self) -> FloatArray:
        """Excess over the speed limit as a share of the limit; negative below the limit."""
        return self.state.speed_mps / self.speed_limit_mps - 1.0

    @property
    def jerk_mps3(self) -> FloatArray:
        """Change of the acceleration along the heading per second."""
        return self.gained_mps2 / self.world.step_s

    @cached_property
    def lateral_acceleration_mps2(self) -> FloatArray:
        return lateral_acceleration_mps2(self.state, self.world.actuators)

    # --- signals, signs and priority ---------------------------------------------------------------------------

    @cached_property
    def front_m(self) -> FloatArray:
        """Station of the front bumper."""
        return self.state.station_m + 0.5 * self.world.length_m

    @cached_property
    def rules(self) -> TrafficRules:
        """What signals, signs and right of way ask of the players, and what they did."""
        state, tables = self.state, self.world.right_of_way
        players = (state.station_m, self.advanced_m, state.speed_mps, self.along.approach_mps, self.world.length_m)
        records = (tables.stop_lines, tables.conflicts, self.meetings)
        next_line, numbers = rules(players, (state.signals, state.signal_s), tuple(map(tuple, records)))
        return TrafficRules(next_line, *numbers)

    @cached_property
    def speed_over_permitted(self) -> FloatArray:
        """Excess over the permitted speed as a share of the limit; negative below it, but 0 while the player waits."""
        speed_mps, asked = self.state.speed_mps, self.rules
        over_mps = np.maximum(speed_mps - asked.permitted_mps, 0.0) + np.minimum(speed_mps - asked.due_mps, 0.0)
        return over_mps / self.speed_limit_mps

    @cached_property
    def on_carriageway(self) -> FloatArray:
        """1 for a player on foot whose centre is on the carriageway, else 0."""
        return self.world.on_carriageway(self.state.x_m, self.state.y_m)

    @property
    def stands(self) -> FloatArray:
        """1 for a player that stands, else 0."""
        return (np.abs(self.state.speed_mps) <= STANDING_MPS).astype(float)

    # --- other bodies --------------------------------------------------------------------------------------------

    @cached_property
    def visible(self) -> BoolArray:
        """[G, P, B] bodies that are present and are not the player itself."""
        return _visible(self.state.present, self.bodies.present)

    @cached_property
    def hidden(self) -> BoolArray:
        """[G, P, B] bodies that a player does not see because something hides them (`game.sight`)."""
        state, bodies, hiding = self.state, self.bodies, self.world.hiding
        if not hiding.anything:
            return np.zeros((*state.present.shape, bodies.present.shape[1]), dtype=bool)
        of_players = (state.x_m, state.y_m, state.present)
        return hidden(of_players, tuple(bodies), (hiding.obstacles, hiding.walls), hiding.vehicles)

    @cached_property
    def on_path(self) -> OnPath:
        """Bodies in route coordinates, each in the nearest frame of the route at `PATH_M`."""
        routes, boxes = tuple(self.world.road.routes), tuple(self.bodies.boxes)
        return OnPath(*on_path(self.state.station_m, self.lateral_offset_m, routes, boxes))

    @cached_property
    def leader_gaps_m(self) -> FloatArray:
        """[G, P, B] gaps to the bodies ahead that overlap the player's width; inf to others."""
        path = self.on_path
        overlaps = np.abs(path.left_m) < path.half_width_m + 0.5 * self.world.width_m[:, None]
        leads = self.visible & overlaps & (path.ahead_m > 0.0) & (path.ahead_m < SIGHT_M)
        gap = path.ahead_m - path.half_length_m - 0.5 * self.world.length_m[:, None]
        return np.where(leads, np.maximum(gap, 0.0), np.inf)

    @cached_property
    def leader_gap_m(self) -> FloatArray:
        """Trailing distance: gap, bumper to bumper along the route, to the nearest body ahead that overlaps the
        player's width; inf without one."""
        return self.leader_gaps_m.min(-1)

    @cached_property
    def leader(self) -> IntArray:
        """The body with this gap; -1 without one."""
        return np.where(np.isfinite(self.leader_gap_m), self.leader_gaps_m.argmin(-1), -1)

    @cached_property
    def time_gap_s(self) -> FloatArray:
        """Time headway without the leader's length: gap over own speed; inf without a leader."""
        return self.leader_gap_m / np.maximum(self.state.speed_mps, 0.1)

    @cached_property
    def leader_ttc_s(self) -> FloatArray:
        """Time to collision with the leader at constant speeds; inf without a leader, or if the gap does not close."""
        bodies, leader = self.bodies, np.maximum(self.leader, 0)
        speed_mps, heading_rad = (
            np.take_along_axis(of, leader, 1) for of in (bodies.speed_mps, bodies.boxes.heading_rad)
        )
        closing_mps = self.state.speed_mps - speed_mps * np.cos(heading_rad - self.state.heading_rad)
        ttc_s = self.leader_gap_m / np.maximum(closing_mps, 1e-3)
        return np.where((self.leader >= 0) & (closing_mps > 0.0), ttc_s, np.inf)

    @cached_property
    def meetings(self) -> Meetings:
        """Each player's conflict with each body at a junction."""
        state, bodies, tables = self.state, self.bodies, self.world.right_of_way
        if not len(tables.conflicts.player):
            return no_meetings((*state.present.shape, bodies.present.shape[1]))
        players = (state.station_m, self.lateral_offset_m, state.speed_mps, self.world.length_m, self.visible)
        conflict, numbers, must_yield = meetings(players, tuple(bodies), state.signals, tuple(tables.streams))
        return Meetings._make((conflict, *numbers, must_yield))

    @cached_property
    def gap_s(self) -> FloatArray:
        """Time between the player's passage of a zone of conflict and that of another body, both at constant speed; inf
        without a zone that the player reaches within `meetings.HORIZON_S`."""
        return _gap_s(self.meetings.own_s, self.meetings.gap_s)

    @cached_property
    def entered_before_s(self) -> FloatArray:
        """For a player that entered a zone in this step: the least time until a body with priority is there, 0 if it is
        there already; else inf."""
        met = self.meetings
        return _entered_before_s(self.advanced_m, met.own_m, met.other_s, met.must_yield)

    # --- surfaces ------------------------------------------------------------------------------------------------

    @cached_property
    def _cars(self) -> Box:
        """The players' boxes: places [G, P], sizes [P]."""
        state, world = self.state, self.world
        return Box(state.x_m, state.y_m, state.heading_rad, world.length_m, world.width_m)

    @cached_property
    def vehicle_clearance_m(self) -> FloatArray:
        """Distance to the nearest other body: 0 at contact, at most `REACH_M`."""
        return distance_to_nearest_box(self._cars, self.bodies.boxes, self.visible, REACH_M)

    @cached_property
    def rail_clearance_m(self) -> FloatArray:
        """Distance to the nearest edge of the drivable area, for walkers and cyclists on pavements of their surface: 0
        on the edge, at most `REACH_M`."""
        road = self.world.road
        distance_m = road.rails.distance_m(self._cars, REACH_M)
        if road.walkers_rails is None:
            return distance_m
        return np.where(self.world.walks, road.walkers_rails.distance_m(self._cars, REACH_M), distance_m)

    @cached_property
    def clearance_m(self) -> FloatArray:
        """Distance to the nearest surface, vehicle or rail."""
        return np.minimum(self.vehicle_clearance_m, self.rail_clearance_m)

    @cached_property
    def time_to_collision_s(self) -> FloatArray:
        """Seconds until contact with another body at constant headings and speeds; inf without a contact."""
        speeds_mps = (self.state.speed_mps, self.bodies.speed_mps)
        return time_to_first_contact(self._cars, self.bodies.boxes, speeds_mps, self.visible)


@compiled
def _visible(players: BoolArray, bodies: BoolArray) -> BoolArray:
    visible = np.empty((players.shape[0], players.shape[1], bodies.shape[1]), dtype=np.bool_)
    for g, p, b in np.ndindex(visible.shape):
        visible[g, p, b] = players[g, p] and bodies[g, b] and p != b
    return visible


@compiled
def _gap_s(own_s: FloatArray, gap_s: FloatArray) -> FloatArray:
    least_s = np.full(own_s.shape[:2], np.inf)
    for g, p, b in np.ndindex(own_s.shape):
        if own_s[g, p, b] < HORIZON_S:
            least_s[g, p] = np.minimum(least_s[g, p], gap_s[g, p, b])
    return least_s


@compiled
def _entered_before_s(
    advanced_m: FloatArray, own_m: FloatArray, other_s: FloatArray, must_yield: BoolArray
) -> FloatArray:
    least_s = np.full(advanced_m.shape, np.inf)
    for g, p, b in np.ndindex(own_m.shape):
        if must_yield[g, p, b] and own_m[g, p, b] <= 0.0 and own_m[g, p, b] + advanced_m[g, p] > 0.0:
            least_s[g, p] = np.minimum(least_s[g, p], other_s[g, p, b])
    return least_s
