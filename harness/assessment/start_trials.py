"""Games of one episode from chosen starts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import repeat

import numpy as np

from harness.assessment.rollout import Game, assess_batches
from harness.assessment.seated_arm import SeatedArm
from harness.game.arrays import FloatArray
from harness.game.initial_state import InitialState
from harness.game.start_range import poses_of
from harness.road.scene.open_scene import OpenScene


def start_at(
    scene: OpenScene, drawn: InitialState, position_m: Sequence[float], speed_mps: Sequence[float]
) -> InitialState:
    """A drawn start with other positions (of the front bumpers, along the players' lines) and speeds [P]."""
    lengths_m = scene.world.length_m
    x_m, y_m, heading_rad = poses_of(scene.places, position_m, lengths_m)
    positions = np.array(position_m, dtype=float)
    return replace(
        drawn,
        x_m=x_m,
        y_m=y_m,
        heading_rad=heading_rad,
        speed_mps=np.array(speed_mps, dtype=float),
        position_m=positions,
        station_m=positions - 0.5 * lengths_m,
    )


class StartTrials:
    """Plays one episode of an arm as often as asked, each time from another start. SUMO runs in the `with` block."""

    def __init__(self, arm: SeatedArm, episode: int) -> None:
        self._arm = arm
        self._next: FloatArray | None = None
        self.played = 0
        """Games played so far."""
        self.last_start: FloatArray = np.empty(0)
        """[2 P] the start of the game that was played last."""
        self._games = assess_batches(arm, repeat([episode]), start_from=self._start)

    def play(self, start: FloatArray | None) -> Game:
        """Play the episode from a start [2 P]: the players' positions, then their speeds; None: from the one that is
        drawn for it. Raises SimulationError if SUMO can't load the scene."""
        self._next, self.played = start, self.played + 1
        return next(self._games)

    def __enter__(self) -> StartTrials:
        return self

    def __exit__(self, *error: object) -> None:
        self._games.close()

    def _start(self, episode: int, drawn: InitialState) -> InitialState:
        start = drawn
        if self._next is not None:
            position_m, speed_mps = np.split(self._next, 2)
            start = start_at(self._arm.scene, drawn, position_m.tolist(), speed_mps.tolist())
        self.last_start = np.concatenate((start.position_m, start.speed_mps))
        return start
