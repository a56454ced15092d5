"""Opening a SUMO simulation: in this process if its libsumo is free, otherwise in a child process."""

from __future__ import annotations

from collections.abc import Sequence

from harness.traffic.scene import OpenScene
from harness.traffic.simulation import Simulation


def open_simulation(
    scene: OpenScene, games: int, taken_over: Sequence[bool], seed: int, recorded: bool = False
) -> Simulation:
    """Load SUMO with a tile for each game: in this process if its libsumo is free, otherwise in a child process.

    `taken_over` [P] marks the players that the harness drives. With `recorded`, every background vehicle is read in
    every step, near a player or not; reading a vehicle costs as much time as SUMO's own work on it.

    Both kinds of simulation give the same numbers. A child process needs one message each way per call. Raises
    SimulationError if SUMO can't load the scene.
    """
    from harness.traffic.libsumo_simulation import LibsumoSimulation

    if not LibsumoSimulation.in_use():
        return LibsumoSimulation(scene, games, taken_over, seed, recorded=recorded)
    from harness.traffic.subprocess_simulation import SubprocessSimulation

    return SubprocessSimulation(scene, games, taken_over, seed, recorded=recorded)
