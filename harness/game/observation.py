"""Observations of the players: own motion, the road ahead, signs and signals, and the other bodies that matter most.

An observation is in the player's own frame and holds only what a driver can see: no intentions, personas, payoffs or
plans. `harness.game.observation_layout` has its entries; here a function writes each group of them.

Other players are seen as they would be if they had moved on as when they were looked at (`game.memory`).
An error of estimated distances scales the distance of other bodies in their true direction. An error of closing speeds
adds a radial velocity to theirs (`game.human_factors`). The free width at a distance ahead ends at the nearest surface
on either side, rail or vehicle (paper, section 4.3.2: the ego "seeks to maintain a large distance between itself and
nearby objects"). The other bodies are those that the player may meet first: by the time to the conflict of the two
ways, or by their distance.
"""

from __future__ import annotations

from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.field_of_view import Eyes, Seen, in_view
from harness.game.jit import compiled, inlined
from harness.game.junctions import Control, Signal, StopLines
from harness.game.meetings import Meetings
from harness.game.memory import Perceived, as_they_are
from harness.game.observation_layout import BEHIND, COMPRESSED, ENTRIES, FIRST_OTHER, OTHER, OTHERS, OWN, SCALE, SIZE
from harness.game.quantities import Quantities
from harness.game.road import AHEAD_M, Routes
from harness.game.route_coordinates import OnRoute, half_extents_m, on_route, point_along_route, row_ahead
from harness.game.sight import SEEN_M
from harness.game.state import Bodies

_EDGES = np.concatenate(([-2.5], 0.5 * (AHEAD_M[1:] + AHEAD_M[:-1]), [60.0]))  # bins of road around AHEAD_M
_COUNT = len(AHEAD_M)

_NEARNESS_MPS = 10.0  # a body at a distance matters like a conflict in the time to cover it at this speed
_LEAST_MPS = 3.0  # a slower body may start to move


class _Players(NamedTuple):
    """Columns of `State`."""

    x_m: FloatArray
    y_m: FloatArray
    heading_rad: FloatArray
    speed_mps: FloatArray
    acceleration_mps2: FloatArray
    steering_rad: FloatArray
    station_m: FloatArray
    present: BoolArray
    shoulder_glance: BoolArray
    sight_m: FloatArray
    sight_cosine: FloatArray
    distance_error: FloatArray
    closing_error_per_s: FloatArray
    signals: IntArray
    signal_s: FloatArray
    visibility_m: FloatArray


class _Views(NamedTuple):
    """What the road, the rules and the cars add to that: [G, P] unless noted."""

    offset_m: FloatArray  # from the route's line
    next_line: IntArray  # row of the next stop line
    posted_mps: FloatArray
    speed_limit_mps: FloatArray
    road_steering_rad: FloatArray
    lane_end_m: FloatArray
    goal_m: FloatArray
    hidden: BoolArray  # [G, P, B]
    max_steering_rad: FloatArray  # [P]
    length_m: FloatArray  # [P]
    width_m: FloatArray  # [P]


_columns = attrgetter(*_Players._fields)  # plain tuples: numba takes them apart three times as fast as records


def as_it_is(q: Quantities) -> Seen:
    """The bodies as they are."""
    return Seen(q.bodies, as_they_are(q.bodies, q.state.present.shape[1]), q.hidden, q.meetings)


def observe(q: Quantities, seen: Seen | None = None) -> FloatArray:
    """[G, P, SIZE] float32 in [-1, 1]: the players' observations; zeros for players that are not present. `seen`: the
    bodies as the players take them to be; left out: as they are."""
    world, rules, along = q.world, q.rules, q.along
    seen = seen or as_it_is(q)
    views = (  # the columns of `_Views`
        *(q.lateral_offset_m, rules.next_line, rules.posted_mps),
        *(along.speed_limit_mps, along.road_steering_rad, along.lane_end_m, along.goal_m, seen.hidden),
        *(world.actuators.max_steering_rad, world.length_m, world.width_m),
    )
    records = (seen.bodies, world.road.routes, world.right_of_way.stop_lines, seen.meetings)
    moving = q.bodies.present.shape[1] - len(world.hiding.obstacles)
    return _observe((_columns(q.state), views, *map(tuple, records)), seen.motion, moving)


