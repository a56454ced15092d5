"""A single game at a time on an arena, reset from a random generator, as the environments of one game need it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from harness.drivers.policy_file import ACTIONS
from harness.environments.arena import Arena, Seat, Step
from harness.game.arrays import FloatArray
from harness.game.attention import HumanFactors
from harness.game.initial_state import draw_initial_state
from harness.game.observation import observe
from harness.game.seeding import generator_of
from harness.game.state import Outcome
from harness.traffic.scene import OpenScene

Info: TypeAlias = dict[str, Any]


class SingleGame:
    """An arena with one game, which is reset from a random generator."""

    def __init__(
        self,
        scene: OpenScene,
        seats: Sequence[Seat],
        human_factors: Sequence[HumanFactors],
        present: Sequence[float],
    ) -> None:
        """Load SUMO. `present` [P] are the shares of games in which players take part. Raises SimulationError."""
        self._scene = scene
        self._start_distribution = self._scene.start_distribution(human_factors, present)
        self.arena = Arena(self._scene, 1, seats)

    def reset(self, generator: np.random.Generator) -> None:
        """Reset to the next game that the generator draws."""
        parts = ("environment", int(generator.integers(2**63 - 1)))
        start = draw_initial_state(self._start_distribution, *parts)
        self.arena.reload(start.seed)
        self.arena.reset({0: start}, {0: self._scene.departures(generator_of(*parts, "others"))})

    def play(self, actions: Mapping[int, FloatArray]) -> Step:
        """Play a step with these actions [2] of players. Raises ValueError if one is not finite."""
        array = np.zeros((1, len(self.arena.seats), ACTIONS))
        for player, action in actions.items():
            array[0, player] = action
        if not np.isfinite(array).all():
            raise ValueError(f"an action is not finite: {dict(actions)}")
        return self.arena.step(array)

    def ended(self, player: int) -> tuple[bool, bool]:
        """Whether the player's game was terminated, and whether it was truncated."""
        outcome = self.arena.state.outcome[0, player]
        return bool(outcome not in (Outcome.RUNNING, Outcome.TIMEOUT)), bool(outcome == Outcome.TIMEOUT)

    def observation(self, player: int, step: Step | None = None) -> FloatArray:
        """The player's observation [SIZE]; in its last step, the one before it was removed or stopped."""
        if step is not None and any(self.ended(player)):
            return observe(step.quantities)[0, player]
        return self.arena.observation[0, player].copy()

    def info(self, player: int, step: Step | None = None) -> Info:
        """What the environments report of a player beside its observation."""
        state = self.arena.state if step is None else step.quantities.state
        station_m = float(state.station_m[0, player])
        payoff = self.arena.seats[player][0].payoff
        terms = {} if step is None or payoff is None else payoff.evaluate(step.quantities, player)
        return {
            "outcome": Outcome(int(state.outcome[0, player])).word,
            "terms": {name: float(share[0]) + 0.0 for name, share in terms.items()},
            "station_m": station_m,
            "goal_m": float(self.arena.world.road.routes.goal_m[player]) - station_m,
            "speed_mps": float(state.speed_mps[0, player]),
            "time_s": float(state.step[0]) * self.arena.world.step_s,
        }
