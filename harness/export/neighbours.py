"""Who is ahead, behind and beside whom, along the courses of lanes."""

from __future__ import annotations

import numpy as np
import pandas as pd

from harness.export.lane_courses import NONE
from harness.game.arrays import FloatArray, IntArray


def neighbours_of(tracks: pd.DataFrame, stations: FloatArray, beside: IntArray) -> dict[str, IntArray]:
    """The rows [N] of the nearest road users of each row in the same frame, by highD's columns; NONE without one.

    `tracks` has `frame` and `width`, the body's length; `stations` [N, C] are places along each course, `beside` [N, 3]
    the courses of the own lane and of those to the left and right. A body that overlaps lengthwise in another lane is
    alongside.
    """
    count, length_m = len(tracks), tracks["width"].to_numpy()
    names = [
        ("precedingId", None, "followingId"),
        ("leftPrecedingId", "leftAlongsideId", "leftFollowingId"),
        ("rightPrecedingId", "rightAlongsideId", "rightFollowingId"),
    ]
    found: dict[str, IntArray] = {name: np.full(count, NONE) for row in names for name in row if name is not None}
    for frame in tracks.groupby("frame", sort=False).indices.values():
        for row in frame:
            for lane, (ahead, alongside, behind) in enumerate(names):
                course = beside[row, lane]
                others = frame[(frame != row) & (beside[frame, 0] == course)] if course != NONE else frame[:0]
                if not len(others):
                    continue
                away_m = stations[others, course] - stations[row, course]
                overlaps = np.abs(away_m) < 0.5 * (length_m[others] + length_m[row])
                if alongside is not None:
                    found[alongside][row] = _nearest(others[overlaps], away_m[overlaps])
                    others, away_m = others[~overlaps], away_m[~overlaps]
                found[ahead][row] = _nearest(others[away_m > 0.0], away_m[away_m > 0.0])
                found[behind][row] = _nearest(others[away_m <= 0.0], away_m[away_m <= 0.0])
    return found


def _nearest(rows: IntArray, away_m: FloatArray) -> int:
    return int(rows[np.argmin(np.abs(away_m))]) if len(rows) else NONE
