"""Observations of the players: own motion, the road ahead, signs and signals, and the other bodies that matter most.

An observation is in the player's own frame and holds only what a driver can see: no intentions, personas, payoffs or
plans. `harness.game.observation_layout` has its entries; here a function writes each group of them.

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
from harness.game.jit import compiled, inlined
from harness.game.junctions import Control, Signal, StopLines
from harness.game.meetings import Meetings
from harness.game.observation_layout import BEHIND, COMPRESSED, ENTRIES, FIRST_OTHER, OTHER, OTHERS, OWN, SCALE, SIZE
from harness.game.quantities import Quantities
from harness.game.road import AHEAD_M, Routes
from harness.game.route_coordinates import OnRoute, half_extents_m, on_route, point_along_route, row_ahead
from harness.game.state import Bodies

_EDGES = np.concatenate(([-2.5], 0.5 * (AHEAD_M[1:] + AHEAD_M[:-1]), [60.0]))  # bins of road around AHEAD_M
_COUNT = len(AHEAD_M)

SEEN_M = 120.0  # bodies farther away are not in an observation
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
    unseen_behind_m: FloatArray
    sight_m: FloatArray
    sight_cosine: FloatArray
    distance_error: FloatArray
    closing_error_per_s: FloatArray
    signals: IntArray
    signal_s: FloatArray


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


class _Eye(NamedTuple):
    """The player `p` of game `g`, which observes."""

    g: int
    p: int
    place: OnRoute
    x_m: float
    y_m: float
    heading_rad: float
    cosine: float  # of the heading
    sine: float
    speed_mps: float
    length_m: float
    width_m: float
    unseen_behind_m: float
    sight_m: float
    sight_cosine: float
    distance_error: float
    closing_error_per_s: float


class _Body(NamedTuple):
    """Another body, and the player's conflict with it."""

    x_m: float
    y_m: float
    heading_rad: float
    speed_mps: float
    length_m: float
    width_m: float
    meets: bool
    own_m: float  # to the conflict
    other_m: float
    must_yield: bool


_columns = attrgetter(*_Players._fields)  # plain tuples: numba takes them apart three times as fast as records


def observe(q: Quantities) -> FloatArray:
    """[G, P, SIZE] float32 in [-1, 1]: the players' observations; zeros for players that are not present."""
    world, rules, along = q.world, q.rules, q.along
    views = (  # the columns of `_Views`
        *(q.lateral_offset_m, rules.next_line, rules.posted_mps),
        *(along.speed_limit_mps, along.road_steering_rad, along.lane_end_m, along.goal_m, q.hidden),
        *(world.actuators.max_steering_rad, world.length_m, world.width_m),
    )
    records = (q.bodies, world.road.routes, world.right_of_way.stop_lines, q.meetings)
    return _observe((_columns(q.state), views, *map(tuple, records)))


@compiled
def _observe(tables: tuple[tuple[Any, ...], ...]) -> FloatArray:
    """One compiled pass over the columns of players, views, bodies, routes, stop lines and meetings: several calls
    would cost more than their work. A record of arrays costs time at every call of a function with a loop: the loops
    are here."""
    players, views, bodies, routes = _Players(*tables[0]), _Views(*tables[1]), Bodies(*tables[2]), Routes(*tables[3])
    stop_lines, meetings = StopLines(*tables[4]), Meetings(*tables[5])
    observation, view = np.zeros((*players.present.shape, SIZE), dtype=np.float32), np.empty(SIZE)
    count = bodies.present.shape[1]
    seen, urgency_s = np.empty(count, dtype=np.bool_), np.empty(count)
    for g, p in np.ndindex(players.present.shape):
        if players.present[g, p]:
            place = on_route(players.station_m[g, p], views.offset_m[g, p], p, routes)
            eye = _eye(players, views, place, (g, p))
            view[:] = 0.0
            _see_own_motion(view, eye, players, views)
            view[OWN.own_side_left_m] = routes.own_left_m[place.row] - place.offset_m
            view[OWN.own_side_right_m] = routes.own_right_m[place.row] - place.offset_m
            for k in range(_COUNT):
                _see_road(view, k, eye, routes)
            if views.next_line[g, p] < 0:
                view[OWN.stop_line_m] = np.inf
            else:
                _see_stop_line(view, eye, views.next_line[g, p], stop_lines)
                link = stop_lines.link[views.next_line[g, p]]
                if link >= 0:
                    _see_signal(view, players.signals[g, link], players.signal_s[g, link])
            leader_m, leader_mps = np.inf, 0.0
            for b in range(count):
                body = _body(bodies, meetings, (g, p, b))
                in_view, urgency_s[b] = _look(eye, body)
                seen[b] = bodies.present[g, b] and b != p and in_view and not views.hidden[g, p, b]
                if seen[b]:
                    x_m = body.x_m + eye.distance_error * (body.x_m - eye.x_m)  # where the player takes it to be
                    y_m = body.y_m + eye.distance_error * (body.y_m - eye.y_m)
                    ahead_m, left_m, frame = point_along_route(place, routes, x_m, y_m)
                    on_path = (ahead_m, left_m, routes.heading_rad[frame])
                    gap_m, relative_mps = _see_on_path(view, eye, body, on_path)
                    if gap_m < leader_m:
                        leader_m, leader_mps = gap_m, relative_mps
            if leader_m < np.inf:  # else zeros: a learner that is always alone must not learn from its absence
                view[OWN.leader_seen], view[OWN.leader_mps] = 1.0, leader_mps
                view[OWN.leader_gap_m] = max(leader_m, 0.0)
            last, last_s = -1, -1.0  # the body of the previous entry
            for k in range(OTHERS):  # the most urgent first; missing bodies stay zeros
                b = _next_urgent(seen, urgency_s, last, last_s)
                if b < 0:
                    break
                last, last_s = b, urgency_s[b]
                _see_other(view[FIRST_OTHER + k * ENTRIES :], eye, _body(bodies, meetings, (g, p, b)))
            for k in range(SIZE):
                observation[g, p, k] = _scaled(view[k], SCALE[k], COMPRESSED[k])
    return observation


