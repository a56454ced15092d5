"""Paired rollouts: the same seeded games for each ego, many at once, so that a search can compare egos."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np

from harness.config.persona import Persona
from harness.drivers.mixture import Mixture, factors_of, shares_of
from harness.drivers.protocol import Driver
from harness.environments.arena import Arena, Seat
from harness.environments.seats import seats_of
from harness.game.arrays import FloatArray, IntArray
from harness.game.initial_state import InitialState, StartDistribution, draw_initial_state
from harness.game.outcome import Outcome
from harness.game.roles import EGO
from harness.game.seeding import seed_of
from harness.road.scene.open_scene import OpenScene


@dataclass(frozen=True, kw_only=True)
class SeededStarts:
    """The starts of seeded games of an ego beside people: start k is the same whoever drives the ego."""

    persona: Persona
    """The ego's."""
    people: Sequence[Mixture | None]
    """The drivers of the non-egos."""
    distribution: StartDistribution
    parts: tuple[str | int, ...]
    """They name the random numbers."""

    def start(self, game: int) -> InitialState:
        """The start of game k."""
        return draw_initial_state(self.distribution, *self.parts, "game", game)


def seeded_starts(
    scene: OpenScene,
    persona: Persona,
    people: Sequence[Mixture | None],
    alone_share: float,
    *parts: str | int,
) -> SeededStarts:
    """The starts of an ego of this persona beside the drivers of the non-egos, in `alone_share` of the games without
    them; `parts` name the random numbers."""
    human_factors = [[persona.human_factors], *map(factors_of, people)]
    shares, present = [[1.0], *map(shares_of, people)], [1.0, *[1.0 - alone_share] * len(people)]
    distribution = scene.start_distribution(human_factors, present, shares)
    return SeededStarts(persona=persona, people=people, distribution=distribution, parts=parts)


class PairedRollouts:
    """N seeded games, up to `at_once` of them at once. Game k is the same for every ego."""

    def __init__(self, scene: OpenScene, starts: SeededStarts, *, games: int, at_once: int) -> None:
        """Load SUMO. Raises SimulationError if it can't load the scene."""
        self._scene, self._games, self._starts = scene, games, starts
        self._loads = ceil(games / at_once)
        self._tiles = ceil(games / self._loads)
        self._ego = _CurrentDriver()
        seats = [(Seat(self._ego, starts.persona.payoff),), *(seats_of(each, paid=False) for each in starts.people)]
        self._arena = Arena(scene, self._tiles, seats)

    def play(self, driver: Driver) -> tuple[FloatArray, FloatArray]:
        """The payoff [N] of this ego in all games, each played until its part in it ends, and whether it failed [N].

        Raises the exceptions of the driver and those of `Arena.step`. They have no effect on later calls.
        """
        self._ego.wrapped = driver
        played = [self._play(load) for load in range(self._loads)]  # games that only fill the last load are dropped
        payoff, failed = (np.concatenate(each)[: self._games] for each in zip(*played, strict=True))
        return payoff, failed

    def close(self) -> None:
        """Close the SUMO simulation."""
        self._arena.close()

    def _play(self, load: int) -> tuple[FloatArray, FloatArray]:
        arena, scene = self._arena, self._scene
        arena.reload(seed_of(*self._starts.parts, "load", load) % 2**31)
        starts = {tile: self._starts.start(load * self._tiles + tile) for tile in range(self._tiles)}
        arena.reset(starts, {tile: scene.departures(*start.parts) for tile, start in starts.items()})
        payoff = np.zeros(self._tiles)
        while arena.state.running[:, EGO].any():
            payoff += arena.step().payoff[:, EGO]
        return payoff, arena.state.outcome[:, EGO] != Outcome.GOAL


class _CurrentDriver:
    """The driver of the ego's seat: it calls `wrapped`, which `play` sets."""

    takes_over = True
    wrapped: Driver

    def reset(self, games: IntArray) -> None:
        """Reset games [N] of the current driver."""
        self.wrapped.reset(games)

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """The decisions of the current driver."""
        return self.wrapped.decide(games, observation, noise)