@compiled
def _observe(tables: tuple[tuple[Any, ...], ...], perceived: Perceived, moving: int) -> FloatArray:
    """One compiled pass over the columns of players, views, bodies, routes, stop lines and meetings: several calls
    would cost more than their work. A record of arrays costs time at every call of a function with a loop: the loops
    are here. The first `moving` bodies are road users, and the others stand: nobody fails to see these."""
    players, views, bodies, routes = _Players(*tables[0]), _Views(*tables[1]), Bodies(*tables[2]), Routes(*tables[3])
    stop_lines, meetings = StopLines(*tables[4]), Meetings(*tables[5])
    observation, view = np.zeros((*players.present.shape, SIZE), dtype=np.float32), np.empty(SIZE)
    count = bodies.present.shape[1]
    seen, urgency_s = np.empty(count, dtype=np.bool_), np.empty(count)
    for g, p in np.ndindex(players.present.shape):
        if players.present[g, p]:
            place = on_route(players.station_m[g, p], views.offset_m[g, p], p, routes)
            heading_rad, own_mps = players.heading_rad[g, p], players.speed_mps[g, p]
            eyes = _eyes(players, (views.length_m[p], views.width_m[p]), (g, p))
            error = players.distance_error[g, p]
            view[:] = 0.0
            _see_own_motion(view, players, views, (g, p))
            view[OWN.path_left_m] = -place.offset_m
            view[OWN.own_side_left_m] = routes.own_left_m[place.row] - place.offset_m
            view[OWN.own_side_right_m] = routes.own_right_m[place.row] - place.offset_m
            for k in range(_COUNT):
                _see_road(view, k, (place, heading_rad), routes)
            if views.next_line[g, p] < 0:
                view[OWN.stop_line_m] = np.inf
            else:
                front_m = place.station_m + 0.5 * views.length_m[p]
                _see_stop_line(view, front_m, views.next_line[g, p], stop_lines)
                link = stop_lines.link[views.next_line[g, p]]
                if link >= 0:
                    _see_signal(view, players.signals[g, link], players.signal_s[g, link])
            leader_m, leader_mps = np.inf, 0.0
            for b in range(count):
                x_m, y_m, their_heading_rad, speed_mps = _perceived_motion(perceived, g, p, b)
                dx, dy = x_m - players.x_m[g, p], y_m - players.y_m[g, p]
                urgency_s[b] = np.hypot(dx, dy) / _NEARNESS_MPS
                if meetings.conflict[g, p, b] >= 0:
                    own_s = max(meetings.own_m[g, p, b], 0.0) / max(own_mps, _LEAST_MPS)
                    other_s = max(meetings.other_m[g, p, b], 0.0) / max(speed_mps, _LEAST_MPS)
                    urgency_s[b] = min(urgency_s[b], max(own_s, other_s))
                is_there = bodies.present[g, b] and b != p and not views.hidden[g, p, b]
                seen[b] = is_there and in_view(eyes, dx, dy, b < moving)
                if seen[b]:
                    # where the player takes it to be
                    ahead_m, left_m, frame = point_along_route(place, routes, x_m + error * dx, y_m + error * dy)
                    turned = their_heading_rad - routes.heading_rad[frame]
                    sizes_m = (bodies.length_m[g, b], bodies.width_m[g, b], views.length_m[p], views.width_m[p])
                    gap_m = _narrow_by(view, (ahead_m, left_m, turned), sizes_m)
                    if gap_m < leader_m:
                        leader_m, closing_mps = gap_m, players.closing_error_per_s[g, p] * ahead_m
                        leader_mps = speed_mps * np.cos(turned) - own_mps + closing_mps
            if leader_m < np.inf:  # else zeros: a learner that is always alone must not learn from its absence
                view[OWN.leader_seen], view[OWN.leader_mps] = 1.0, leader_mps
                view[OWN.leader_gap_m] = max(leader_m, 0.0)
            last, last_s = -1, -1.0  # the body of the previous entry
            for k in range(OTHERS):  # the most urgent first; missing bodies stay zeros
                b = _next_urgent(seen, urgency_s, last, last_s)
                if b < 0:
                    break
                last, last_s = b, urgency_s[b]
                entry = view[FIRST_OTHER + k * ENTRIES :]
                _see_other(entry, (g, p, b), players, bodies, perceived)
                if meetings.conflict[g, p, b] >= 0:
                    x_m, y_m, their_heading_rad, speed_mps = _perceived_motion(perceived, g, p, b)
                    ahead_by_m = (x_m - bodies.x_m[g, b]) * np.cos(their_heading_rad)
                    ahead_by_m += (y_m - bodies.y_m[g, b]) * np.sin(their_heading_rad)
                    ways_m = (meetings.own_m[g, p, b], meetings.other_m[g, p, b] - ahead_by_m)
                    _see_conflict(entry, 1.0 + error, ways_m, (own_mps, speed_mps))
                    entry[OTHER.has_priority] = 1.0 if meetings.must_yield[g, p, b] else -1.0
            for k in range(SIZE):
                observation[g, p, k] = _scaled(view[k], SCALE[k], COMPRESSED[k])
    return observation


