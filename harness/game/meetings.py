"""The players' conflicts with other bodies at junctions: distances, times, and the duty to yield.

In a recorded game, whose axis of games is that of steps, [T], also when bodies passed the zones of conflict.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from harness.game import junctions
from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.jit import compiled
from harness.game.junctions import CELL_M, Conflicts, Signal, Streams
from harness.game.road import COMFORTABLE_MPS2
from harness.game.state import Bodies

STANDING_MPS = 0.1  # a body that is not faster does not arrive
HORIZON_S = 5.0  # a zone that a player reaches later is not in its way yet: from 50 km/h it can stop in comfort
_MOST_TURNED = float(np.cos(np.pi / 4.0))  # a body drives in a stream if its heading is within 45 degrees
_BEGIN_M, _END_M, _STOP_M, _WAIT_M, _RIGHT_M, _LEFT_M, _FROM_M, _UNTIL_M, _ZONE_M, _LENGTH_M = (
    Conflicts._fields.index(f"{name}_m")
    for name in ("begin", "end", "stop", "wait", "right", "left", "from", "until", "zone", "length")
)
_YIELDS, _FIRST_COME, _OWN_LINK, _OTHER_LINK = (
    Conflicts._fields.index(name) for name in ("yields", "first_come", "own_link", "other_link")
)
_BESIDE_M = 0.8
# plain integers: compiled code can't convert a member
_OFF, _GREEN, _RED = int(Signal.OFF), int(Signal.GREEN), int(Signal.RED)


class Meetings(NamedTuple):
    """Each player's conflict with each body, [G, P, B]: the first one on the player's way that neither has passed.

    Distances are those of front bumpers to the zone, negative inside. Times are those at constant speed: 0 inside, inf
    for a body that stands. Without a conflict, distances, times and gaps are inf.
    """

    conflict: IntArray  # row of `Conflicts`; -1 without one
    own_m: FloatArray
    other_m: FloatArray
    own_s: FloatArray
    other_s: FloatArray
    gap_s: FloatArray  # time between the two passages; 0 if both would be in the zone at the same time; inf while the
    # player moves up to its place inside the junction, before which it can stop in comfort
    must_yield: BoolArray  # the player, to the body


@lru_cache(maxsize=64)
def no_meetings(shape: tuple[int, ...]) -> Meetings:
    """No conflict with any of the bodies, [G, P, B]. The same arrays for equal shapes: they are only read."""
    return Meetings._make((np.full(shape, -1), *np.full((5, *shape), np.inf), np.zeros(shape, dtype=bool)))


class _Body(NamedTuple):
    """A body that a player regards: half its length, its speed, and in how many streams it drives."""

    half_m: float
    speed_mps: float
    streams: int


class _Player(NamedTuple):
    player: int
    front_m: float  # stations of its bumpers
    rear_m: float
    length_m: float
    offset_m: float
    speed_mps: float


@compiled
def meetings(
    players: tuple[Any, ...], bodies: tuple[Any, ...], signals: IntArray, table: tuple[Any, ...]
) -> tuple[IntArray, FloatArray, BoolArray]:
    """The columns of `Meetings`: the conflict, the numbers [5, G, P, B] in their order, and the duty to yield.

    Players are given by station, lateral offset and speed [G, P], length [P], and the bodies that each regards
    [G, P, B]. `signals` [G, L] are the states of links, `table` is that of the streams.
    """
    (station_m, offset_m, speed_mps, length_m, visible), among, streams = players, Bodies(*bodies), Streams(*table)
    shape = visible.shape
    row, must_yield = np.full(shape, -1), np.zeros(shape, dtype=np.bool_)
    numbers = np.full((5, *shape), np.inf)
    along_m = np.empty(streams.first_conflict.shape[1])
    in_streams = np.empty(len(along_m), dtype=np.int64)
    found_streams = (in_streams, along_m, np.empty(len(along_m)))
    for g in range(shape[0]):
        for b in range(shape[2]):
            count = -1  # the streams of the body are found once, for the first player that regards it
            for p in range(shape[1]):
                if not visible[g, p, b]:
                    continue
                if count < 0:
                    pose = (among.x_m[g, b], among.y_m[g, b], among.heading_rad[g, b])
                    count = streams_at(pose, streams, found_streams)
                if count == 0:
                    break
                half_m = 0.5 * length_m[p]
                ends_m = (station_m[g, p] + half_m, station_m[g, p] - half_m)
                player = _Player(p, *ends_m, length_m[p], offset_m[g, p], speed_mps[g, p])
                body = _Body(0.5 * among.length_m[g, b], among.speed_mps[g, b], count)
                found, other_m = _first_conflict(player, body, (in_streams, along_m), streams)
                if found < 0:
                    continue
                found_numbers, yields = _meeting(player, body, (found, other_m), streams.conflicts, signals[g])
                row[g, p, b], must_yield[g, p, b] = found, yields
                for k, number in enumerate(found_numbers):
                    numbers[k, g, p, b] = number
    return row, numbers, must_yield


@compiled
def _meeting(
    player: _Player, body: _Body, which: tuple[int, float], conflicts: FloatArray, signals: IntArray
) -> tuple[tuple[float, float, float, float, float], bool]:
    """The numbers of `Meetings` and the duty to yield, of a player's conflict with a body: its row, and the distance of
    the body's front to the zone."""
    found, other_m = which
    own_m = conflicts[found, _BEGIN_M] - player.front_m
    own_end_m = conflicts[found, _END_M] - player.front_m + player.length_m
    other_end_m = other_m + conflicts[found, _LENGTH_M] + 2.0 * body.half_m
    own_s, own_leaves_s = _passage_s(own_m, own_end_m, player.speed_mps)
    other_s, other_leaves_s = _passage_s(other_m, other_end_m, body.speed_mps)
    waits_inside = conflicts[found, _WAIT_M] > conflicts[found, _STOP_M]
    moves_up = waits_inside and player.speed_mps**2 < 2.0 * COMFORTABLE_MPS2 * own_m  # it can stop in comfort
    if moves_up or own_s == np.inf or other_s == np.inf:
        gap_s = np.inf
    else:
        gap_s = max(other_s - own_leaves_s, own_s - other_leaves_s, 0.0)
    # a signal counts for a side that has not passed its stop line
    own_signal, other_signal = _OFF, _OFF
    if conflicts[found, _OWN_LINK] >= 0 and player.front_m <= conflicts[found, _STOP_M] and len(signals):
        own_signal = signals[int(conflicts[found, _OWN_LINK])]
    if conflicts[found, _OTHER_LINK] >= 0 and conflicts[found, _ZONE_M] - other_m <= 0.0 and len(signals):
        other_signal = signals[int(conflicts[found, _OTHER_LINK])]
    yields = has_duty(conflicts[found], own_signal, other_signal, other_s <= own_s)
    return (own_m, other_m, own_s, other_s, gap_s), yields


