"""The players' conflicts with other bodies at junctions: distances, times, and the duty to yield."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.jit import compiled
from harness.game.right_of_way import CELL_M, Conflicts, Signal, Streams

STANDING_MPS = 0.1  # a body that is not faster does not arrive
_MOST_TURNED = float(np.cos(np.pi / 4.0))  # a body drives in a stream if its heading is within 45 degrees


_OFF = int(Signal.OFF)  # a plain integer: compiled code can't convert a member


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
    must_yield: BoolArray  # the player, to the body
    gap_s: FloatArray  # time between the two passages; 0 if both would be in the zone at the same time


@compiled
def meetings(
    station_m: FloatArray,
    offset_m: FloatArray,
    speed_mps: FloatArray,
    length_m: FloatArray,
    bodies: tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray],
    visible: BoolArray,
    signals: IntArray,
    conflict_table: tuple[Any, ...],
    stream_table: tuple[Any, ...],
) -> tuple[IntArray, FloatArray, FloatArray, FloatArray, FloatArray, BoolArray, FloatArray]:
    """The columns of `Meetings`.

    Players are given by station, lateral offset and speed [G, P] and length [P], bodies by x, y, heading, speed and
    length [G, B], and which body each player regards by `visible` [G, P, B]. `signals` [G, L] are the states of links.
    """
    conflicts, streams = Conflicts(*conflict_table), Streams(*stream_table)
    x_m, y_m, heading_rad, body_speed_mps, body_length_m = bodies
    shape = visible.shape
    row, must_yield = np.full(shape, -1), np.zeros(shape, dtype=np.bool_)
    own_m, other_m, gap_s = np.full(shape, np.inf), np.full(shape, np.inf), np.full(shape, np.inf)
    own_s, other_s = np.full(shape, np.inf), np.full(shape, np.inf)
    if len(conflicts.player) == 0:
        return row, own_m, other_m, own_s, other_s, must_yield, gap_s
    along_m = np.empty(streams.first_conflict.shape[1])
    in_streams = np.empty(len(along_m), dtype=np.int64)
    for g in range(shape[0]):
        for b in range(shape[2]):
            count = -1  # the streams of the body are found once, for the first player that regards it
            half_m = 0.5 * body_length_m[g, b]
            for p in range(shape[1]):
                if not visible[g, p, b]:
                    continue
                if count < 0:
                    count = _streams_at(x_m[g, b], y_m[g, b], heading_rad[g, b], streams, in_streams, along_m)
                found, other = _first_conflict(
                    p, station_m[g, p] - 0.5 * length_m[p], offset_m[g, p], half_m, in_streams[:count], along_m,
                    conflicts, streams,
                )  # fmt: skip
                if found >= 0:
                    front_m = station_m[g, p] + 0.5 * length_m[p]
                    row[g, p, b], other_m[g, p, b] = found, other
                    own_m[g, p, b] = conflicts.begin_m[found] - front_m
                    own_end_m = conflicts.end_m[found] - front_m + length_m[p]
                    other_end_m = other + conflicts.length_m[found] + 2.0 * half_m
                    own = _passage_s(own_m[g, p, b], own_end_m, speed_mps[g, p])
                    others = _passage_s(other, other_end_m, body_speed_mps[g, b])
                    own_s[g, p, b], other_s[g, p, b] = own[0], others[0]
                    gap_s[g, p, b] = _gap_s(own, others)
                    must_yield[g, p, b] = _must_yield(
                        found, front_m, conflicts.zone_m[found] - other, own[0], others[0], signals[g], conflicts
                    )
    return row, own_m, other_m, own_s, other_s, must_yield, gap_s


@compiled
def _streams_at(
    x_m: float, y_m: float, heading_rad: float, streams: Streams, in_streams: IntArray, along_m: FloatArray
) -> int:
    """The number of streams in which a body drives; written to `in_streams` in order, and its place to `along_m`."""
    column = int((x_m - streams.origin_m[0]) // CELL_M)
    line = int((y_m - streams.origin_m[1]) // CELL_M)
    if column < 0 or line < 0 or column >= streams.first.shape[0] or line >= streams.first.shape[1] - 1:
        return 0
    count, nearest2 = 0, np.inf
    cosine, sine = np.cos(heading_rad), np.sin(heading_rad)
    for place in range(streams.first[column, line], streams.first[column, line + 1]):
        k = streams.samples[place]
        dx, dy = x_m - streams.x_m[k], y_m - streams.y_m[k]
        u, v = dx * streams.cos[k] + dy * streams.sin[k], dy * streams.cos[k] - dx * streams.sin[k]
        if abs(v) > streams.half_width_m[k] or abs(u) > streams.half_spacing_m[k]:
            continue
        if streams.cos[k] * cosine + streams.sin[k] * sine < _MOST_TURNED:
            continue
        again = count > 0 and in_streams[count - 1] == streams.stream[k]
        if not again or u * u + v * v < nearest2:
            count += 0 if again else 1
            in_streams[count - 1], nearest2 = streams.stream[k], u * u + v * v
            along_m[streams.stream[k]] = streams.along_m[k] + u
    return count


@compiled
def _first_conflict(
    player: int,
    rear_m: float,
    offset_m: float,
    half_m: float,
    in_streams: IntArray,
    along_m: FloatArray,
    conflicts: Conflicts,
    streams: Streams,
) -> tuple[int, float]:
    """The player's first conflict with a body in these streams that neither has passed, and the distance of the body's
    front to the zone; -1 without one. `rear_m` is the station of the player's rear, `half_m` half the body's length."""
    found, begin_m, other_m = -1, np.inf, np.inf
    for s in in_streams:
        for c in range(streams.first_conflict[player, s], streams.last_conflict[player, s]):
            if rear_m > conflicts.end_m[c] or conflicts.begin_m[c] >= begin_m:
                continue
            if not conflicts.right_m[c] <= offset_m <= conflicts.left_m[c]:
                continue
            place = along_m[s]
            if not conflicts.from_m[c] <= place <= conflicts.until_m[c]:
                continue
            if place - half_m > conflicts.zone_m[c] + conflicts.length_m[c]:
                continue
            found, begin_m, other_m = c, conflicts.begin_m[c], conflicts.zone_m[c] - place - half_m
    return found, other_m


@compiled
def _passage_s(begin_m: float, end_m: float, speed_mps: float) -> tuple[float, float]:
    """The times at which a body enters and leaves a zone from `begin_m` to `end_m` ahead of it at constant speed."""
    moves = speed_mps > STANDING_MPS
    enters = 0.0 if begin_m <= 0.0 else (begin_m / speed_mps if moves else np.inf)
    return enters, (max(end_m, 0.0) / speed_mps if moves else np.inf)


@compiled
def _gap_s(own: tuple[float, float], other: tuple[float, float]) -> float:
    """The time between two passages; 0 if they overlap, inf if one of the two never begins."""
    if own[0] == np.inf or other[0] == np.inf:
        return np.inf
    return max(other[0] - own[1], own[0] - other[1], 0.0)


@compiled
def _must_yield(
    c: int,
    front_m: float,
    other_along_m: float,
    own_s: float,
    other_s: float,
    signals: IntArray,
    conflicts: Conflicts,
) -> bool:
    """Whether the player must yield in conflict `c`.

    A signal counts for a side that has not passed its stop line: a stream on red has no priority, a player on red has
    none over a stream that is not, and a player on 'G' yields to no stream. Otherwise the signs of the junction decide.
    """
    own, other = _OFF, _OFF
    if conflicts.own_link[c] >= 0 and front_m <= conflicts.stop_m[c] and len(signals):
        own = signals[conflicts.own_link[c]]
    if conflicts.other_link[c] >= 0 and other_along_m <= 0.0 and len(signals):
        other = signals[conflicts.other_link[c]]
    if other == Signal.RED or own == Signal.GREEN:
        return False
    if own == Signal.RED:
        return True
    if conflicts.first_come[c]:
        return other_s < own_s
    return conflicts.yields[c]
