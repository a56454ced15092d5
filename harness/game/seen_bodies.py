"""The bodies that the players see, all of them: an observation has the most urgent ones."""

from __future__ import annotations

from typing import Any

import numpy as np

from harness.game.arrays import BoolArray
from harness.game.field_of_view import Eyes, Seen, in_view
from harness.game.jit import compiled
from harness.game.memory import Perceived
from harness.game.quantities import Quantities
from harness.game.sight import SEEN_M


def seen_bodies(q: Quantities, seen: Seen) -> BoolArray:
    """[G, P, B] the bodies that players see, by what they take them to be."""
    state, world = q.state, q.world
    of_players = (
        *(state.x_m, state.y_m, state.heading_rad, state.present, state.visibility_m),
        *(state.sight_m, state.sight_cosine, state.shoulder_glance, world.length_m, world.width_m),
    )
    moving = q.bodies.present.shape[1] - len(world.hiding.obstacles)
    return _seen_bodies(of_players, seen.bodies.present, seen.hidden, seen.motion, moving)


@compiled
def _seen_bodies(
    players: tuple[Any, ...], present: BoolArray, hidden: BoolArray, perceived: Perceived, moving: int
) -> BoolArray:
    x_m, y_m, heading_rad, plays, visibility_m, sight_m, sight_cosine, shoulder_glance, length_m, width_m = players
    seen = np.zeros(hidden.shape, dtype=np.bool_)
    for g, p in np.ndindex(x_m.shape):
        reach_m = min(visibility_m[g], SEEN_M)
        sight = (min(sight_m[g, p], reach_m), reach_m, sight_cosine[g, p], shoulder_glance[g, p])
        eyes: Eyes = (np.cos(heading_rad[g, p]), np.sin(heading_rad[g, p]), *sight, length_m[p], width_m[p])
        for b in range(hidden.shape[2]):
            is_there = plays[g, p] and present[g, b] and b != p and not hidden[g, p, b]
            dx, dy = perceived[0, g, p, b] - x_m[g, p], perceived[1, g, p, b] - y_m[g, p]
            seen[g, p, b] = is_there and in_view(eyes, dx, dy, b < moving)
    return seen
