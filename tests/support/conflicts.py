"""A conflict made by hand: a stream from the south crosses the merge road at x = 100 m.

On the line y = -1.6 of the merge road, stations are x. The stream is 3.2 m wide and has its stop line at y = -10: the
place of a body along it is y + 10. The zone is 98.5 to 101.5 m on the route and 7 to 10 m along the stream.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from harness.game.junctions import Conflicts, Control, RightOfWay, StopLines, Streams
from harness.game.world import World

CROSSING: Mapping[str, Any] = {
    "player": 0,
    "stream": 0,
    "begin_m": 98.5,
    "end_m": 101.5,
    "yields": True,
    "stop_m": 90.0,
    "wait_m": 90.0,
    "own_link": 0,
    "other_link": 1,
    "zone_m": 7.0,
    "length_m": 3.0,
}


def with_conflicts(
    world: World, *rows: Mapping[str, Any], stop_lines: Sequence[tuple[int, float, Control, int]] = ()
) -> World:
    """A world with conflicts with stream 0, which comes from the south. Stream 1 is 30 m to the east of it."""
    y_m = np.arange(-120.0, 20.0, 4.0)
    samples = np.array([(x, y, 0.0, 1.0, 1.6, 2.0, y + 10.0) for x in (100.0, 130.0) for y in y_m])
    conflicts = Conflicts.of(rows)
    streams = Streams.of(samples, np.repeat([0, 1], len(y_m)), conflicts, players=2)
    tables = RightOfWay(conflicts, streams, StopLines.of(stop_lines), (("light", 0), ("light", 1)))
    return replace(world, right_of_way=tables)
