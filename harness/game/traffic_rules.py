"""Signals, signs and sides of the road: what the rules ask of each player, and what it did. Arrays are [G, P].

A player passes a stop line in the step in which its front bumper does.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.jit import compiled
from harness.game.meetings import Meetings
from harness.game.right_of_way import Conflicts, Control, Signal, StopLines
from harness.game.road import COMFORTABLE_MPS2

AMBER_MPS2 = 3.0  # yellow means stop, unless it takes more braking than this (ITE: 10 ft/s2)
YIELDS_WITHIN_S = 4.0  # a body with priority that arrives sooner is waited for
WAITS_WITHIN_M = 10.0  # of a line: a car that stands there, or moves up to it, is not late
ROLLING_MPS = 0.5  # speed at a stop sign that the rules take for a stop


@compiled
def next_stop_lines(front_m: FloatArray, player: IntArray, station_m: FloatArray) -> IntArray:
    """The first stop line of each player that its front at `front_m` has not passed; -1 without one."""
    lines = np.full(front_m.shape, -1)
    for g, p in np.ndindex(front_m.shape):
        for line in range(len(player)):
            if player[line] == p and station_m[line] >= front_m[g, p]:
                lines[g, p] = line
                break
    return lines


@compiled
def passed_stop_lines(
    front_m: FloatArray,
    advanced_m: FloatArray,
    speed_mps: FloatArray,
    signals: IntArray,
    signal_s: FloatArray,
    table: tuple[Any, ...],
) -> tuple[FloatArray, FloatArray]:
    """Seconds since the signal became red, for players that passed its stop line on red in this step; and the speed
    (m/s) of players that passed a stop sign. -1 for all others."""
    lines = StopLines(*table)
    red_s, stop_mps = np.full(front_m.shape, -1.0), np.full(front_m.shape, -1.0)
    for g, p in np.ndindex(front_m.shape):
        for line in range(len(lines.player)):
            passed = front_m[g, p] - advanced_m[g, p] <= lines.station_m[line] < front_m[g, p]
            if lines.player[line] == p and passed:
                link, control = lines.link[line], lines.control[line]
                if link >= 0 and signals[g, link] == Signal.RED:
                    red_s[g, p] = signal_s[g, link]
                if control == Control.STOP or control == Control.ALL_WAY_STOP:
                    stop_mps[g, p] = speed_mps[g, p]
    return red_s, stop_mps


@compiled
def permitted_mps(
    front_m: FloatArray,
    speed_mps: FloatArray,
    approach_mps: FloatArray,
    next_line: IntArray,
    signals: IntArray,
    table: tuple[Any, ...],
    conflict_table: tuple[Any, ...],
    meeting_table: tuple[Any, ...],
) -> tuple[FloatArray, BoolArray]:
    """The speed (m/s) that limits, signals, signs and right of way permit: that of comfortable braking to a lower limit
    ahead, and to a stop line where one has to stop or to wait. And whether it has to wait, at that line."""
    lines, conflicts, meetings = StopLines(*table), Conflicts(*conflict_table), Meetings(*meeting_table)
    permitted, waits = approach_mps.copy(), np.zeros(front_m.shape, dtype=np.bool_)
    for g, p in np.ndindex(front_m.shape):
        line = next_line[g, p]
        if line >= 0:
            room_m = max(lines.station_m[line] - front_m[g, p], 0.0)
            stopping2 = 2.0 * COMFORTABLE_MPS2 * room_m
            control, link = lines.control[line], lines.link[line]
            signal = signals[g, link] if link >= 0 else 0  # off
            amber = signal == Signal.YELLOW and speed_mps[g, p] ** 2 <= 2.0 * AMBER_MPS2 * room_m
            if signal == Signal.RED or amber:
                waits[g, p] = room_m < WAITS_WITHIN_M
                permitted[g, p] = min(permitted[g, p], np.sqrt(stopping2))
            elif control == Control.STOP or control == Control.ALL_WAY_STOP:
                permitted[g, p] = min(permitted[g, p], np.sqrt(stopping2 + ROLLING_MPS**2))
        for b in range(meetings.conflict.shape[2]):
            conflict = meetings.conflict[g, p, b]
            if conflict >= 0 and meetings.must_yield[g, p, b] and meetings.other_s[g, p, b] < YIELDS_WITHIN_S:
                room_m = conflicts.stop_m[conflict] - front_m[g, p]
                if room_m < 0.0:  # inside the junction: before the zone
                    room_m = meetings.own_m[g, p, b]
                if room_m >= 0.0:
                    waits[g, p] |= room_m < WAITS_WITHIN_M
                    permitted[g, p] = min(permitted[g, p], np.sqrt(2.0 * COMFORTABLE_MPS2 * room_m))
    return permitted, waits


@compiled
def wrong_way(offset_m: FloatArray, row: IntArray, own_left_m: FloatArray, own_right_m: FloatArray) -> FloatArray:
    """1 for players whose centre is among oncoming lanes, else 0."""
    wrong = np.zeros(offset_m.shape)
    for g, p in np.ndindex(offset_m.shape):
        beside = offset_m[g, p] > own_left_m[row[g, p]] or offset_m[g, p] < own_right_m[row[g, p]]
        wrong[g, p] = 1.0 if beside else 0.0
    return wrong


@compiled
def since_change_s(before: IntArray, now: IntArray, since_s: FloatArray, step_s: float) -> FloatArray:
    """[G, L] seconds since the signals changed, from their states in the step before and now, and the seconds then."""
    seconds = np.empty(since_s.shape)
    for g, link in np.ndindex(now.shape):
        seconds[g, link] = since_s[g, link] + step_s if now[g, link] == before[g, link] else 0.0
    return seconds