def seen_bodies(q: Quantities, seen: Seen) -> BoolArray:
    """[G, P, B] all bodies that players see, by what they take them to be: an observation has the most urgent ones."""
    moving = q.bodies.present.shape[1] - len(q.world.hiding.obstacles)
    sizes_m = (q.world.length_m, q.world.width_m)
    return _seen_bodies(_columns(q.state), sizes_m, (seen.bodies.present, seen.hidden), seen.motion, moving)


@compiled
def _seen_bodies(
    columns: tuple[Any, ...],
    sizes_m: tuple[FloatArray, FloatArray],
    bodies: tuple[BoolArray, BoolArray],
    perceived: Perceived,
    moving: int,
) -> BoolArray:
    players, (length_m, width_m), (present, hidden) = _Players(*columns), sizes_m, bodies
    seen = np.zeros(hidden.shape, dtype=np.bool_)
    for g, p in np.ndindex(players.present.shape):
        if players.present[g, p]:
            eyes = _eyes(players, (length_m[p], width_m[p]), (g, p))
            for b in range(hidden.shape[2]):
                dx, dy = perceived[0, g, p, b] - players.x_m[g, p], perceived[1, g, p, b] - players.y_m[g, p]
                is_there = present[g, b] and b != p and not hidden[g, p, b]
                seen[g, p, b] = is_there and in_view(eyes, dx, dy, b < moving)
    return seen


@inlined
def _eyes(players: _Players, size_m: tuple[float, float], who: tuple[int, int]) -> Eyes:
    g, p = who
    heading_rad, reach_m = players.heading_rad[g, p], min(players.visibility_m[g], SEEN_M)
    sight = (min(players.sight_m[g, p], reach_m), reach_m, players.sight_cosine[g, p], players.shoulder_glance[g, p])
    return (np.cos(heading_rad), np.sin(heading_rad), *sight, *size_m)


@inlined
def _perceived_motion(perceived: Perceived, g: int, p: int, b: int) -> tuple[float, float, float, float]:
    """Place, heading and speed of a body as a player takes them to be. A slice of the array would cost more time."""
    return perceived[0, g, p, b], perceived[1, g, p, b], perceived[2, g, p, b], perceived[3, g, p, b]


@compiled
def _scaled(value: float, scale: float, compressed: bool) -> float:
    if compressed:
        return value / (abs(value) + scale) if abs(value) < np.inf else np.sign(value)
    return min(max(value / scale, -1.0), 1.0)


@inlined
def _see_own_motion(view: FloatArray, players: _Players, views: _Views, who: tuple[int, int]) -> None:
    g, p = who
    view[OWN.speed_mps] = players.speed_mps[g, p]
    view[OWN.speed_limit_mps] = views.speed_limit_mps[g, p]
    view[OWN.speed_over_limit] = players.speed_mps[g, p] / views.speed_limit_mps[g, p] - 1.0
    view[OWN.over_posted_mps] = players.speed_mps[g, p] - views.posted_mps[g, p]
    view[OWN.acceleration_mps2] = players.acceleration_mps2[g, p]
    view[OWN.steering_rad] = players.steering_rad[g, p] / views.max_steering_rad[p]
    view[OWN.road_steering_rad] = views.road_steering_rad[g, p] / views.max_steering_rad[p]
    view[OWN.lane_end_m], view[OWN.goal_m] = views.lane_end_m[g, p], views.goal_m[g, p]


@inlined
def _see_road(view: FloatArray, k: int, pose: tuple[OnRoute, float], routes: Routes) -> None:
    """Write the entries of the path at the distance `AHEAD_M[k]`: its direction, bends and edges."""
    place, heading_rad = pose
    ahead = row_ahead(place, BEHIND + k)
    turned = routes.heading_rad[ahead] - heading_rad
    view[OWN.path_turned_rad + k] = (turned + np.pi) % (2.0 * np.pi) - np.pi
    view[OWN.path_bend_per_m + k] = routes.bend_ahead_per_m[place.row, k]
    view[OWN.free_left_m + k] = routes.left_edge_m[ahead] - place.offset_m
    view[OWN.free_right_m + k] = routes.right_edge_m[ahead] - place.offset_m


@inlined
def _see_stop_line(view: FloatArray, front_m: float, line: int, lines: StopLines) -> None:
    control = lines.control[line]
    view[OWN.stop_line_m] = lines.station_m[line] - front_m
    view[OWN.give_way] = 1.0 if control == Control.GIVE_WAY else 0.0
    view[OWN.stop_sign] = 1.0 if control in (Control.STOP, Control.ALL_WAY_STOP) else 0.0


