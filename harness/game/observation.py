"""Observations of the players: own motion, the road ahead, signs and signals, and the other bodies that matter most.

An observation is in the player's own frame and holds only what a driver can see: no intentions, personas, payoffs or
plans. `harness.game.observation_layout` has its entries.

An error of estimated distances scales the distance of other bodies in their true direction. An error of closing speeds
adds a radial velocity to theirs (`game.human_limits`).

The free width at a distance ahead ends at the nearest surface on either side, rail or vehicle (paper, section 4.3.2:
the ego "seeks to maintain a large distance between itself and nearby objects").

The other bodies are those that the player may meet first: by the time to the conflict of the two ways, or by their
distance.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.jit import compiled
from harness.game.meetings import Meetings
from harness.game.observation_layout import BEHIND, COMPRESSED, ENTRIES, LAYOUT, OTHERS, SCALE, SIZE
from harness.game.quantities import Quantities
from harness.game.right_of_way import Control, Signal, StopLines
from harness.game.road import AHEAD_M, Along, Routes, row_at
from harness.game.route_coordinates import half_extents_m, place_along_route, row_ahead
from harness.game.sight import nothing_hidden

_EDGES = np.concatenate(([-2.5], 0.5 * (AHEAD_M[1:] + AHEAD_M[:-1]), [60.0]))  # bins of road around AHEAD_M
_COUNT = len(AHEAD_M)
_PATH_LEFT, _STOP_LINE, _LEADER = (LAYOUT.index(name) for name in ("path_left_m", "stop_line_m", "leader_seen"))
_TURNED, _BEND, _LEFT, _RIGHT = (
    LAYOUT.index(f"{name}@0m") for name in ("path_turned_rad", "path_bend_per_m", "free_left_m", "free_right_m")
)
_FIRST_OTHER = LAYOUT.index("other0_seen")

SEEN_M = 120.0  # bodies farther away are not in an observation
_NEARNESS_MPS = 10.0  # a body at a distance matters like a conflict in the time to cover it at this speed
_LEAST_MPS = 3.0  # a slower body may start to move


def observe(q: Quantities) -> FloatArray:
    """[G, P, SIZE] float32 in [-1, 1]: the players' observations; zeros for players that are not present."""
    state, bodies, actuators = q.state, q.bodies, q.world.actuators
    return _observe(
        *(state.x_m, state.y_m, state.heading_rad, state.speed_mps, state.acceleration_mps2, state.steering_rad),
        *(state.station_m, q.lateral_offset_m, state.present),
        (state.unseen_behind_m, state.sight_m, state.sight_cosine, state.distance_error, state.closing_error_per_s),
        *(bodies.x_m, bodies.y_m, bodies.heading_rad, bodies.speed_mps, bodies.length_m, bodies.width_m),
        bodies.present,
        q.hidden if q.world.hiding.anything else nothing_hidden((*state.present.shape, bodies.present.shape[1])),
        *(actuators.max_steering_rad, q.world.length_m, q.world.width_m, state.signal_s),
        *(q.rules.next_line, q.rules.posted_mps, state.signals),
        (tuple(q.world.road.routes), tuple(q.along), tuple(q.world.right_of_way.stop_lines), tuple(q.meetings)),
    )


