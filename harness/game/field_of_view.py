"""The field of view: which bodies a player sees, by their distance, its eyes and its mirrors.

Lines of sight are those of `harness.game.sight`.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np

from harness.game.arrays import BoolArray
from harness.game.human_factors import BLIND_BEHIND_M, BLIND_BESIDE_M
from harness.game.jit import compiled, inlined
from harness.game.meetings import Meetings
from harness.game.memory import Perceived, as_they_are
from harness.game.quantities import Quantities
from harness.game.state import Bodies

SEEN_M = 120.0
"""Bodies farther away are seen by nobody."""

Eyes: TypeAlias = tuple[float, float, float, float, float, bool, float, float]
"""Of a player: cosine and sine of its heading, the distances at which it sees road users and bodies that never move,
the cosine of half its field of view, whether it looks over its shoulder, its length and its width."""


class Seen(NamedTuple):
    """The bodies as the players take them to be. Bodies after those of the game are ghosts."""

    bodies: Bodies
    motion: Perceived
    hidden: BoolArray
    """[G, P, B]"""
    meetings: Meetings


def as_it_is(q: Quantities) -> Seen:
    """The bodies as they are."""
    return Seen(q.bodies, as_they_are(q.bodies, q.state.present.shape[1]), q.hidden, q.meetings)


@inlined
def in_view(eyes: Eyes, dx: float, dy: float, moves: bool) -> bool:
    """Whether a player sees a centre at this place from its own centre. Nobody fails to see a body that never moves."""
    cosine, sine, sight_m, reach_m, sight_cosine, glances, length_m, width_m = eyes
    ahead_m, distance_m = dx * cosine + dy * sine, np.hypot(dx, dy)
    near = distance_m <= (sight_m if moves else reach_m)
    if ahead_m < sight_cosine * distance_m and not glances:
        beside_m = abs(dy * cosine - dx * sine) - 0.5 * width_m
        return near and _in_mirrors(ahead_m, beside_m, -ahead_m - 0.5 * length_m)
    return near


@compiled
def _in_mirrors(ahead_m: float, beside_m: float, behind_m: float) -> bool:
    """Whether mirrors show a centre that is ahead of the own centre, beside the own flank and behind the own rear."""
    if ahead_m > 0.0:
        return False
    return behind_m > BLIND_BEHIND_M or beside_m > BLIND_BESIDE_M or beside_m < 0.0


def seen_bodies(q: Quantities, seen: Seen) -> BoolArray:
    """[G, P, B] the bodies that players see, all of them: an observation has the most urgent ones."""
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
