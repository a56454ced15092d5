"""Simulations without an arena."""

from __future__ import annotations

from harness.game.arrays import FloatArray
from harness.road.scene.open_scene import OpenScene
from harness.sumo.libsumo_simulation import LibsumoSimulation
from harness.sumo.scene_games import SceneGames
from harness.sumo.simulation import Reading, Simulation


def games_of(
    scene: OpenScene, games: int = 1, taken_over: tuple[bool, ...] = (True, True), *, recorded: bool = False
) -> SceneGames:
    return SceneGames(scene=scene, games=games, taken_over=taken_over, recorded=recorded)


def local_simulation(
    scene: OpenScene,
    games: int = 1,
    taken_over: tuple[bool, ...] = (True, True),
    seed: int = 1,
    *,
    recorded: bool = False,
) -> LibsumoSimulation:
    """A simulation in this process."""
    [simulation] = LibsumoSimulation.side_by_side([games_of(scene, games, taken_over, recorded=recorded)], seed)
    return simulation


def stepped(simulation: Simulation, x_m: FloatArray, y_m: FloatArray, heading_rad: FloatArray) -> Reading:
    """The reading after a step with the players at these poses [G, P]."""
    simulation.place(x_m, y_m, heading_rad)
    return simulation.step()
