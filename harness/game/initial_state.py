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
from harness.game.human_factors import (
    NO_LIMITS,
    ActuatorShares,
    Attention,
    HumanFactors,
    Lapses,
    Limits,
    Reaction,
    Sight,
    draw_delay_steps,
    draw_estimation_errors,
    draw_lapses,
    draw_noticed_m,
    unseen_behind_m,
)
from harness.game.placed_obstacles import NO_OBSTACLES, Obstacles
from harness.game.road import Routes
from harness.game.seeding import between, generator_of, parts_of, seed_of
from harness.game.start_range import StartRange, draw_along_route

_UNLIMITED = (Reaction(), Sight(), ActuatorShares())


class LazyNoise:
    """Standard normal numbers, drawn on first use. They are the last draws of their generator."""

    def __init__(self, generator: np.random.Generator, shape: tuple[int, ...]) -> None:
        self._generator, self._shape = generator, shape

    @cached_property
    def values(self) -> FloatArray:
        """The numbers, in the shape given."""
        return self._generator.standard_normal(self._shape)


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
    unseen_behind_m: FloatArray  # least distance ahead of a player at which it sees road users
    limits: tuple[Limits, ...]
    member: tuple[int, ...]  # index of the driver that each player has in this game
    friction: float
    limit_share: float
    signal_place: float  # in the cycles of traffic lights at which the game starts, from 0 to 1
    parts: tuple[str | int, ...]  # parts of the seeds

    @property
    def noise(self) -> FloatArray:
        """[P, T, 2] standard normal numbers, for drivers with random decisions."""
        return self.lazy_noise.values

    @property
    def seed(self) -> int:
        """The seed of the background traffic."""
        return seed_of(*self.parts, "traffic") % 2**31


@dataclass(frozen=True, kw_only=True)
class Conditions:
    """The ranges of what differs from game to game beside the players."""

    friction: tuple[float, float]
    limit_share: tuple[float, float] = (1.0, 1.0)


@dataclass(frozen=True, kw_only=True)
class StartDistribution:
    """The distribution of initial states: start ranges, lengths, top speeds and probabilities of taking part, each [P].

    Players that do not take part in every game take part in the same games, as far as their probabilities are equal.
    A player may have several drivers. Each game draws one of them by the `shares`, with its human factors.
    In `along_route_share` of the games, the players start anywhere along their `routes` instead, up to their goals.
    With `meet_in_place` they do so only in games of a player alone.
    """

    places: Sequence[StartRange]
    length_m: FloatArray
    max_speed_mps: FloatArray
    human_factors: Sequence[Sequence[HumanFactors]]
    shares: Sequence[Sequence[float]]
    present_share: Sequence[float]
    steps: int
    step_s: float
    routes: Routes
    conditions: Conditions
    along_route_share: float = 0.0
    meet_in_place: bool = False
    obstacles: Obstacles = NO_OBSTACLES

    @cached_property
    def no_lapses(self) -> Lapses:
        """The lapses of a driver without any: the same arrays in every game, since they are only read."""
        return Lapses.none(self.steps)


def draw_initial_state(start_distribution: StartDistribution, *parts: str | int) -> InitialState:
    """Draw the initial state of one game, with seeds hashed from the named parts."""
    generator = generator_of(*parts, "start")
    players = range(len(start_distribution.places))
    draws = iter(generator.random(4 * len(players)).tolist())  # the same numbers as drawn one by one
    poses: list[tuple[float, ...]] = []
    for place, length in zip(start_distribution.places, start_distribution.length_m.tolist(), strict=True):
        share, speed = next(draws), between(place.speed_mps, next(draws))
        ego_mps, ego_m = poses[0][-2:] if poses else (speed, 0.0)
        position = place.position_m(share, speed, ego_m, ego_mps)
        poses.append((*place.pose(position, length), speed, position))
    present = _present(draws, start_distribution.present_share)
    member = [
        0 if len(shares) == 1 else draw_member(shares, player, *parts)
        for player, shares in enumerate(start_distribution.shares)
    ]
    human_factors = [start_distribution.human_factors[player][member[player]] for player in players]
    unseen = [unseen_behind_m(each.sight, next(draws)) for each in human_factors]
    limits = [_limits(each, start_distribution, player, *parts) for player, each in enumerate(human_factors)]
    lapses = [
        _lapses(human_factors[player].attention, start_distribution, player, limits[player].delay_steps, *parts)
        for player in players
    ]
    x, y, heading, speeds, positions = np.array(poses).T
    stations = positions - 0.5 * start_distribution.length_m
    if start_distribution.along_route_share and not (start_distribution.meet_in_place and sum(present) > 1):
        along = draw_along_route(
            start_distribution.routes,
            generator_of(*parts, "along route"),
            length_m=start_distribution.length_m,
            max_speed_mps=start_distribution.max_speed_mps,
            present=np.array(present),
            share=start_distribution.along_route_share,
            obstacles=start_distribution.obstacles.boxes(*parts),
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
        lazy_noise=LazyNoise(generator, (len(players), start_distribution.steps, 2)),
        lapses=tuple(lapses),
        unseen_behind_m=np.array(unseen),
        limits=tuple(limits),
        member=tuple(member),
        friction=_varied(start_distribution.conditions.friction, "friction", *parts),
        limit_share=_varied(start_distribution.conditions.limit_share, "speed limit", *parts),
        signal_place=float(generator_of(*parts, "signals").random()),
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
    upper = np.cumsum(shares)
    return int(np.searchsorted(upper, generator_of(*parts, "member", player).random() * upper[-1], side="right"))


def member_in_episode(shares: Sequence[float], player: int, seed: int, episode: int) -> int:
    """The index of a player's driver in an episode of an assessment, the same in every arm."""
    return draw_member(shares, player, *parts_of(seed, episode))


def _lapses(
    attention: Attention | None, start_distribution: StartDistribution, player: int, delay_steps: int, *parts: str | int
) -> Lapses:
    if attention is None:
        return start_distribution.no_lapses
    lapses = draw_lapses(
        attention, start_distribution.steps, start_distribution.step_s, generator_of(*parts, "attention", player)
    )
    return lapses.with_reaction_delay(delay_steps) if delay_steps else lapses


def _limits(
    human_factors: HumanFactors, start_distribution: StartDistribution, player: int, *parts: str | int
) -> Limits:
    """The limits of a player. Each limit has its own generator, which is made only if the limit exists."""
    reaction, sight, shares = human_factors.reaction, human_factors.sight, human_factors.actuator_shares
    if (reaction, sight, shares) == _UNLIMITED:  # common, and much faster than the rest
        return NO_LIMITS

    def generator(name: str) -> np.random.Generator:
        return generator_of(*parts, name, player)

    step_s = start_distribution.step_s
    delay_steps = draw_delay_steps(reaction, step_s, generator("reaction")) if any(reaction.delay_s) else 0
    noticed_m = draw_noticed_m(sight, generator("missing")) if sight.looked_but_failed_to_see_share else np.inf
    exact = sight.distance_error == sight.closing_error_per_s == 0.0
    return Limits(
        delay_steps=delay_steps,
        sight_m=min(sight.range_m, noticed_m),
        opening_rad=float(np.deg2rad(sight.opening_deg)),
        estimation_errors=(
            None if exact else draw_estimation_errors(sight, start_distribution.steps, step_s, generator("sight"))
        ),
        actuator_shares=(shares.throttle_share, shares.braking_share, shares.steering_share),
    )
