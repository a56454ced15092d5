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
from harness.game.observation_layout import SIZE
from harness.game.seeding import generator_of
from harness.road.scene.open_scene import OpenScene, open_scene

REPOSITORY = Path(__file__).resolve().parents[1]
MERGE = REPOSITORY / "networks" / "paper_merge"
GAMES = 64  # as many as campaigns train on
_MEAN_ACTION, _DEVIATION = np.array([0.02, 0.0]), np.array([0.1, 0.01])  # of pedals and wheel
_ACTIONS_KEPT = 509  # a prime, so that no game gets the same noise at the same place again


def merge_scene() -> OpenScene:
    """The scene of the paper's figure 2."""
    return open_scene(MERGE)


def junction_scene() -> OpenScene:
    """A crossing with traffic lights, where the players' ways cross."""
    return open_scene(REPOSITORY / "networks" / "left_across")


def persona_file(name: str) -> Path:
    """The file of one of the repository's personas."""
    return REPOSITORY / "personas" / f"{name}.toml"


def persona(name: str) -> Persona:
    """One of the repository's personas."""
    return read_document(persona_file(name), Persona)


def coasting_policy(deviation: float = 0.1) -> Policy:
    """An untrained policy of the size that campaigns train: it drives straight on."""
    generator = generator_of("benchmarks", "policy")
    tensors: dict[str, FloatArray] = {"log_deviation": np.full(ACTIONS, np.log(deviation), dtype=np.float32)}
    for part, outputs in (("actor", ACTIONS), ("critic", 1)):
        sizes = (SIZE, 64, 64, outputs)
        for layer, (inputs, width) in enumerate(itertools.pairwise(sizes)):
            scale = 0.01 if width == outputs else 0.1
            weights = generator.standard_normal((width, inputs)) * scale
            tensors[f"{part}.{layer}.weight"] = weights.astype(np.float32)
            tensors[f"{part}.{layer}.bias"] = np.zeros(width, dtype=np.float32)
    return Policy(tensors)


class CoastingGames:
    """An arena in which both players' actions come from outside, and every game that ends is reset."""

    def __init__(self, scene: OpenScene, games: int, seed: int = 1) -> None:
        personas = [persona("careful"), persona("paper_distracted")]
        self.arena = Arena(scene, games, [Seat(driver=None, payoff=each.payoff) for each in personas], seed=seed)
        self._start_distribution = scene.start_distribution([each.human_factors for each in personas], [1.0, 1.0])
        self._auto_reset = AutoReset(self.arena, self._start_distribution, "benchmarks")
        noise = generator_of("benchmarks", "actions").standard_normal((_ACTIONS_KEPT, games, len(personas), ACTIONS))
        self._actions = _MEAN_ACTION + _DEVIATION * noise
        self._steps = 0

    def reset(self, games: list[int]) -> None:
        """Reset games, each to a start that was not played before."""
        self._auto_reset.reset(games)

    def reset_all(self, seed: int = 1) -> None:
        """Reset everything, SUMO included, to the state of the first time."""
        self._auto_reset = AutoReset(self.arena, self._start_distribution, "benchmarks")
        self._steps = 0
        self.arena.reload(seed)
        self.reset(list(range(self.arena.games)))

    def step(self, reset_ended: bool = True) -> None:
        """Play one step of every game, then reset the games that ended."""
        self.arena.step(self._actions[self._steps % _ACTIONS_KEPT])
        self._steps += 1
        if reset_ended:
            ended = np.flatnonzero(~self.arena.state.running.any(1))
            if len(ended):
                self.reset(ended.tolist())
