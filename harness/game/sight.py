"""Lines of sight: which bodies are hidden behind others.

A player sees a body if at least one of five straight lines is free: from the centre of the player's body, where a
car's driver sits, to the centre of the other body and to its four corners. A line is cut by what is higher than eyes:

- a vehicle at least `TALL_WIDTH_M` wide, as SUMO's vans, lorries and buses are, and its cars are not;
- an obstacle that hides;
- a wall: the outline of a building.

Neither the player's own body nor the body that is looked at cuts a line. Sight is flat: a bridge hides nothing, and a
bus behind a van is hidden.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from math import cos, hypot, inf, sin
from typing import Any

import numpy as np

from harness.game.arrays import BoolArray, FloatArray
from harness.game.geometry import Box, in_frame, other_box
from harness.game.jit import compiled
from harness.game.state import Bodies

TALL_WIDTH_M = 2.1
"""A vehicle of at least this width hides what is behind it: SUMO's narrowest class of tall vehicles, `delivery`, is
2.16 m wide and 2.86 m high."""
SEEN_M = 120.0
"""Bodies farther away are seen by nobody, and their lines are not computed."""


@dataclass(frozen=True, kw_only=True)
class Hiding:
    """What hides road users in a scene."""

    # [O] whether each obstacle does; obstacles are the last O bodies of a game
    obstacles: BoolArray = field(default_factory=lambda: np.zeros(0, dtype=bool))
    walls: FloatArray = field(default_factory=lambda: np.zeros((0, 2, 2)))  # [S, 2, 2] their start and end
    vehicles: bool = False  # whether a vehicle of the scene is tall

    @cached_property
    def anything(self) -> bool:
        """Whether anything hides. If not, no line of sight is computed."""
        return self.vehicles or bool(len(self.walls)) or bool(self.obstacles.any())


NOTHING_HIDES = Hiding()


@compiled
def hidden(
    players: tuple[FloatArray, FloatArray, BoolArray],
    bodies: tuple[Any, ...],
    standing: tuple[BoolArray, FloatArray],
    vehicles: bool,
) -> BoolArray:
    """[G, P, B] bodies that players do not see because their lines of sight are cut.

    Players are given by their centres and whether they are present [G, P]. `standing` are the obstacles [O] and walls
    [S, 2, 2] of `Hiding`, and `vehicles` is its.
    """
    (x_m, y_m, present), those, (obstacles, walls) = players, Bodies(*bodies), standing
    games, count = those.present.shape
    boxes = Box(those.x_m, those.y_m, those.heading_rad, those.length_m, those.width_m)
    result = np.zeros((games, present.shape[1], count), dtype=np.bool_)
    hides = np.empty(count, dtype=np.bool_)
    first_obstacle = count - len(obstacles)
    for g in range(games):
        for b in range(count):
            if b < first_obstacle:
                hides[b] = those.present[g, b] and vehicles and those.width_m[g, b] >= TALL_WIDTH_M
            else:
                hides[b] = those.present[g, b] and obstacles[b - first_obstacle]
        for p in range(present.shape[1]):
            for b in range(count):
                if present[g, p] and those.present[g, b] and b != p:
                    eye = (x_m[g, p], y_m[g, p])
                    result[g, p, b] = _is_hidden(eye, (g, p, b), boxes, (hides, walls))
    return result


@compiled
def _is_hidden(
    eye: tuple[float, float], who: tuple[int, int, int], bodies: Box, barriers: tuple[BoolArray, FloatArray]
) -> bool:
    """Whether all lines from an eye of a player to a body are cut, given the indices of game, player and body, which
    bodies hide others [B], and the walls."""
    (eye_x_m, eye_y_m), (g, p, b), (hides, walls) = eye, who, barriers
    body = other_box(bodies, g, b)
    if hypot(body.x_m - eye_x_m, body.y_m - eye_y_m) > SEEN_M:
        return False
    along_x, along_y = 0.5 * body.length_m * cos(body.heading_rad), 0.5 * body.length_m * sin(body.heading_rad)
    across_x, across_y = -0.5 * body.width_m * sin(body.heading_rad), 0.5 * body.width_m * cos(body.heading_rad)
    for along, across in ((0.0, 0.0), (1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)):
        to = (body.x_m + along * along_x + across * across_x, body.y_m + along * along_y + across * across_y)
        free = True
        for other in range(len(hides)):
            may_cut = hides[other] and other != b and other != p
            if may_cut and box_cuts(other_box(bodies, g, other), eye, to):
                free = False
                break
        if free and not _is_walled_off(eye, to, walls):
            return False
    return True


@compiled
def box_cuts(box: Box, start_m: tuple[float, float], end_m: tuple[float, float]) -> bool:
    """Whether a straight line passes through the inside of a box; a line along its edge does not."""
    u, v = in_frame(box, start_m[0], start_m[1])
    to_u, to_v = in_frame(box, end_m[0], end_m[1])
    enters, leaves = 0.0, 1.0
    for start, way, half in ((u, to_u - u, 0.5 * box.length_m), (v, to_v - v, 0.5 * box.width_m)):
        first, last = -inf, inf
        if abs(way) > 1e-9:
            one, other = (-half - start) / way, (half - start) / way
            first, last = min(one, other), max(one, other)
        elif abs(start) >= half:
            return False
        enters, leaves = max(enters, first), min(leaves, last)
    return leaves - enters > 1e-9


@compiled
def _is_walled_off(start_m: tuple[float, float], end_m: tuple[float, float], walls: FloatArray) -> bool:
    from_x_m, from_y_m = start_m
    way_x, way_y = end_m[0] - from_x_m, end_m[1] - from_y_m
    for s in range(len(walls)):
        wall_x, wall_y = walls[s, 1, 0] - walls[s, 0, 0], walls[s, 1, 1] - walls[s, 0, 1]
        start_x, start_y = walls[s, 0, 0] - from_x_m, walls[s, 0, 1] - from_y_m
        turn = way_x * wall_y - way_y * wall_x
        if abs(turn) > 1e-12:
            on_way = (start_x * wall_y - start_y * wall_x) / turn
            on_wall = (start_x * way_y - start_y * way_x) / turn
            if 0.0 <= on_way <= 1.0 and 0.0 <= on_wall <= 1.0:
                return True
    return False