@compiled
def streams_at(
    pose: tuple[float, float, float], streams: Streams, found: tuple[IntArray, FloatArray, FloatArray]
) -> int:
    """The number of streams in which a body with a pose (x, y, heading) drives.

    `found` are arrays [S] that are written: the streams in order, the body's place along each stream, and room for its
    distances beside them. Streams that are farther beside the body than another one by more than `_BESIDE_M` are left
    out: inside a junction, it is on its way to leave them, or has only come near to their end.
    """
    (x_m, y_m, heading_rad), (in_streams, along_m, beside_m), samples = pose, found, streams.samples
    column = int((x_m - streams.origin_m[0]) // CELL_M)
    line = int((y_m - streams.origin_m[1]) // CELL_M)
    if column < 0 or line < 0 or column >= streams.first.shape[0] or line >= streams.first.shape[1] - 1:
        return 0
    count, nearest2, least_m = 0, np.inf, np.inf
    cosine, sine = np.cos(heading_rad), np.sin(heading_rad)
    for place in range(streams.first[column, line], streams.first[column, line + 1]):
        k = streams.rows[place]
        along_x, along_y = samples[k, junctions.COS], samples[k, junctions.SIN]
        dx, dy = x_m - samples[k, junctions.X_M], y_m - samples[k, junctions.Y_M]
        u, v = dx * along_x + dy * along_y, dy * along_x - dx * along_y
        outside = abs(v) > samples[k, junctions.HALF_WIDTH_M] or abs(u) > samples[k, junctions.HALF_SPACING_M]
        if outside or along_x * cosine + along_y * sine < _MOST_TURNED:
            continue
        again = count > 0 and in_streams[count - 1] == streams.stream[k]
        if not again or u * u + v * v < nearest2:
            count += 0 if again else 1
            in_streams[count - 1], nearest2 = streams.stream[k], u * u + v * v
            along_m[streams.stream[k]] = samples[k, junctions.ALONG_M] + u
            beside_m[count - 1] = abs(v)
            least_m = min(least_m, abs(v))
    near = 0
    for k in range(count):
        if beside_m[k] <= least_m + _BESIDE_M:
            in_streams[near] = in_streams[k]
            near += 1
    return near


@compiled
def _first_conflict(
    player: _Player, body: _Body, places: tuple[IntArray, FloatArray], streams: Streams
) -> tuple[int, float]:
    """The player's first conflict with a body that neither has passed, and the distance of the body's front to the
    zone; -1 without one. `places` are the body's streams, and its place along each stream."""
    (in_streams, along_m), conflicts = places, streams.conflicts
    found, begin_m, other_m = -1, np.inf, np.inf
    for k in range(body.streams):
        s = in_streams[k]
        for c in range(streams.first_conflict[player.player, s], streams.last_conflict[player.player, s]):
            if player.rear_m > conflicts[c, _END_M] or conflicts[c, _BEGIN_M] >= begin_m:
                continue
            if not conflicts[c, _RIGHT_M] <= player.offset_m <= conflicts[c, _LEFT_M]:
                continue
            place = along_m[s]
            if not conflicts[c, _FROM_M] <= place <= conflicts[c, _UNTIL_M]:
                continue
            if place - body.half_m > conflicts[c, _ZONE_M] + conflicts[c, _LENGTH_M]:
                continue
            found, begin_m, other_m = c, conflicts[c, _BEGIN_M], conflicts[c, _ZONE_M] - place - body.half_m
    return found, other_m


@compiled
def _passage_s(begin_m: float, end_m: float, speed_mps: float) -> tuple[float, float]:
    """The times at which a body enters and leaves a zone from `begin_m` to `end_m` ahead of it at constant speed."""
    moves = speed_mps > STANDING_MPS
    enters = 0.0 if begin_m <= 0.0 else (begin_m / speed_mps if moves else np.inf)
    return enters, (max(end_m, 0.0) / speed_mps if moves else np.inf)


@compiled
def has_duty(conflict: FloatArray, own: int, other: int, other_first: bool) -> bool:
    """Whether the player must yield in a conflict [17], a row of `Streams.conflicts`, given the signals of both sides.

    A stream on red has no priority, a player on red has none over a stream that is not, a player on 'G' yields to no
    stream, and any other player at these lights yields to a stream on 'G'. Otherwise the signs of the junction decide.
    """
    if other == _RED or own == _GREEN:
        return False
    if own == _RED or (other == _GREEN and conflict[_OWN_LINK] >= 0):
        return True
    if conflict[_FIRST_COME] > 0.0:
        return other_first
    return conflict[_YIELDS] > 0.0


# --- passages of zones in a recorded game ----------------------------------------------------------------------------


class Places(NamedTuple):
    """The streams in which bodies drive, one row for each step, body and stream, [N]."""

    step: IntArray
    body: IntArray
    stream: IntArray
    along_m: FloatArray  # of the body's centre, from the stream's stop line


class Passage(NamedTuple):
    """A body's passage of a zone, in seconds since the start of the game."""

    enters_s: float  # its front
    leaves_s: float  # its rear; inf if it does not


@compiled
def places(columns: tuple[Any, ...], table: tuple[Any, ...]) -> tuple[IntArray, IntArray, IntArray, FloatArray]:
    """The columns of `Places`, of bodies [T, B] in the table of streams."""
    among, streams = Bodies(*columns), Streams(*table)
    along_m = np.empty(streams.first_conflict.shape[1])
    in_streams = np.empty(len(along_m), dtype=np.int64)
    found_streams = (in_streams, along_m, np.empty(len(along_m)))
    steps, bodies, found, along = [0], [0], [0], [0.0]  # numba infers the types of lists from their entries
    for t, b in np.ndindex(among.present.shape):
        if among.present[t, b]:
            pose = (among.x_m[t, b], among.y_m[t, b], among.heading_rad[t, b])
            count = streams_at(pose, streams, found_streams)
            for k in range(count):
                steps.append(t)
                bodies.append(b)
                found.append(in_streams[k])
                along.append(along_m[in_streams[k]])
    return np.array(steps)[1:], np.array(bodies)[1:], np.array(found)[1:], np.array(along)[1:]


def own_passage(
    front_m: FloatArray, speed_mps: FloatArray, zone_m: tuple[float, float], *, length_m: float, step_s: float
) -> Passage | None:
    """A player's passage of a zone, given by the stations of its ends, from the station of the player's front and its
    speed [T]; None if it does not enter."""
    begin_m, end_m = zone_m
    inside = np.flatnonzero((front_m >= begin_m) & (front_m - length_m <= end_m))
    if not len(inside):
        return None
    first = int(inside[0])
    after = first + np.flatnonzero(front_m[first:] - length_m > end_m)
    enters_s = _reached_s(first, front_m[first] - begin_m, speed_mps[first], step_s)
    if not len(after):
        return Passage(enters_s, np.inf)
    return Passage(enters_s, _reached_s(after[0], front_m[after[0]] - length_m - end_m, speed_mps[after[0]], step_s))


def other_passage(
    at: IntArray,
    along_m: FloatArray,
    speed_mps: FloatArray,
    zone_m: tuple[float, float],
    *,
    length_m: float,
    step_s: float,
) -> Passage | None:
    """A body's passage of a zone, given by its ends along the stream, from the body's places along the stream and its
    speed in the steps `at` [N]; None if it does not enter.

    A body that joins the player's way leaves the stream inside the zone: the rest of the zone counts at its last speed.
    """
    front_m, rear_m = along_m + 0.5 * length_m, along_m - 0.5 * length_m
    begin_m, end_m = zone_m
    inside = np.flatnonzero((front_m >= begin_m) & (rear_m <= end_m))
    if not len(inside):
        return None
    first, last = inside[0], inside[-1]
    moves = speed_mps[last] > STANDING_MPS
    leaves_s = at[last] * step_s + (end_m - rear_m[last]) / speed_mps[last] if moves else np.inf
    return Passage(_reached_s(at[first], front_m[first] - begin_m, speed_mps[first], step_s), float(leaves_s))


def _reached_s(step: int, beyond_m: float, speed_mps: float, step_s: float) -> float:
    """When a place was reached that a body was beyond by `beyond_m` at a step: during the step before."""
    return float(step * step_s - min(beyond_m / max(speed_mps, STANDING_MPS), step_s if step else 0.0))
