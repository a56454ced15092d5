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
    ends: tuple[BoolArray, BoolArray],
    distances_m: tuple[FloatArray, FloatArray, FloatArray],
) -> None:
    """Set the outcomes [G, P] of the players that drove [G, P], in place: contact before goal, goal before timeout.

    `ends` are the players that the harness drives [P], for which alone contact with a rail counts, and the games whose
    time is up [G]; `distances_m` are those to the goal, to vehicles and to rails [G, P].
    """
    (taken_over, time_is_up), (goal_m, vehicle_clearance_m, rail_clearance_m) = ends, distances_m
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
