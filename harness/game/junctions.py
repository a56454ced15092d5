"""Conflicts at junctions: where streams of traffic cross or join a player's route, which side has priority, and when
each side is there.

A stream is the traffic of one link of a junction: its lanes before, inside and shortly beyond the junction. A conflict
is the zone in which cars on the player's lane and in a stream need the same room. A body conflicts with a player if it
drives in a stream that conflicts with the player's route. This is geometry: it is what a driver sees, without knowledge
of the other's route or intention.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray

CELL_M = 8.0  # of the grid of a stream's samples
KERB_M = 0.3  # a walker waits this far before the side of a lane
_DTYPES = {
    **dict.fromkeys(("player", "stream", "own_link", "other_link", "control", "link"), np.int64),
    **dict.fromkeys(("yields", "first_come", "across"), np.bool_),
}


_USUAL: Mapping[str, Any] = {
    **{"yields": False, "first_come": False, "across": False, "own_link": -1, "other_link": -1},
    **dict.fromkeys(("right_m", "from_m"), -np.inf),
    **dict.fromkeys(("left_m", "until_m"), np.inf),
}
"""A conflict without signals, in whatever lane the player is, with all of a stream that crosses its way."""


class Signal(IntEnum):
    """State of a link of a traffic light."""

    OFF = 0  # or no traffic light
    GREEN = 1  # with priority: 'G' of SUMO
    GREEN_YIELDING = 2  # 'g'
    YELLOW = 3  # 'y'
    RED = 4  # 'r', and red with yellow 'u'


SIGNALS = {
    "G": Signal.GREEN,
    "g": Signal.GREEN_YIELDING,
    "s": Signal.GREEN_YIELDING,  # a green arrow to the right, after a stop
    "y": Signal.YELLOW,
    "Y": Signal.YELLOW,
    "r": Signal.RED,
    "u": Signal.RED,
}
"""By the letter that SUMO uses; any other is off."""


class Control(IntEnum):
    """What controls a player's entry into a junction."""

    NONE = 0
    GIVE_WAY = 1  # yields to some streams: by a sign, to the right, or when it turns across oncoming traffic
    STOP = 2
    ALL_WAY_STOP = 3
    SIGNAL = 4


class Conflicts(NamedTuple):
    """Zones in which a stream crosses or joins a player's route, [C], sorted by player, stream and `begin_m`.

    Stations are on the player's route. Distances "along the stream" count from the stream's stop line.
    """

    player: IntArray
    stream: IntArray
    begin_m: FloatArray  # stations of the zone
    end_m: FloatArray
    yields: BoolArray  # the player must yield to the stream while no signal says otherwise
    first_come: BoolArray  # the side that arrives first has priority: all-way stops, zippers
    stop_m: FloatArray  # station of the player's stop line
    wait_m: FloatArray  # station where a car waits for the stream: the stop line, or a place inside the junction
    right_m: FloatArray  # lateral offsets from the route's line between which the player is in the conflicting lane
    left_m: FloatArray
    own_link: IntArray  # columns of the table of signals; -1 without a signal
    other_link: IntArray
    from_m: FloatArray  # part of the stream, along it, on which a body is not on the player's own way
    until_m: FloatArray
    zone_m: FloatArray  # begin of the zone along the stream
    length_m: FloatArray  # of the zone along the stream
    across: BoolArray  # the player turns across oncoming traffic

    @classmethod
    def of(cls, rows: Sequence[Mapping[str, Any]]) -> Conflicts:
        """The table of conflicts, each given by column, except where it has the usual value."""
        whole = [{**_USUAL, **row} for row in rows]
        ordered = sorted(whole, key=lambda row: (row["player"], row["stream"], row["begin_m"]))
        return cls(*(_column(name, [row[name] for row in ordered]) for name in cls._fields))


SAMPLE = ("x_m", "y_m", "cos", "sin", "half_width_m", "half_spacing_m", "along_m")
"""The columns of a stream's samples: point and direction of its centre line, half its width, half the length of stream
that the sample stands for, and the place along the stream."""
X_M, Y_M, COS, SIN, HALF_WIDTH_M, HALF_SPACING_M, ALONG_M = range(len(SAMPLE))