@inlined
def _eye(players: _Players, views: _Views, place: OnRoute, who: tuple[int, int]) -> _Eye:
    g, p = who
    heading_rad = players.heading_rad[g, p]
    return _Eye(
        g,
        p,
        place,
        players.x_m[g, p],
        players.y_m[g, p],
        heading_rad,
        np.cos(heading_rad),
        np.sin(heading_rad),
        players.speed_mps[g, p],
        views.length_m[p],
        views.width_m[p],
        players.unseen_behind_m[g, p],
        min(players.sight_m[g, p], SEEN_M),
        players.sight_cosine[g, p],
        players.distance_error[g, p],
        players.closing_error_per_s[g, p],
    )


@inlined
def _body(bodies: Bodies, met: Meetings, which: tuple[int, int, int]) -> _Body:
    """A body, given by the indices of game, player and body."""
    g, p, b = which
    return _Body(
        bodies.x_m[g, b],
        bodies.y_m[g, b],
        bodies.heading_rad[g, b],
        bodies.speed_mps[g, b],
        bodies.length_m[g, b],
        bodies.width_m[g, b],
        met.conflict[g, p, b] >= 0,
        met.own_m[g, p, b],
        met.other_m[g, p, b],
        met.must_yield[g, p, b],
    )


@compiled
def _scaled(value: float, scale: float, compressed: bool) -> float:
    if compressed:
        return value / (abs(value) + scale) if abs(value) < np.inf else np.sign(value)
    return min(max(value / scale, -1.0), 1.0)


@inlined
def _see_own_motion(view: FloatArray, eye: _Eye, players: _Players, views: _Views) -> None:
    """Write the entries of the own motion and of the road at the player."""
    g, p = eye.g, eye.p
    view[OWN.speed_mps] = eye.speed_mps
    view[OWN.speed_limit_mps] = views.speed_limit_mps[g, p]
    view[OWN.speed_over_limit] = eye.speed_mps / views.speed_limit_mps[g, p] - 1.0
    view[OWN.over_posted_mps] = eye.speed_mps - views.posted_mps[g, p]
    view[OWN.acceleration_mps2] = players.acceleration_mps2[g, p]
    view[OWN.steering_rad] = players.steering_rad[g, p] / views.max_steering_rad[p]
    view[OWN.road_steering_rad] = views.road_steering_rad[g, p] / views.max_steering_rad[p]
    view[OWN.lane_end_m], view[OWN.goal_m] = views.lane_end_m[g, p], views.goal_m[g, p]
    view[OWN.path_left_m] = -eye.place.offset_m


@inlined
def _see_road(view: FloatArray, k: int, eye: _Eye, routes: Routes) -> None:
    """Write the entries of the path at the distance `AHEAD_M[k]`: its direction, bends and edges."""
    ahead = row_ahead(eye.place, BEHIND + k)
    turned = routes.heading_rad[ahead] - eye.heading_rad
    view[OWN.path_turned_rad + k] = (turned + np.pi) % (2.0 * np.pi) - np.pi
    view[OWN.path_bend_per_m + k] = routes.bend_ahead_per_m[eye.place.row, k]
    view[OWN.free_left_m + k] = routes.left_edge_m[ahead] - eye.place.offset_m
    view[OWN.free_right_m + k] = routes.right_edge_m[ahead] - eye.place.offset_m


