"""The same seeded games for one ego after the other, many at once: what a search compares drivers by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np

from harness.config.persona import Persona
from harness.drivers.mixture import Mixture, mixture_of
from harness.drivers.protocol import Driver
from harness.environments.arena import Arena, Seat
from harness.game.arrays import FloatArray, IntArray
from harness.game.initial_state import draw_initial_state
from harness.game.seeding import generator_of, seed_of
from harness.game.state import EGO, NON_EGO, Outcome
from harness.traffic.scene import OpenScene


@dataclass(frozen=True)
class RolloutTotals:
    """What came of a driver's games: payoff [N] of each, and whether the ego failed [N]."""

    payoff: FloatArray
    failed: FloatArray


class PairedRollouts:
    """N seeded games, as many at once as are asked for. Game k is the same for every ego that plays it."""

    def __init__(
        self,
        scene: OpenScene,
        personas: tuple[Persona, Persona],
        opponent: Driver | Mixture,
        games: int,
        at_once: int,
        alone_share: float,
        parts: Sequence[str | int],
    ) -> None:
        """Load SUMO. `alone_share` of the games are without the opponent; `parts` name their random numbers.

        Raises SimulationError if SUMO can't load the scene.
        """
        self._scene, self._games, self._parts = scene, games, tuple(parts)
        self._loads = ceil(games / at_once)
        self._tiles = ceil(games / self._loads)
        self._ego = _InTurn()
        other, ego = mixture_of(opponent, personas[NON_EGO]), personas[EGO]
        human_factors, shares = [[ego.human_factors], other.human_factors], [[1.0], other.shares]
        self._start_distribution = scene.start_distribution(human_factors, [1.0, 1.0 - alone_share], shares)
        seats = [[Seat(self._ego, ego.payoff)], [Seat(member.driver) for member in other.members]]
        self._arena = Arena(scene, self._tiles, seats)

    def play(self, driver: Driver) -> RolloutTotals:
        """Play all games with this ego, each until the ego's part in it ends.

        Raises whatever the driver does, and as `Arena.step` does. The games after that are played as if it hadn't.
        """
        self._ego.driver = driver
        played = [self._play(load) for load in range(self._loads)]  # what fills the last load up does not count
        payoff, failed = (np.concatenate(each)[: self._games] for each in zip(*played, strict=True))
        return RolloutTotals(payoff, failed)

    def close(self) -> None:
        """Give SUMO back."""
        self._arena.close()

    def _play(self, load: int) -> tuple[FloatArray, FloatArray]:
        arena, scene = self._arena, self._scene
        arena.reload(seed_of(*self._parts, "load", load) % 2**31)
        parts = {tile: (*self._parts, "game", load * self._tiles + tile) for tile in range(self._tiles)}
        starts = {tile: draw_initial_state(self._start_distribution, *each) for tile, each in parts.items()}
        departures = {tile: scene.departures(generator_of(*each, "others")) for tile, each in parts.items()}
        arena.reset(starts, departures if scene.has_background_traffic else {})
        payoff = np.zeros(self._tiles)
        while arena.state.running[:, EGO].any():
            payoff += arena.step().payoff[:, EGO]
        return payoff, arena.state.outcome[:, EGO] != Outcome.GOAL


class _InTurn:
    """The ego's seat: whoever's turn it is drives."""

    takes_over = True

    def __init__(self) -> None:
        self.driver: Driver | None = None

    def reset(self, games: IntArray) -> None:
        """Games [N] start anew."""
        assert self.driver is not None, "games are played by a driver"
        self.driver.reset(games)

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """As the driver whose turn it is."""
        assert self.driver is not None, "games are played by a driver"
        return self.driver.decide(games, observation, noise)
