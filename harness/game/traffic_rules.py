"""Signals, signs and right of way: what the rules ask of each player, and what it did.

A player passes a stop line in the step in which its front bumper does.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from harness.game.arrays import FloatArray, IntArray
from harness.game.jit import compiled
from harness.game.junctions import Conflicts, Control, Signal, StopLines
from harness.game.meetings import Meetings
from harness.game.road import COMFORTABLE_MPS2

AMBER_MPS2 = 3.0  # yellow means stop, unless it takes more braking than this (ITE: 10 ft/s2)
YIELDS_WITHIN_S = 4.0  # a body with priority that arrives sooner is waited for
WAITS_WITHIN_M = 10.0  # of a line: a car that stands there, or moves up to it, is not late
WAITS_INSIDE_WITHIN_M = 3.0  # of a place inside a junction: cars that turn across traffic clear it while they can
ROLLING_MPS = 0.5  # speed at a stop sign that the rules take for a stop
# plain integers: compiled code can't convert a member
_OFF, _YELLOW, _RED = int(Signal.OFF), int(Signal.YELLOW), int(Signal.RED)
_STOP, _ALL_WAY_STOP = int(Control.STOP), int(Control.ALL_WAY_STOP)


class TrafficRules(NamedTuple):
    """The rules at the players, [G, P]."""

    next_line: IntArray  # row of the next stop line; -1 without one
    permitted_mps: FloatArray  # speed that the limits, signals, signs and right of way permit
    due_mps: FloatArray  # speed below which the player is late: the permitted one, or 0 where it waits
    posted_mps: FloatArray  # speed that the limits, signals and signs permit
    passed_red_s: FloatArray  # seconds since a signal became red whose line was passed in this step; else -1
    passed_stop_sign_mps: FloatArray  # speed at which a stop sign was passed in this step; else -1


@compiled
def rules(
    players: tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray],
    links: tuple[IntArray, FloatArray],
    tables: tuple[tuple[Any, ...], ...],
) -> tuple[IntArray, FloatArray]:
    """The columns of `TrafficRules`: the next line [G, P], and the numbers [5, G, P] in their order.

    Players are given by station, way in this step, speed and speed for the limits ahead [G, P], and length [P]; links
    [G, L] by their states and the seconds since they changed. `tables` are stop lines, conflicts and meetings.
    """
    (station_m, advanced_m, speed_mps, approach_mps, length_m), (signals, signal_s) = players, links
    lines, conflicts, meetings = StopLines(*tables[0]), Conflicts(*tables[1]), Meetings(*tables[2])
    next_line, numbers = np.full(station_m.shape, -1), np.empty((5, *station_m.shape))
    for g, p in np.ndindex(station_m.shape):
        front_m, speed, permitted_mps = station_m[g, p] + 0.5 * length_m[p], speed_mps[g, p], approach_mps[g, p]
        waits, passed_red_s, passed_stop_sign_mps = False, -1.0, -1.0
        for line in range(len(lines.player)):  # sorted by player and station
            if lines.player[line] != p:
                continue
            control, link, place_m = lines.control[line], lines.link[line], lines.station_m[line]
            signal = signals[g, link] if link >= 0 else _OFF
            if place_m >= front_m:
                next_line[g, p] = line
                stopping_mps = _speed_before_line(place_m - front_m, speed, control, signal)
                waits = stopping_mps < _braking_mps(WAITS_WITHIN_M) and control not in (_STOP, _ALL_WAY_STOP)
                permitted_mps = min(permitted_mps, stopping_mps)
                break
            if front_m - advanced_m[g, p] <= place_m:  # passed in this step
                if signal == _RED:
                    passed_red_s = signal_s[g, link]
                if control in (_STOP, _ALL_WAY_STOP):
                    passed_stop_sign_mps = speed
        posted_mps = permitted_mps
        for b in range(meetings.conflict.shape[2]):
            conflict = meetings.conflict[g, p, b]
            if conflict >= 0 and meetings.must_yield[g, p, b] and meetings.other_s[g, p, b] < YIELDS_WITHIN_S:
                room_m = conflicts.wait_m[conflict] - front_m
                inside = conflicts.wait_m[conflict] > conflicts.stop_m[conflict]
                within_m = WAITS_INSIDE_WITHIN_M if inside else WAITS_WITHIN_M
                if room_m < 0.0:  # past the place: before the zone
                    room_m, within_m = meetings.own_m[g, p, b], WAITS_WITHIN_M
                if room_m >= 0.0:
                    waits = waits or room_m < within_m
                    permitted_mps = min(permitted_mps, _braking_mps(room_m))
        due_mps = 0.0 if waits else permitted_mps
        for k, number in enumerate((permitted_mps, due_mps, posted_mps, passed_red_s, passed_stop_sign_mps)):
            numbers[k, g, p] = number
    return next_line, numbers


@compiled
def _speed_before_line(room_m: float, speed_mps: float, control: int, signal: int) -> float:
    """The speed (m/s) that signal and sign of a stop line permit at a distance before it, to a car at a speed."""
    amber = signal == _YELLOW and speed_mps**2 <= 2.0 * AMBER_MPS2 * room_m
    if signal == _RED or amber:
        return _braking_mps(room_m)
    if control in (_STOP, _ALL_WAY_STOP):
        return np.sqrt(2.0 * COMFORTABLE_MPS2 * room_m + ROLLING_MPS**2)
    return np.inf


@compiled
def _braking_mps(room_m: float) -> float:
    """The speed (m/s) from which comfortable braking ends within a distance."""
    return np.sqrt(2.0 * COMFORTABLE_MPS2 * room_m)


def since_change_s(before: IntArray, now: IntArray, since_s: FloatArray, step_s: float) -> FloatArray:
    """[G, L] seconds since the signals changed, from their states in the step before and now, and the seconds then."""
    return np.where(now == before, since_s + step_s, 0.0)
