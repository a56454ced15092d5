"""The field of view: which bodies a player sees, by their distance, its eyes and its mirrors.

Lines of sight are those of `harness.game.sight`.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np

from harness.game.arrays import BoolArray
from harness.game.human_factors import BLIND_BEHIND_M, BLIND_BESIDE_M
from harness.game.jit import compiled, inlined
from harness.game.meetings import Meetings
from harness.game.memory import Perceived
from harness.game.state import Bodies

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