@inlined
def _see_stop_line(view: FloatArray, eye: _Eye, line: int, lines: StopLines) -> None:
    """Write the entries of the next stop line, of a row of the table."""
    control = lines.control[line]
    view[OWN.stop_line_m] = lines.station_m[line] - (eye.place.station_m + 0.5 * eye.length_m)
    view[OWN.give_way] = 1.0 if control == Control.GIVE_WAY else 0.0
    view[OWN.stop_sign] = 1.0 if control in (Control.STOP, Control.ALL_WAY_STOP) else 0.0


@compiled
def _see_signal(view: FloatArray, signal: int, since_s: float) -> None:
    """Write the entries of the signal of the next stop line."""
    view[OWN.signal_green] = 1.0 if signal in (Signal.GREEN, Signal.GREEN_YIELDING) else 0.0
    view[OWN.signal_yellow] = 1.0 if signal == Signal.YELLOW else 0.0
    view[OWN.signal_red] = 1.0 if signal == Signal.RED else 0.0
    view[OWN.signal_s] = since_s


@compiled
def _look(eye: _Eye, body: _Body) -> tuple[bool, float]:
    """Whether a body is where the player looks, and how soon the player may meet it (s)."""
    dx, dy = body.x_m - eye.x_m, body.y_m - eye.y_m
    ahead_m, distance_m = dx * eye.cosine + dy * eye.sine, np.hypot(dx, dy)
    in_view = ahead_m >= eye.unseen_behind_m and distance_m <= eye.sight_m
    urgency_s = distance_m / _NEARNESS_MPS
    if body.meets:
        own_s = max(body.own_m, 0.0) / max(eye.speed_mps, _LEAST_MPS)
        other_s = max(body.other_m, 0.0) / max(body.speed_mps, _LEAST_MPS)
        urgency_s = min(urgency_s, max(own_s, other_s))
    return in_view and ahead_m >= eye.sight_cosine * distance_m, urgency_s


@compiled
def _see_on_path(view: FloatArray, eye: _Eye, body: _Body, place: tuple[float, float, float]) -> tuple[float, float]:
    """Reduce the free widths by a body at a place along the route and beside it, where the route has a heading. If it
    is ahead in the player's way: the gap to it and its relative speed, else an infinite gap."""
    along, beside, route_heading_rad = place
    extent = 0.5 * (body.length_m + body.width_m)  # at least the half extents, which take longer to compute
    if along + extent <= _EDGES[0] or along - extent >= _EDGES[-1]:
        return np.inf, 0.0
    turned = body.heading_rad - route_heading_rad
    half_length, half_width = half_extents_m(turned, body.length_m, body.width_m)
    _narrow(view, (along - half_length, along + half_length), beside, half_width)
    if along <= 0.0 or abs(beside) >= half_width + 0.5 * eye.width_m:
        return np.inf, 0.0
    closing = eye.closing_error_per_s * along
    return along - half_length - 0.5 * eye.length_m, body.speed_mps * np.cos(turned) - eye.speed_mps + closing


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


@compiled
def _see_other(entry: FloatArray, eye: _Eye, body: _Body) -> None:
    """Write the entries of one other body."""
    dx, dy, further = body.x_m - eye.x_m, body.y_m - eye.y_m, 1.0 + eye.distance_error
    ahead_m, left_m = dx * eye.cosine + dy * eye.sine, dy * eye.cosine - dx * eye.sine
    turned, closing = body.heading_rad - eye.heading_rad, eye.closing_error_per_s
    entry[OTHER.seen] = 1.0
    entry[OTHER.ahead_m], entry[OTHER.left_m] = further * ahead_m, further * left_m
    entry[OTHER.ahead_mps] = body.speed_mps * np.cos(turned) - eye.speed_mps + closing * ahead_m
    entry[OTHER.left_mps] = body.speed_mps * np.sin(turned) + closing * left_m
    entry[OTHER.turned_sin], entry[OTHER.turned_cos] = np.sin(turned), np.cos(turned)
    entry[OTHER.length_m], entry[OTHER.width_m] = body.length_m, body.width_m
    if body.meets:
        other_m, own_s = further * body.other_m, max(body.own_m, 0.0) / max(eye.speed_mps, 0.1)
        entry[OTHER.own_to_conflict_m], entry[OTHER.other_to_conflict_m] = body.own_m, other_m
        entry[OTHER.arrives_later_s] = max(other_m, 0.0) / max(body.speed_mps, 0.1) - own_s
        entry[OTHER.has_priority] = 1.0 if body.must_yield else -1.0


@compiled
def _next_urgent(seen: BoolArray, urgency_s: FloatArray, last: int, last_s: float) -> int:
    """The most urgent body after the last one, by urgency and then by index; -1 if there is none."""
    found, found_s = -1, np.inf
    for b in range(len(seen)):
        urgency = urgency_s[b]
        if seen[b] and urgency < found_s and (urgency > last_s or (urgency == last_s and b > last)):
            found, found_s = b, urgency
    return found