class Streams(NamedTuple):
    """Streams, as samples [N] of their centre lines with a grid for look-up, and their conflicts, for compiled loops.

    The samples of cell (x, y) are `samples[rows[first[x, y]:first[x, y + 1]]]`, sorted by stream.
    """

    samples: FloatArray  # [N, 7] with the columns of `SAMPLE`
    stream: IntArray  # [N]
    origin_m: FloatArray  # [2]
    first: IntArray  # [X, Y + 1]
    rows: IntArray
    first_conflict: IntArray  # [P, S] the player's conflicts with a stream: the first row of `conflicts`
    last_conflict: IntArray  # [P, S] and the row after the last one
    conflicts: FloatArray  # [C, 17] the columns of `Conflicts` in one array

    @classmethod
    def of(cls, samples: FloatArray, stream: IntArray, conflicts: Conflicts, players: int) -> Streams:
        """The table of samples [N, 7] of streams [N]."""
        count = int(stream.max(initial=-1)) + 1
        keys = conflicts.player * count + conflicts.stream
        wanted = np.arange(players * count).reshape(players, count)
        origin_m, first, rows = _grid(samples, stream)
        return cls(
            samples=np.ascontiguousarray(samples),
            stream=stream,
            origin_m=origin_m,
            first=first,
            rows=rows,
            first_conflict=np.searchsorted(keys, wanted, side="left"),
            last_conflict=np.searchsorted(keys, wanted, side="right"),
            conflicts=np.stack(conflicts, axis=1, dtype=np.float64),
        )


class StopLines(NamedTuple):
    """Where the players enter the junctions on their routes, [N], sorted by player and station."""

    player: IntArray
    station_m: FloatArray
    control: IntArray  # Control
    link: IntArray  # column of the table of signals; -1 without a signal

    @classmethod
    def of(cls, lines: Sequence[tuple[int, float, Control, int]]) -> StopLines:
        """The table of lines, each given by its player, station, control and link."""
        ordered = sorted(lines)
        return cls(*(_column(name, [line[k] for line in ordered]) for k, name in enumerate(cls._fields)))


class RightOfWay(NamedTuple):
    """Conflicts of the players' routes with streams of traffic, and control at junctions."""

    conflicts: Conflicts
    streams: Streams
    stop_lines: StopLines
    signal_links: tuple[tuple[str, int], ...]
    """The links of traffic lights that matter, (id, index): the columns of the table of signals."""
    stream_lanes: tuple[tuple[str, str], ...] = ()
    """The lanes before and behind the junction of each stream."""


def _column(name: str, values: list[Any]) -> Any:
    """[N] a column of a table, with its dtype."""
    return np.array(values, dtype=_DTYPES.get(name, np.float64))


def _grid(samples: FloatArray, stream: IntArray) -> tuple[FloatArray, IntArray, IntArray]:
    """The grid of samples: each sample is in every cell that touches the box around the length it stands for."""
    if not len(stream):
        return np.zeros(2), np.zeros((1, 2), dtype=np.int64), np.zeros(0, dtype=np.int64)
    points, reach_m = samples[:, :2], np.hypot(samples[:, HALF_WIDTH_M], samples[:, HALF_SPACING_M])[:, None]
    origin_m = (points - reach_m).min(0)
    low = ((points - reach_m - origin_m) // CELL_M).astype(np.int64)
    high = ((points + reach_m - origin_m) // CELL_M).astype(np.int64) + 1
    across, up = high.max(0)
    pairs = [
        (x * up + y, row)
        for row in np.lexsort((samples[:, ALONG_M], stream)).tolist()
        for x in range(low[row, 0], high[row, 0])
        for y in range(low[row, 1], high[row, 1])
    ]
    cell, sample = np.array(pairs, dtype=np.int64).T
    order = np.argsort(cell, kind="stable")
    bounds = np.searchsorted(cell[order], np.arange(across * up + 1))
    first = bounds[np.arange(across)[:, None] * up + np.arange(up + 1)]
    return origin_m, first, sample[order]


_NO_CONFLICTS = Conflicts.of([])
NO_JUNCTIONS = RightOfWay(
    conflicts=_NO_CONFLICTS,
    streams=Streams.of(np.zeros((0, 7)), np.zeros(0, dtype=np.int64), _NO_CONFLICTS, players=0),
    stop_lines=StopLines.of([]),
    signal_links=(),
)