@compiled
def _observe(
    x_m: FloatArray,
    y_m: FloatArray,
    heading_rad: FloatArray,
    speed_mps: FloatArray,
    acceleration_mps2: FloatArray,
    steering_rad: FloatArray,
    station_m: FloatArray,
    offset_m: FloatArray,
    present: BoolArray,
    sight: tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray],
    body_x_m: FloatArray,
    body_y_m: FloatArray,
    body_heading_rad: FloatArray,
    body_speed_mps: FloatArray,
    body_length_m: FloatArray,
    body_width_m: FloatArray,
    body_present: BoolArray,
    hidden: BoolArray,
    max_steering_rad: FloatArray,
    length_m: FloatArray,
    width_m: FloatArray,
    signal_s: FloatArray,
    next_line: IntArray,
    posted_mps: FloatArray,
    signals: IntArray,
    tables: tuple[tuple[Any, ...], tuple[Any, ...], tuple[Any, ...], tuple[Any, ...]],
) -> FloatArray:
    """One compiled pass: for the few games of a reset, several calls would cost more than their work."""
    routes, here = Routes(*tables[0]), Along(*tables[1])
    stop_lines, meetings = StopLines(*tables[2]), Meetings(*tables[3])
    unseen_behind_m, sight_m, sight_cosine, distance_error, closing_error_per_s = sight
    observation = np.zeros((*present.shape, SIZE), dtype=np.float32)
    view = np.empty(SIZE)
    bodies = body_present.shape[1]
    seen, urgency_s = np.empty(bodies, dtype=np.bool_), np.empty(bodies)
    ahead_m, left_m = np.empty(bodies), np.empty(bodies)
    for g, p in np.ndindex(present.shape):
        if present[g, p]:
            first, last = routes.first_row[p], routes.last_row[p]
            station, offset, heading, speed = station_m[g, p], offset_m[g, p], heading_rad[g, p], speed_mps[g, p]
            row = row_at(station, first, last)
            view[:] = 0.0
            view[0], view[1] = speed, here.speed_limit_mps[g, p]
            view[2] = speed / here.speed_limit_mps[g, p] - 1.0
            view[3], view[4] = speed - posted_mps[g, p], acceleration_mps2[g, p]
            view[5] = steering_rad[g, p] / max_steering_rad[p]
            view[6] = here.road_steering_rad[g, p] / max_steering_rad[p]
            view[7], view[8] = here.lane_end_m[g, p], here.goal_m[g, p]
            view[9], view[10] = routes.own_left_m[row] - offset, routes.own_right_m[row] - offset
            view[_PATH_LEFT] = -offset
            for k in range(_COUNT):
                ahead = row_ahead(row, BEHIND + k, first, last)
                turned = routes.heading_rad[ahead] - heading
                view[_TURNED + k] = (turned + np.pi) % (2.0 * np.pi) - np.pi
                view[_BEND + k] = routes.bend_ahead_per_m[row, k]
                view[_LEFT + k] = routes.left_edge_m[ahead] - offset
                view[_RIGHT + k] = routes.right_edge_m[ahead] - offset
            front_m = station + 0.5 * length_m[p]
            _see_stop_line(view, next_line[g, p], front_m, stop_lines, signals[g], signal_s[g])
            leader_m, leader_mps = np.inf, 0.0
            cosine, sine = np.cos(heading), np.sin(heading)
            for b in range(bodies):
                dx, dy = body_x_m[g, b] - x_m[g, p], body_y_m[g, b] - y_m[g, p]
                ahead_m[b], left_m[b] = dx * cosine + dy * sine, dy * cosine - dx * sine
                distance = np.hypot(dx, dy)
                in_view = ahead_m[b] >= unseen_behind_m[g, p] and distance <= min(sight_m[g, p], SEEN_M)
                in_view = in_view and ahead_m[b] >= sight_cosine[g, p] * distance and not hidden[g, p, b]
                seen[b] = body_present[g, b] and b != p and in_view
                urgency_s[b] = distance / _NEARNESS_MPS
                if seen[b]:
                    error = distance_error[g, p]
                    seen_at = (body_x_m[g, b] + error * dx, body_y_m[g, b] + error * dy)
                    along, beside, frame = place_along_route(row, station, offset, p, routes, *seen_at)
                    length, width = body_length_m[g, b], body_width_m[g, b]
                    extent = 0.5 * (length + width)  # at least the half extents, which take longer to compute
                    if along + extent > _EDGES[0] and along - extent < _EDGES[-1]:
                        turned = body_heading_rad[g, b] - routes.heading_rad[frame]
                        half_length, half_width = half_extents_m(turned, length, width)
                        _narrow(view, along, beside, half_length, half_width)
                        gap = along - half_length - 0.5 * length_m[p]
                        if along > 0.0 and gap < leader_m and abs(beside) < half_width + 0.5 * width_m[p]:
                            closing = closing_error_per_s[g, p] * along
                            leader_m, leader_mps = gap, body_speed_mps[g, b] * np.cos(turned) - speed + closing
                    if meetings.conflict[g, p, b] >= 0:
                        own_s = max(meetings.own_m[g, p, b], 0.0) / max(speed, _LEAST_MPS)
                        other_s = max(meetings.other_m[g, p, b], 0.0) / max(body_speed_mps[g, b], _LEAST_MPS)
                        urgency_s[b] = min(urgency_s[b], max(own_s, other_s))
            if leader_m < np.inf:  # else zeros: a learner that is always alone must not learn from its absence
                view[_LEADER], view[_LEADER + 1], view[_LEADER + 2] = 1.0, max(leader_m, 0.0), leader_mps
            last_seen, last_s = -1, -1.0  # the body of the previous entry
            for k in range(OTHERS):  # the most urgent first; missing bodies stay zeros
                b = _next_urgent(seen, urgency_s, last_seen, last_s)
                if b < 0:
                    break
                last_seen, last_s = b, urgency_s[b]
                error, closing = distance_error[g, p], closing_error_per_s[g, p]
                turned = body_heading_rad[g, b] - heading
                entry = view[_FIRST_OTHER + k * ENTRIES :]
                entry[0] = 1.0
                entry[1], entry[2] = (1.0 + error) * ahead_m[b], (1.0 + error) * left_m[b]
                entry[3] = body_speed_mps[g, b] * np.cos(turned) - speed + closing * ahead_m[b]
                entry[4] = body_speed_mps[g, b] * np.sin(turned) + closing * left_m[b]
                entry[5], entry[6] = np.sin(turned), np.cos(turned)
                entry[7], entry[8] = body_length_m[g, b], body_width_m[g, b]
                if meetings.conflict[g, p, b] >= 0:
                    other = (1.0 + error) * meetings.other_m[g, p, b]
                    entry[9], entry[10] = meetings.own_m[g, p, b], other
                    own_s = max(meetings.own_m[g, p, b], 0.0) / max(speed, 0.1)
                    entry[11] = max(other, 0.0) / max(body_speed_mps[g, b], 0.1) - own_s
                    entry[12] = 1.0 if meetings.must_yield[g, p, b] else -1.0
            for k in range(SIZE):
                observation[g, p, k] = _scaled(view[k], SCALE[k], COMPRESSED[k])
    return observation


