"""How a game starts, and all the chance in it: drawn before its first step, from seeds hashed from named parts.

Since nothing is drawn later, two games with the same parts have the same start, lapses and decision noise, whoever
drives in them: arms pair by construction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.game.arrays import BoolArray, FloatArray
from harness.game.attention import Habits, Lapses, draw_lapses, draw_overlooked_m
from harness.game.seeding import generator_of, seed_of


@dataclass(frozen=True)
class Place:
    """Where a player may start: ranges along a lane's centre line [n, 2], of its front bumper and of its speed."""

    line: FloatArray
    position_m: tuple[float, float]
    beside_ego: bool  # the position is relative to the ego's
    speed_mps: tuple[float, float]
    scale: float = 1.0  # metres of the line per metre of the lane, which SUMO may count otherwise

    def pose(self, position_m: float, length_m: float) -> tuple[float, float, float]:
        """x_m, y_m of the body's centre and heading_rad with the front bumper at that position of the lane."""
        position_m = position_m * self.scale
        along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(self.line, axis=0).T))))
        segment = int(np.clip(np.searchsorted(along, position_m, side="right") - 1, 0, len(along) - 2))
        start, end = self.line[segment], self.line[segment + 1]
        unit = (end - start) / np.hypot(*(end - start))
        x, y = start + unit * (position_m - along[segment] - 0.5 * length_m)
        return float(x), float(y), float(np.arctan2(unit[1], unit[0]))


@dataclass(frozen=True)
class Start:
    """One game's start. Arrays are [P], or [P, T, ...] over its T steps."""

    x_m: FloatArray
    y_m: FloatArray
    heading_rad: FloatArray
    speed_mps: FloatArray
    position_m: FloatArray  # front bumper, along the start lane
    present: BoolArray
    noise: FloatArray  # [P, T, 2] standard normal, for drivers whose decisions vary
    lapses: tuple[Lapses, ...]
    overlooked_m: FloatArray  # how far ahead of a player others must be to be seen by it
    seed: int  # of the traffic SUMO drives


@dataclass(frozen=True)
class Chances:
    """What is drawn for a game: places [P], lengths [P], habits [P], the chance that each player takes part [P]."""

    places: Sequence[Place]
    length_m: FloatArray
    habits: Sequence[Habits]
    present_share: Sequence[float]
    steps: int
    step_s: float


def draw_start(chances: Chances, *parts: str | int) -> Start:
    """Draw one game from named parts."""
    where = generator_of(*parts, "start")
    positions: list[float] = []
    speeds, poses = [], []
    for place, length in zip(chances.places, chances.length_m, strict=True):
        position = where.uniform(*place.position_m) + (positions[0] if place.beside_ego else 0.0)
        positions.append(position)
        speeds.append(where.uniform(*place.speed_mps))
        poses.append(place.pose(position, float(length)))
    company = generator_of(*parts, "company")
    present = np.array([company.random() < share for share in chances.present_share])
    players = range(len(chances.places))
    x, y, heading = np.array(poses).T
    return Start(
        x,
        y,
        heading,
        np.array(speeds),
        np.array(positions),
        present,
        np.stack([generator_of(*parts, "decisions", p).standard_normal((chances.steps, 2)) for p in players]),
        tuple(
            draw_lapses(
                chances.habits[p].attention, chances.steps, chances.step_s, generator_of(*parts, "attention", p)
            )
            for p in players
        ),
        np.array(
            [draw_overlooked_m(chances.habits[p].overlooking, generator_of(*parts, "mirrors", p)) for p in players]
        ),
        seed_of(*parts, "traffic") % 2**31,
    )
