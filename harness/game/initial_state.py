"""How a game starts, and all the chance in it: drawn before its first step, from seeds hashed from named parts.

Since nothing is drawn later, two games with the same parts have the same start, lapses and decision noise, whoever
drives in them: arms pair by construction.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import atan2, hypot

import numpy as np

from harness.game.arrays import BoolArray, FloatArray
from harness.game.attention import Attention, HumanFactors, Lapses, draw_lapses, unseen_behind_m
from harness.game.human_limits import (
    ALL,
    AT_ONCE,
    EXACT,
    NO_LIMITS,
    NOBODY,
    Limits,
    draw_delay_steps,
    draw_misjudged,
    draw_noticed_m,
)
from harness.game.seeding import between, generator_of, seed_of

_UNLIMITED = (NOBODY, AT_ONCE, EXACT, ALL)  # the defaults themselves: compared at once


@dataclass(frozen=True)
class StartRange:
    """Where a player may start: ranges along a lane's centre line [n, 2], of its front bumper and of its speed."""

    line: FloatArray
    position_m: tuple[float, float]
    beside_ego: bool  # the position is relative to the ego's
    speed_mps: tuple[float, float]
    scale: float = 1.0  # metres of the line per metre of the lane, which SUMO may count otherwise

    def pose(self, position_m: float, length_m: float) -> tuple[float, float, float]:
        """x_m, y_m of the body's centre and heading_rad with the front bumper at that position of the lane."""
        points, along = self._points
        position_m *= self.scale
        segment = min(max(bisect_right(along, position_m) - 1, 0), len(along) - 2)
        (x, y), (end_x, end_y) = points[segment : segment + 2]
        length = hypot(end_x - x, end_y - y)
        onward = (position_m - along[segment] - 0.5 * length_m) / length
        return x + onward * (end_x - x), y + onward * (end_y - y), atan2(end_y - y, end_x - x)

    @cached_property
    def _points(self) -> tuple[list[list[float]], list[float]]:
        """The points of the line, and how far along it each is."""
        lengths = np.hypot(*np.diff(self.line, axis=0).T)
        return self.line.tolist(), [0.0, *np.cumsum(lengths).tolist()]


class Noise:
    """Standard normal numbers, the last that a game's chance has, drawn when they are first asked for."""

    def __init__(self, chance: np.random.Generator, shape: tuple[int, ...]) -> None:
        self._chance, self._shape = chance, shape

    @cached_property
    def drawn(self) -> FloatArray:
        """The numbers, of that shape."""
        return self._chance.standard_normal(self._shape)


@dataclass(frozen=True)
class InitialState:
    """One game's start. Arrays are [P], or [P, T, ...] over its T steps."""

    x_m: FloatArray
    y_m: FloatArray
    heading_rad: FloatArray
    speed_mps: FloatArray
    position_m: FloatArray  # front bumper, along the start lane
    present: BoolArray
    variation: Noise
    lapses: tuple[Lapses, ...]
    unseen_behind_m: FloatArray  # how far ahead of a player others must be to be seen by it
    limits: tuple[Limits, ...]
    member: tuple[int, ...]  # who of a player's drivers drives in this game
    parts: tuple[str | int, ...]  # what names all this chance

    @property
    def noise(self) -> FloatArray:
        """[P, T, 2] standard normal, for drivers whose decisions vary."""
        return self.variation.drawn

    @property
    def seed(self) -> int:
        """Of the traffic that SUMO drives."""
        return seed_of(*self.parts, "traffic") % 2**31


@dataclass(frozen=True)
class StartDistribution:
    """What is drawn for a game: places [P], lengths [P], the chance that each player takes part [P]; and of each
    player's drivers one, by their shares, with its human factors."""

    places: Sequence[StartRange]
    length_m: FloatArray
    human_factors: Sequence[Sequence[HumanFactors]]
    shares: Sequence[Sequence[float]]
    present_share: Sequence[float]
    steps: int
    step_s: float


def draw_initial_state(start_distribution: StartDistribution, *parts: str | int) -> InitialState:
    """Draw one game from named parts."""
    chance = generator_of(*parts, "start")
    players = range(len(start_distribution.places))
    luck = iter(chance.random(4 * len(players)).tolist())  # one by one they would be the same
    poses: list[tuple[float, ...]] = []
    for place, length in zip(start_distribution.places, start_distribution.length_m.tolist(), strict=True):
        position = between(place.position_m, next(luck)) + (poses[0][-1] if place.beside_ego else 0.0)
        speed = between(place.speed_mps, next(luck))
        poses.append((*place.pose(position, length), speed, position))
    present = [next(luck) < share for share in start_distribution.present_share]
    member = [
        0 if len(of) == 1 else draw_member(of, player, *parts) for player, of in enumerate(start_distribution.shares)
    ]
    human_factors = [start_distribution.human_factors[player][member[player]] for player in players]
    overlooked = [unseen_behind_m(each.no_blind_spot_check, next(luck)) for each in human_factors]
    limits = [
        NO_LIMITS
        if (of.looked_but_failed_to_see, of.reaction, of.sight, of.uses) == _UNLIMITED
        else _limits(of, start_distribution, p, *parts)
        for p, of in enumerate(human_factors)
    ]
    x, y, heading, speeds, positions = np.array(poses).T
    return InitialState(
        x,
        y,
        heading,
        speeds,
        positions,
        np.array(present),
        Noise(chance, (len(players), start_distribution.steps, 2)),
        tuple(
            _lapses(human_factors[p].attention, start_distribution, p, limits[p].delay_steps, *parts) for p in players
        ),
        np.array(overlooked),
        tuple(limits),
        tuple(member),
        parts,
    )


def draw_member(shares: Sequence[float], player: int, *parts: str | int) -> int:
    """Which of a player's drivers a game has: one draw, from a generator of its own, so that nothing else moves."""
    upper = np.cumsum(shares)
    return int(np.searchsorted(upper, generator_of(*parts, "member", player).random() * upper[-1], side="right"))


def _lapses(
    attention: Attention | None, start_distribution: StartDistribution, player: int, delay_steps: int, *parts: str | int
) -> Lapses:
    if attention is None:
        return Lapses.none(start_distribution.steps)
    lapses = draw_lapses(
        attention, start_distribution.steps, start_distribution.step_s, generator_of(*parts, "attention", player)
    )
    return lapses.until_hands_obey(delay_steps) if delay_steps else lapses


def _limits(
    human_factors: HumanFactors, start_distribution: StartDistribution, player: int, *parts: str | int
) -> Limits:
    """Each limit from a generator of its own, which nobody needs who does not have it."""

    def chance(of: str) -> np.random.Generator:
        return generator_of(*parts, of, player)

    sight, step_s = human_factors.sight, start_distribution.step_s
    delay_steps = (
        draw_delay_steps(human_factors.reaction, step_s, chance("reaction"))
        if any(human_factors.reaction.delay_s)
        else 0
    )
    noticed_m = (
        draw_noticed_m(human_factors.looked_but_failed_to_see, chance("missing"))
        if human_factors.looked_but_failed_to_see.share
        else np.inf
    )
    exact = sight.distance_error == sight.closing_error_per_s == 0.0
    misjudged = None if exact else draw_misjudged(sight, start_distribution.steps, step_s, chance("sight"))
    uses = (human_factors.uses.throttle, human_factors.uses.braking, human_factors.uses.steering)
    return Limits(delay_steps, min(sight.range_m, noticed_m), misjudged, uses)
