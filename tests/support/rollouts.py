"""Assessed games of drivers that tests make up."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Sequence
from typing import Any

import numpy as np
import pandas as pd

from harness.assessment.rollout import Game, assess_batches
from harness.assessment.seated_arm import SeatedArm
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.drivers.mixture import Mixture, mixture_of
from harness.drivers.policy_file import LearnedDriver
from harness.drivers.protocol import Driver
from harness.game.arrays import FloatArray, IntArray
from harness.road.scene.open_scene import OpenScene
from tests.support.policies import some_policy
from tests.support.tiny import CAREFUL, SPEEDY

RANDOM = LearnedDriver(some_policy(), sampled=True)
"""A policy with random parameters."""


class Steady:
    """Keeps pedals and wheel constant; by default straight on, at the speed it has."""

    takes_over = True

    def __init__(self, pedals: float = 0.0, wheel: float = 0.0) -> None:
        self._action = (pedals, wheel)

    def reset(self, games: IntArray) -> None:
        """Nothing to forget."""

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        return np.tile(self._action, (len(games), 1))


def seated(drivers: Sequence[Driver | None], personas: Sequence[Persona]) -> tuple[Mixture | None, ...]:
    return tuple(
        None if each is None else mixture_of(each, persona) for each, persona in zip(drivers, personas, strict=True)
    )


def arm(merge: OpenScene, *drivers: Driver | None, persona: Any = SPEEDY, seed: int = 1) -> SeatedArm:
    """An arm in which a careful ego meets a driver of the persona."""
    careful, other = (read_document(file, Persona) for file in (CAREFUL, persona))
    return SeatedArm(name="naive_vs_someone", scene=merge, drivers=seated(drivers, (careful, other)), seed=seed)


def assess(assessed: SeatedArm, episodes: Iterable[int]) -> Generator[Game, None, None]:
    """Play episodes, given by their numbers, one after the other."""
    return assess_batches(assessed, ([episode] for episode in episodes))


def play(assessed: SeatedArm, episodes: int = 3) -> list[Game]:
    """The first games of an arm."""
    return list(assess(assessed, range(episodes)))


def trace(game: Game) -> pd.DataFrame:
    """The trace of a game that was recorded."""
    assert game.trace is not None
    return pd.DataFrame(game.trace)


def records(games: Sequence[Game]) -> list[str]:
    """The records of games, as text that can be compared: NaN equals NaN."""
    return [repr(game.record) for game in games]
