"""Falsification: a search of starts, and of ordinary drivers, with which an ego fails. It is no person and no policy.

A point of the unit cube has a share, from 0 to 1, of the scene's range for each player's position, then for each
player's speed. If SUMO drives a person, the parameters of its driver follow (`game.ordinary_driver`). Everything else
of a game is drawn as in an assessment: lapses, decisions, weather, background traffic.

A search is a generator of points, which is sent the loss of each. The loss is the ego's least time to collision, and 0
where the ego fails. These are the usual searchers of falsification, without a model of the ego (A. Corso et al., "A
Survey of Algorithms for Black-Box Safety Validation of Cyber-Physical Systems", JAIR 72, 2021).
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping
from dataclasses import replace
from enum import Enum
from typing import Any

import cmaes
import numpy as np

from harness.assessment.rollout import Game, assess
from harness.assessment.seated_arm import SeatedArm
from harness.assessment.start_trials import start_at
from harness.errors import StageFailed
from harness.game.arrays import FloatArray
from harness.game.follower import RANGES, ordinary_driver_at
from harness.game.initial_state import InitialState
from harness.game.seeding import generator_of, seed_of
from harness.game.start_range import starts_in

NOT_CLOSE_S = 10.0
"""The loss of a game without a time to collision, and the greatest."""
FIRST_EPISODE = 1_000_000
"""Episodes of a search have numbers from here on: their random numbers are those of no assessed game."""

_POPULATION, _ELITE, _KEPT = 20, 4, 0.3
"""Of the cross-entropy method: points of a generation, those that the next one is fitted to, and the share of the old
distribution that is kept (Rubinstein and Kroese, "The Cross-Entropy Method", 2004, smoothing)."""
_LEAST_DEVIATION = 0.02
_FIRST_DEVIATION = 0.3  # of both methods: about that of a uniform distribution


class Searcher(str, Enum):
    """How the points of a search are chosen."""

    RANDOM = "random"
    CROSS_ENTROPY = "cross-entropy"
    CMA_ES = "cma-es"


def points(searcher: Searcher, dimensions: int, *parts: str | int) -> Generator[FloatArray, float, None]:
    """Points [dimensions] of the unit cube without end; each is sent its loss. `parts` name the random numbers."""
    match searcher:
        case Searcher.RANDOM:
            return _random(dimensions, generator_of(*parts))
        case Searcher.CROSS_ENTROPY:
            return _cross_entropy(dimensions, generator_of(*parts))
        case Searcher.CMA_ES:
            return _cma_es(dimensions, *parts)


def _random(dimensions: int, generator: np.random.Generator) -> Generator[FloatArray, float, None]:
    while True:
        yield generator.random(dimensions)


def _cross_entropy(dimensions: int, generator: np.random.Generator) -> Generator[FloatArray, float, None]:
    mean, deviation = np.full(dimensions, 0.5), np.full(dimensions, _FIRST_DEVIATION)
    while True:
        played = []
        for _ in range(_POPULATION):
            point = np.clip(generator.normal(mean, deviation), 0.0, 1.0)
            played.append(((yield point), point))
        elite = np.array([point for _, point in sorted(played, key=lambda each: each[0])[:_ELITE]])
        mean = _KEPT * mean + (1.0 - _KEPT) * elite.mean(axis=0)
        deviation = np.maximum(_KEPT * deviation + (1.0 - _KEPT) * elite.std(axis=0), _LEAST_DEVIATION)


def _cma_es(dimensions: int, *parts: str | int) -> Generator[FloatArray, float, None]:
    """From the middle of the cube, and after each convergence from a random point."""
    bounds, restart = np.tile([0.0, 1.0], (dimensions, 1)), 0
    mean: FloatArray = np.full(dimensions, 0.5)
    while True:
        seed = seed_of(*parts, restart) % 2**31
        optimiser = cmaes.CMA(mean=mean, sigma=_FIRST_DEVIATION, bounds=bounds, seed=seed)
        while not optimiser.should_stop():
            played = []
            for _ in range(optimiser.population_size):
                point = optimiser.ask()
                played.append((point, (yield point)))
            optimiser.tell(played)
        restart += 1
        mean = generator_of(*parts, "restart", restart).random(dimensions)


def falsify(arm: SeatedArm, searcher: Searcher, *, games: int, repeat: int) -> Iterator[Game]:
    """Play the games of one search of an arm. Repeats have different random numbers.

    Raises SimulationError if SUMO can't load the scene, StageFailed where a game can't be played.
    """
    players = len(arm.drivers)
    by_sumo = any(each is not None and not each.takes_over for each in arm.drivers[1:])
    dimensions = 2 * players + (len(RANGES) if by_sumo else 0)
    search = points(searcher, dimensions, arm.seed, "falsification", searcher.value, repeat)
    point = next(search)

    def start_from(drawn: InitialState) -> InitialState:
        shares = point[: 2 * players].reshape(2, players).T
        start = start_at(arm.scene, drawn, *starts_in(arm.scene.places, shares))
        return replace(start, ordinary_driver=ordinary_driver_at(point[2 * players :])) if by_sumo else start

    first = FIRST_EPISODE + repeat * games
    for game in assess(arm, range(first, first + games), start_from=start_from):
        if game.played["error"]:
            raise StageFailed(f"{arm.name}, game {game.played['episode']}: {game.played['error']}")
        yield game
        point = search.send(loss_of(game.record))


def loss_of(record: Mapping[str, Any]) -> float:
    """The loss of a game, from the cells of its row of episodes.csv."""
    if record.get("ego_failed"):
        return 0.0
    time_s = record.get("ego_min_ttc_s")
    return NOT_CLOSE_S if time_s is None else min(float(time_s), NOT_CLOSE_S)
