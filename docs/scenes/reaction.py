"""How SUMO's own driver reacts to a player on foot.

    python docs/scenes/reaction.py networks/crossing networks/zebra

plays 40 games per row, with SUMO's driver as the ego, and prints the table of docs/people-on-foot.md.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import typer

from harness.config.road_user import WALKING_MPS
from harness.drivers.ordinary_walker import OrdinaryWalker
from harness.drivers.sumo import SumoDriver
from harness.environments.arena import Arena, Seat
from harness.game.arrays import FloatArray, IntArray
from harness.game.human_factors import HumanFactors
from harness.game.initial_state import draw_initial_state
from harness.game.observation_layout import LAYOUT
from harness.game.outcome import Outcome
from harness.game.roles import EGO, NON_EGO
from harness.game.world import World
from harness.road.scene.open_scene import open_scene

GAMES = 40
_STOPS_WITHIN_M = 1.1
_GENTLY = -0.4  # braking that ends at a stand
_SPEED, _GOAL = LAYOUT.index("speed_mps"), LAYOUT.index("goal_m")


class Heedless:
    """Walks along its way at a comfortable speed, and up to a station."""

    takes_over = True

    def __init__(self, world: World, until_m: float) -> None:
        self._walker, self._until_m = OrdinaryWalker(world, NON_EGO), until_m
        self._goal_m = float(world.road.routes.goal_m[NON_EGO])

    def reset(self, games: IntArray) -> None:
        """It keeps no state."""

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """Actions [N, 2]."""
        actions = self._walker.decide(games, observation, noise)
        station_m = self._goal_m - 200.0 * observation[:, _GOAL]
        faster = 30.0 * observation[:, _SPEED] < WALKING_MPS
        actions[:, 0] = np.where(faster, 0.5, 0.0)
        actions[:, 0] = np.where(station_m >= self._until_m, _GENTLY, actions[:, 0])
        return actions


def main(scenes: list[Path]) -> None:
    """Print the table."""
    print("| scene | the person | contacts | mean least speed of the ego |")
    print("| --- | --- | --- | --- |")
    for folder in scenes:
        scene = open_scene(folder)
        conflicts = scene.world.right_of_way.conflicts
        kerb_m = float(conflicts.stop_m[conflicts.player == NON_EGO].min()) - 0.5 * float(scene.world.length_m[NON_EGO])
        cases = {
            "is absent": (None, 0.0),
            "stands at the kerb": (Heedless(scene.world, kerb_m - _STOPS_WITHIN_M), 1.0),
            "crosses without looking": (Heedless(scene.world, np.inf), 1.0),
            "is an ordinary walker": (OrdinaryWalker(scene.world, NON_EGO), 1.0),
        }
        for words, (walker, present) in cases.items():
            starts = scene.start_distribution([HumanFactors()] * 2, [1.0, present])
            arena = Arena(scene, 1, [Seat(SumoDriver()), Seat(walker or SumoDriver())])
            contacts, least_mps = 0, []
            for game in range(GAMES):
                arena.reload(game)
                arena.reset({0: draw_initial_state(starts, "reaction", game)})
                least_mps.append(np.inf)
                for _ in range(scene.world.steps):
                    step = arena.step()
                    least_mps[-1] = min(least_mps[-1], float(step.quantities.state.speed_mps[0, EGO]))
                    if not arena.state.running[0, EGO]:
                        break
                contacts += arena.state.outcome[0, EGO] == Outcome.COLLISION
            arena.close()
            print(f"| `{folder.name}` | {words} | {contacts} of {GAMES} | {np.mean(least_mps):.1f} m/s |")


if __name__ == "__main__":
    typer.run(main)
