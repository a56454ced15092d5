"""What the measurements play: the merge scene, its personas, and players that coast along."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np

from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.drivers.policy_file import ACTIONS, Policy
from harness.environments.arena import Arena, Seat
from harness.environments.auto_reset import AutoReset
from harness.game.arrays import FloatArray
from harness.game.observation import SIZE
from harness.game.seeding import generator_of
from harness.traffic.scene import OpenScene, open_scene

REPOSITORY = Path(__file__).resolve().parents[1]
MERGE = REPOSITORY / "networks" / "merge"
GAMES = 64  # as many as campaigns train on
_STRAIGHT_ON, _VARIED = np.array([0.02, 0.0]), np.array([0.1, 0.01])  # pedals and wheel: what players do
_ACTIONS_KEPT = 509  # a prime, so that no game meets its own noise again at the same place


def merge() -> OpenScene:
    """The scene of the paper's figure 2."""
    return open_scene(MERGE)


def persona_file(name: str) -> Path:
    """A persona's document."""
    return REPOSITORY / "personas" / f"{name}.toml"


def persona(name: str) -> Persona:
    """A persona of the repository."""
    return read_document(persona_file(name), Persona)


def coasting_policy(deviation: float = 0.1) -> Policy:
    """A policy of the size that campaigns train, before it has learned anything: it goes straight on."""
    generator = generator_of("benchmarks", "policy")
    tensors: dict[str, FloatArray] = {"log_deviation": np.full(ACTIONS, np.log(deviation), dtype=np.float32)}
    for part, outputs in (("actor", ACTIONS), ("critic", 1)):
        sizes = (SIZE, 64, 64, outputs)
        for k, (inputs, width) in enumerate(itertools.pairwise(sizes)):
            scale = 0.01 if width == outputs else 0.1
            weights = generator.standard_normal((width, inputs)) * scale
            tensors[f"{part}.{k}.weight"] = weights.astype(np.float32)
            tensors[f"{part}.{k}.bias"] = np.zeros(width, dtype=np.float32)
    return Policy(tensors)


class Played:
    """An arena in which both players' actions come from outside, and every game that ends starts anew."""

    def __init__(self, scene: OpenScene, games: int, seed: int = 1) -> None:
        people = [persona("careful"), persona("distracted")]
        self.arena = Arena(scene, games, [Seat(None, each.payoff) for each in people], seed)
        self._start_distribution = scene.start_distribution([each.human_factors for each in people], [1.0, 1.0])
        self._games = AutoReset(self.arena, self._start_distribution, "benchmarks")
        noise = generator_of("benchmarks", "actions").standard_normal((_ACTIONS_KEPT, games, len(people), ACTIONS))
        self._actions = _STRAIGHT_ON + _VARIED * noise
        self._steps = 0

    def start(self, games: list[int]) -> None:
        """Start games, each as it has not been played before."""
        self._games.reset(games)

    def begin_again(self, seed: int = 1) -> None:
        """Everything anew, just as it was the first time."""
        self._games = AutoReset(self.arena, self._start_distribution, "benchmarks")
        self._steps = 0
        self.arena.reload(seed)
        self.start(list(range(self.arena.games)))

    def step(self, restart: bool = True) -> None:
        """A step of every game; those that ended start anew."""
        self.arena.step(self._actions[self._steps % _ACTIONS_KEPT])
        self._steps += 1
        if restart:
            ended = np.flatnonzero(~self.arena.state.running.any(1))
            if len(ended):
                self.start(ended.tolist())