@compiled
def _scaled(value: float, scale: float, compressed: bool) -> float:
    if compressed:
        return value / (abs(value) + scale) if abs(value) < np.inf else np.sign(value)
    return min(max(value / scale, -1.0), 1.0)


@compiled
def _see_stop_line(
    view: FloatArray, line: int, front_m: float, stop_lines: StopLines, signals: IntArray, signal_s: FloatArray
) -> None:
    """Write the entries of the next stop line; -1 for none."""
    view[_STOP_LINE] = np.inf
    if line < 0:
        return
    view[_STOP_LINE] = stop_lines.station_m[line] - front_m
    control, link = stop_lines.control[line], stop_lines.link[line]
    view[_STOP_LINE + 1] = 1.0 if control == Control.GIVE_WAY else 0.0
    view[_STOP_LINE + 2] = 1.0 if control in (Control.STOP, Control.ALL_WAY_STOP) else 0.0
    if link >= 0:
        view[_STOP_LINE + 3] = 1.0 if signals[link] in (Signal.GREEN, Signal.GREEN_YIELDING) else 0.0
        view[_STOP_LINE + 4] = 1.0 if signals[link] == Signal.YELLOW else 0.0
        view[_STOP_LINE + 5] = 1.0 if signals[link] == Signal.RED else 0.0
        view[_STOP_LINE + 6] = signal_s[link]


@compiled
def _narrow(view: FloatArray, ahead_m: float, left_m: float, half_length_m: float, half_width_m: float) -> None:
    """Reduce the free widths in `view` by a body, given in route coordinates."""
    near, far = ahead_m - half_length_m, ahead_m + half_length_m
    for k in range(_COUNT):
        if far > _EDGES[k] and near < _EDGES[k + 1]:
            if left_m > 0.0:
                view[_LEFT + k] = min(view[_LEFT + k], left_m - half_width_m)
            else:
                view[_RIGHT + k] = max(view[_RIGHT + k], left_m + half_width_m)


@compiled
def _next_urgent(seen: BoolArray, urgency_s: FloatArray, last: int, last_s: float) -> int:
    """The most urgent body after the last one, by urgency and then by index; -1 if there is none."""
    found, found_s = -1, np.inf
    for b in range(len(seen)):
        urgency = urgency_s[b]
        if seen[b] and urgency < found_s and (urgency > last_s or (urgency == last_s and b > last)):
            found, found_s = b, urgency
    return found
