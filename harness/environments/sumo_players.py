"""What a simulation tells of a step: the motion of the players that SUMO drives, and the signals."""

from __future__ import annotations

import numpy as np

from harness.game.arrays import BoolArray
from harness.game.state import State
from harness.game.traffic_rules import since_change_s
from harness.sumo.simulation import Reading


def read_signals(state: State, before: State, reading: Reading, step_s: float) -> None:
    """Write the signals to `state`, in place."""
    if reading.signals is not None:
        state.signal_s = since_change_s(before.signals, reading.signals, before.signal_s, step_s)
        state.signals = reading.signals


def read_sumo_players(
    state: State, reading: Reading, *, drove: BoolArray, taken_over: BoolArray, step_s: float
) -> None:
    """Write the motion of the players that SUMO drives to `state`, in place.

    `drove` [G, P] marks the players that still drive, `taken_over` [P] those that the harness drives.
    """
    if reading.players is None:
        return
    for player in np.flatnonzero(~taken_over):
        games = np.flatnonzero(drove[:, player])
        x, y, heading, speed = reading.players[games, player].T
        gained = np.where(state.step[games] > 0, speed - state.speed_mps[games, player], 0.0)
        state.acceleration_mps2[games, player] = gained / step_s
        state.x_m[games, player], state.y_m[games, player] = x, y
        state.heading_rad[games, player], state.speed_mps[games, player] = heading, speed
