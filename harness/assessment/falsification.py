"""Falsification: a search of starts, and of ordinary drivers, with which an ego fails. It is no person and no policy.

A point of the unit cube has a share, from 0 to 1, of the scene's range for each player's position, then for each
player's speed. If SUMO drives a person, the parameters of its driver follow (`game.ordinary_driver`). Everything else
of a game is drawn as in an assessment: lapses, decisions, weather, background traffic.

A search is a generator of generations of points, which is sent the losses of each. The games of a generation, of all
repeats of a search, are played side by side, and share SUMO's random numbers. The loss is the ego's least time to
collision, and 0 where the ego fails.
These are the usual searchers of falsification, without a model of the ego (A. Corso et al., "A Survey of Algorithms for
Black-Box Safety Validation of Cyber-Physical Systems", JAIR 72, 2021).
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import replace
from enum import Enum

import cmaes
import numpy as np

from harness.assessment.rollout import Game, assess_batches
from harness.assessment.seated_arm import SeatedArm
from harness.assessment.start_trials import start_at
from harness.errors import StageFailed
from harness.evaluation.metrics import Drive, min_ttc_s
from harness.game.arrays import FloatArray
from harness.game.follower import RANGES, ordinary_driver_at
from harness.game.initial_state import InitialState
from harness.game.outcome import Outcome
from harness.game.roles import EGO, ROLES
from harness.game.seeding import generator_of, seed_of
from harness.game.start_range import starts_in

NOT_CLOSE_S = 10.0
"""The loss of a game without a time to collision, and the greatest."""
FIRST_EPISODE = 1_000_000
"""Episodes of a search have numbers from here on: their random numbers are those of no assessed game."""

_POPULATION, _ELITE, _KEPT = 20, 4, 0.3
"""Points of a generation; of the cross-entropy method, those that the next one is fitted to, and the share of the old
distribution that is kept (Rubinstein and Kroese, "The Cross-Entropy Method", 2004, smoothing)."""
_LEAST_DEVIATION = 0.02
_FIRST_DEVIATION = 0.3  # of both methods: about that of a uniform distribution


class Searcher(str, Enum):
    """How the points of a search are chosen."""

    RANDOM = "random"
    CROSS_ENTROPY = "cross-entropy"
    CMA_ES = "cma-es"


def generations(searcher: Searcher, dimensions: int, *parts: str | int) -> Generator[FloatArray, Sequence[float], None]:
    """Generations of points [N, dimensions] of the unit cube, without end; each is sent the losses [N] of its points.
    `parts` name the random numbers."""
    match searcher:
        case Searcher.RANDOM:
            return _random(dimensions, generator_of(*parts))
        case Searcher.CROSS_ENTROPY:
            return _cross_entropy(dimensions, generator_of(*parts))
        case Searcher.CMA_ES:
            return _cma_es(dimensions, *parts)


def _random(dimensions: int, generator: np.random.Generator) -> Generator[FloatArray, Sequence[float], None]:
    while True:
        yield generator.random((_POPULATION, dimensions))


def _cross_entropy(dimensions: int, generator: np.random.Generator) -> Generator[FloatArray, Sequence[float], None]:
    mean, deviation = np.full(dimensions, 0.5), np.full(dimensions, _FIRST_DEVIATION)
    while True:
        points = np.clip(generator.normal(mean, deviation, (_POPULATION, dimensions)), 0.0, 1.0)
        losses = yield points
        elite = points[np.argsort(losses, kind="stable")[:_ELITE]]
        mean = _KEPT * mean + (1.0 - _KEPT) * elite.mean(axis=0)
        deviation = np.maximum(_KEPT * deviation + (1.0 - _KEPT) * elite.std(axis=0), _LEAST_DEVIATION)


def _cma_es(dimensions: int, *parts: str | int) -> Generator[FloatArray, Sequence[float], None]:
    """From the middle of the cube, and after each convergence from a random point."""
    bounds, restart = np.tile([0.0, 1.0], (dimensions, 1)), 0
    mean: FloatArray = np.full(dimensions, 0.5)
    while True:
        seed = seed_of(*parts, restart) % 2**31
        optimiser = cmaes.CMA(mean=mean, sigma=_FIRST_DEVIATION, bounds=bounds, seed=seed)
        while not optimiser.should_stop():
            points = [optimiser.ask() for _ in range(optimiser.population_size)]
            losses = yield np.array(points)
            optimiser.tell(list(zip(points, losses, strict=True)))
        restart += 1
        mean = generator_of(*parts, "restart", restart).random(dimensions)


def falsify(arm: SeatedArm, searcher: Searcher, *, games: int, repeats: int) -> Iterator[tuple[int, Game]]:
    """Play the games of several searches of an arm, of `games` games each: the number of its search, and each game.
    Each search has random numbers of its own. The generations of all are played side by side.

    Raises SimulationError if SUMO can't load the scene, StageFailed where a game can't be played.
    """
    players = len(arm.drivers)
    by_sumo = any(each is not None and not each.takes_over for each in arm.drivers[1:])
    dimensions = 2 * players + (len(RANGES) if by_sumo else 0)
    point_of = dict[int, FloatArray]()
    losses: list[list[float]] = [[] for _ in range(repeats)]  # of the games of this generation, by search

    def batches() -> Iterator[list[int]]:
        searches = [
            generations(searcher, dimensions, arm.seed, "falsification", searcher.value, repeat)
            for repeat in range(repeats)
        ]
        points, first = [next(search) for search in searches], 0
        while first < games:
            size = min(len(points[0]), games - first)
            batch = [FIRST_EPISODE + repeat * games + first + k for repeat in range(repeats) for k in range(size)]
            point_of.update(zip(batch, (point for each in points for point in each[:size]), strict=True))
            yield batch
            first += size
            if first < games:
                points = [search.send(each) for search, each in zip(searches, losses, strict=True)]
                for each in losses:
                    each.clear()

    def start_from(episode: int, drawn: InitialState) -> InitialState:
        point = point_of[episode]
        shares = point[: 2 * players].reshape(2, players).T
        start = start_at(arm.scene, drawn, *starts_in(arm.scene.places, shares))
        return replace(start, ordinary_driver=ordinary_driver_at(point[2 * players :])) if by_sumo else start

    for game in assess_batches(arm, batches(), start_from=start_from, shared_numbers=True):
        episode = game.played["episode"]
        if game.played["error"]:
            raise StageFailed(f"{arm.name}, game {episode}: {game.played['error']}")
        repeat = (episode - FIRST_EPISODE) // games
        if searcher is not Searcher.RANDOM:  # chance does not look at them
            losses[repeat].append(loss_of(game))
        yield repeat, game


def fails(game: Game) -> bool:
    """Whether the ego fails in a game that was played."""
    return bool(game.played[f"{ROLES[EGO]}_outcome"] != Outcome.GOAL.word)


def loss_of(game: Game) -> float:
    """The loss of a game that was played."""
    if fails(game) or game.recorded is None:
        return 0.0
    time_s = min_ttc_s(Drive(game=game.recorded, player=EGO))
    return NOT_CLOSE_S if time_s is None else min(float(time_s), NOT_CLOSE_S)
