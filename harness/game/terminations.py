"""How games end: contact, goal and time limit."""

from __future__ import annotations

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.jit import compiled
from harness.game.outcome import Outcome


@compiled
def terminations(
    outcome: IntArray,
    drove: BoolArray,
    taken_over: BoolArray,
    time_is_up: BoolArray,
    goal_m: FloatArray,
    vehicle_clearance_m: FloatArray,
    rail_clearance_m: FloatArray,
) -> None:
    """Set the outcomes [G, P] of the players that drove [G, P], in place: contact before goal, goal before timeout
    (time_is_up [G]). Contact with a rail counts only for players that the harness drives (taken_over [P])."""
    for g, p in np.ndindex(outcome.shape):
        if drove[g, p]:
            if vehicle_clearance_m[g, p] <= 0.0:
                outcome[g, p] = Outcome.COLLISION
            elif rail_clearance_m[g, p] <= 0.0 and taken_over[p]:
                outcome[g, p] = Outcome.RAIL
            elif goal_m[g, p] <= 0.0:
                outcome[g, p] = Outcome.GOAL
            elif time_is_up[g]:
                outcome[g, p] = Outcome.TIMEOUT
