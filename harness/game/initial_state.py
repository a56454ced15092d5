"""The initial state of a game. All randomness of a game is drawn here, before its first step.

Every draw has a seed hashed from named parts. Two games with the same parts have the same start, lapses and decision
noise, independent of their drivers. Arms are therefore paired.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from harness.game.arrays import BoolArray, FloatArray
from harness.game.follower import Follower, OrdinaryDriver, draw_follower
from harness.game.human_factors import (
    FULL_USE,
    NO_LIMITS,
    HumanFactors,
    Limits,
    Sight,
    autocorrelated,
    draw_estimation_errors,
    glances_over_shoulder,
)
from harness.game.lapses import Lapses, draw_lapses
from harness.game.placed_obstacles import NO_OBSTACLES, Obstacles
from harness.game.roles import EGO
from harness.game.seeding import between, drawn_index, generator_of, parts_of, seed_of
from harness.game.start_range import StartRange, draw_along_route, poses_of, starts_in
from harness.game.world import World

_UNLIMITED = ((0.0, 0.0), Sight(), FULL_USE)


HAND_PERSISTENCE_S = 0.5
"""Correlation time of random decisions: a hand does not jump from step to step. Chosen here."""


class LazyNoise:
    """Standard normal numbers [P, T, 2], drawn on first use, correlated in time. They are the last draws of their
    generator."""

    def __init__(self, generator: np.random.Generator, shape: tuple[int, int, int], step_s: float) -> None:
        self._generator, self._shape, self._step_s = generator, shape, step_s

    @cached_property
    def values(self) -> FloatArray:
        """The numbers, in the shape given."""
        noise = self._generator.standard_normal(self._shape)
        correlation = float(np.exp(-self._step_s / HAND_PERSISTENCE_S))
        return np.stack([autocorrelated(of_player, correlation) for of_player in noise])


@dataclass(frozen=True, kw_only=True)
class InitialState:
    """The initial state of one game. Arrays are [P], or [P, T, ...] over its T steps."""

    x_m: FloatArray
    y_m: FloatArray
    heading_rad: FloatArray
    speed_mps: FloatArray
    position_m: FloatArray  # of the front bumper, along the start lane; NaN if the start is not in the scene's range
    station_m: FloatArray  # along the route, about
    present: BoolArray
    lazy_noise: LazyNoise
    lapses: tuple[Lapses, ...]
    shoulder_glance: BoolArray  # whether a player glances over the shoulder
    limits: tuple[Limits, ...]
    member: tuple[int, ...]  # index of the driver that each player has in this game
    friction: float
    visibility_m: float
    limit_share: float
    signal_place: float  # in the cycles of traffic lights at which the game starts, from 0 to 1
    follower: Follower | None  # who follows the ego; None: nobody does
    parts: tuple[str | int, ...]  # parts of the seeds
    ordinary_driver: OrdinaryDriver | None = None  # of people that SUMO drives; None: as their vehicle types say

    @property
    def noise(self) -> FloatArray:
        """[P, T, 2] standard normal numbers, for drivers with random decisions."""
        return self.lazy_noise.values

    @property
    def seed(self) -> int:
        """The seed of the background traffic."""
        return seed_of(*self.parts, "traffic") % 2**31


@dataclass(frozen=True, kw_only=True)
class StartDistribution:
    """The distribution of initial states in a world: start ranges and probabilities of taking part, each [P].

    Players that do not take part in every game take part in the same games, as far as their probabilities are equal.
    A player may have several drivers. Each game draws one of them by the `shares`, with its human factors.
    In `along_route_share` of the games of a player alone, it starts anywhere along its route instead, up to its goal.
    In `followed_share` of the games, somebody follows the ego.
    """

    world: World
    places: Sequence[StartRange]
    human_factors: Sequence[Sequence[HumanFactors]]
    shares: Sequence[Sequence[float]]
    present_share: Sequence[float]
    friction: tuple[float, float]
    visibility_m: tuple[float, float] = (np.inf, np.inf)
    limit_share: tuple[float, float] = (1.0, 1.0)
    signal_place: tuple[float, float] = (0.0, 1.0)
    along_route_share: float = 0.0
    followed_share: float = 0.0
    obstacles: Obstacles = NO_OBSTACLES


def of_people(human_factors: Sequence[Sequence[HumanFactors]]) -> list[list[HumanFactors]]:
    """The human factors of the players' drivers [P][n]; the ego is a machine and has none."""
    of_all = [list(each) for each in human_factors]
    of_all[EGO] = [HumanFactors()] * len(of_all[EGO])
    return of_all