@compiled
def _see_signal(view: FloatArray, signal: int, since_s: float) -> None:
    view[OWN.signal_green] = 1.0 if signal in (Signal.GREEN, Signal.GREEN_YIELDING) else 0.0
    view[OWN.signal_yellow] = 1.0 if signal == Signal.YELLOW else 0.0
    view[OWN.signal_red] = 1.0 if signal == Signal.RED else 0.0
    view[OWN.signal_s] = since_s


@compiled
def _narrow_by(
    view: FloatArray, place: tuple[float, float, float], sizes_m: tuple[float, float, float, float]
) -> float:
    """Reduce the free widths by a body at a place along the route and beside it, turned from the route. The gap to it
    if it is ahead in the player's way, else inf. `sizes_m` are length and width of the body and of the player."""
    (along, beside, turned), (length_m, width_m, own_length_m, own_width_m) = place, sizes_m
    extent = 0.5 * (length_m + width_m)  # at least the half extents, which take longer to compute
    if along + extent <= _EDGES[0] or along - extent >= _EDGES[-1]:
        return np.inf
    half_length, half_width = half_extents_m(turned, length_m, width_m)
    _narrow(view, (along - half_length, along + half_length), beside, half_width)
    if along <= 0.0 or abs(beside) >= half_width + 0.5 * own_width_m:
        return np.inf
    return along - half_length - 0.5 * own_length_m


@compiled
def _narrow(view: FloatArray, ends_m: tuple[float, float], left_m: float, half_width_m: float) -> None:
    """Reduce the free widths by a body between two distances along the route, at an offset to the left."""
    near, far = ends_m
    for k in range(_COUNT):
        if far > _EDGES[k] and near < _EDGES[k + 1]:
            if left_m > 0.0:
                view[OWN.free_left_m + k] = min(view[OWN.free_left_m + k], left_m - half_width_m)
            else:
                view[OWN.free_right_m + k] = max(view[OWN.free_right_m + k], left_m + half_width_m)


@inlined
def _see_other(
    entry: FloatArray, which: tuple[int, int, int], players: _Players, bodies: Bodies, perceived: Perceived
) -> None:
    """Write the entries of one other body but those of the conflict with it."""
    g, p, b = which
    x_m, y_m, their_heading_rad, speed_mps = _perceived_motion(perceived, g, p, b)
    own_mps, heading_rad = players.speed_mps[g, p], players.heading_rad[g, p]
    dx, dy = x_m - players.x_m[g, p], y_m - players.y_m[g, p]
    cosine, sine = np.cos(heading_rad), np.sin(heading_rad)
    further = 1.0 + players.distance_error[g, p]
    ahead_m, left_m = dx * cosine + dy * sine, dy * cosine - dx * sine
    turned, closing = their_heading_rad - heading_rad, players.closing_error_per_s[g, p]
    entry[OTHER.seen] = 1.0
    entry[OTHER.ahead_m], entry[OTHER.left_m] = further * ahead_m, further * left_m
    entry[OTHER.ahead_mps] = speed_mps * np.cos(turned) - own_mps + closing * ahead_m
    entry[OTHER.left_mps] = speed_mps * np.sin(turned) + closing * left_m
    entry[OTHER.turned_sin], entry[OTHER.turned_cos] = np.sin(turned), np.cos(turned)
    entry[OTHER.length_m], entry[OTHER.width_m] = bodies.length_m[g, b], bodies.width_m[g, b]


@compiled
def _see_conflict(
    entry: FloatArray, further: float, ways_m: tuple[float, float], speeds_mps: tuple[float, float]
) -> None:
    """Write the ways of the player and of another body to their conflict, and how much later the other arrives."""
    (own_m, other_m), (own_mps, other_mps) = ways_m, speeds_mps
    other_m *= further
    entry[OTHER.own_to_conflict_m], entry[OTHER.other_to_conflict_m] = own_m, other_m
    entry[OTHER.arrives_later_s] = max(other_m, 0.0) / max(other_mps, 0.1) - max(own_m, 0.0) / max(own_mps, 0.1)


@compiled
def _next_urgent(seen: BoolArray, urgency_s: FloatArray, last: int, last_s: float) -> int:
    """The most urgent body after the last one, by urgency and then by index; -1 if there is none."""
    found, found_s = -1, np.inf
    for b in range(len(seen)):
        urgency = urgency_s[b]
        if seen[b] and urgency < found_s and (urgency > last_s or (urgency == last_s and b > last)):
            found, found_s = b, urgency
    return found
