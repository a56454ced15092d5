"""When bodies pass zones of conflict, in the steps of a recorded game: the axis of games is that of steps, [T]."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from harness.game.arrays import FloatArray, IntArray
from harness.game.jit import compiled
from harness.game.junctions import Streams
from harness.game.meetings import STANDING_MPS, streams_at
from harness.game.state import Bodies


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
    steps, bodies, found, along = [0], [0], [0], [0.0]  # numba infers the types of lists from their entries
    for t, b in np.ndindex(among.present.shape):
        if among.present[t, b]:
            pose = (among.x_m[t, b], among.y_m[t, b], among.heading_rad[t, b])
            count = streams_at(pose, streams, in_streams, along_m)
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