def draw_initial_state(starts: StartDistribution, *parts: str | int) -> InitialState:
    """Draw the initial state of one game, with seeds hashed from the named parts."""
    generator, world = generator_of(*parts, "start"), starts.world
    players = range(len(starts.places))
    drawn = generator.random(4 * len(players))  # the same numbers as drawn one by one
    draws = iter(drawn[2 * len(players) :].tolist())
    positions_m, speeds_mps = starts_in(starts.places, drawn[: 2 * len(players)].reshape(-1, 2))
    present = _present(draws, starts.present_share)
    member = [
        0 if len(shares) == 1 else draw_member(shares, player, *parts) for player, shares in enumerate(starts.shares)
    ]
    human_factors = [starts.human_factors[player][member[player]] for player in players]
    shoulder_glance = [glances_over_shoulder(each.sight, next(draws)) for each in human_factors]
    limits = [_limits(each, starts, player, *parts) for player, each in enumerate(human_factors)]
    lapses = [Lapses.none(world.steps)] * len(players)
    for player, each in enumerate(human_factors):
        if each.attention is not None:
            of_player = generator_of(*parts, "attention", player)
            lapses[player] = draw_lapses(each.attention, world.steps, world.step_s, of_player)
    x, y, heading = poses_of(starts.places, positions_m, world.length_m)
    positions, speeds = np.array(positions_m), np.array(speeds_mps)
    stations = positions - 0.5 * world.length_m
    if starts.along_route_share and sum(present) == 1:
        along = draw_along_route(
            world.road.routes,
            generator_of(*parts, "along route"),
            length_m=world.length_m,
            max_speed_mps=world.actuators.max_speed_mps,
            present=np.array(present),
            share=starts.along_route_share,
            obstacles=starts.obstacles.boxes(*parts),
        )
        if along is not None:
            x, y, heading, speeds, stations = along
            positions = np.full_like(positions, np.nan)
    return InitialState(
        x_m=x,
        y_m=y,
        heading_rad=heading,
        speed_mps=speeds,
        position_m=positions,
        station_m=stations,
        present=np.array(present),
        lazy_noise=LazyNoise(generator, (len(players), world.steps, 2), world.step_s),
        lapses=tuple(lapses),
        shoulder_glance=np.array(shoulder_glance),
        limits=tuple(limits),
        member=tuple(member),
        friction=_varied(starts.friction, "friction", *parts),
        visibility_m=_varied(starts.visibility_m, "visibility", *parts),
        limit_share=_varied(starts.limit_share, "speed limit", *parts),
        signal_place=between(starts.signal_place, generator_of(*parts, "signals").random()),
        follower=draw_follower(starts.followed_share, *parts) if present[EGO] else None,
        parts=parts,
    )


def _present(draws: Iterator[float], shares: Sequence[float]) -> list[bool]:
    """Which players take part, by a draw each: those with shares below 1 are absent together, by the first one's."""
    present: list[bool] = []
    deciding = None
    for share in shares:
        draw = next(draws)
        if share < 1.0 and deciding is None:
            deciding = draw
        present.append(deciding is None or deciding < share or share >= 1.0)
    return present


def _varied(bounds: tuple[float, float], name: str, *parts: str | int) -> float:
    """A condition of one game, drawn from a generator of its own; without a range, nothing is drawn."""
    return bounds[0] if bounds[0] == bounds[1] else between(bounds, generator_of(*parts, name).random())


def draw_member(shares: Sequence[float], player: int, *parts: str | int) -> int:
    """Draw the index of a player's driver by their shares, from a separate generator: other draws do not change."""
    return drawn_index(shares, generator_of(*parts, "member", player))


def member_in_episode(shares: Sequence[float], player: int, seed: int, episode: int) -> int:
    """The index of a player's driver in an episode of an assessment with this seed of the starts."""
    return draw_member(shares, player, *parts_of(seed, episode))


def _limits(human_factors: HumanFactors, starts: StartDistribution, player: int, *parts: str | int) -> Limits:
    """The limits of a player. Each limit has its own generator, which is made only if the limit exists."""
    delay_s, sight, shares = human_factors.delay_s, human_factors.sight, human_factors.actuator_shares
    if (delay_s, sight, shares) == _UNLIMITED:  # common, and much faster than the rest
        return NO_LIMITS

    def generator(name: str) -> np.random.Generator:
        return generator_of(*parts, name, player)

    drawn_s = generator("reaction").uniform(*delay_s) if any(delay_s) else 0.0
    failing = sight.looked_but_failed_to_see_share
    fails_to_see = bool(failing) and generator("missing").random() < failing
    errors = None
    if sight.distance_error or sight.closing_error_per_s:
        errors = draw_estimation_errors(sight, starts.world.steps, starts.world.step_s, generator("sight"))
    return Limits(
        delay_steps=round(drawn_s / starts.world.step_s),
        sight_m=min(sight.range_m, sight.noticed_within_m) if fails_to_see else sight.range_m,
        field_of_view_rad=float(np.deg2rad(sight.field_of_view_deg)),
        estimation_errors=errors,
        actuator_shares=shares,
    )
