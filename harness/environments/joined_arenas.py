"""Arenas on several scenes, stepped together: they share one SUMO where they can."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from harness.environments.arena import Arena
from harness.environments.seats import Seat, taken_over, with_walkers
from harness.road.scene.open_scene import OpenScene
from harness.sumo.scene_games import SceneGames
from harness.sumo.subprocess_simulation import open_simulations


@dataclass(frozen=True, kw_only=True)
class SeatedGames:
    """G games on a scene, and the seats [P][n] of their players."""

    scene: OpenScene
    games: int
    seats: Sequence[Sequence[Seat]]


def open_arenas(parts: Sequence[SeatedGames], *, seed: int) -> list[Arena]:
    """An arena for each part. All of them make the first half of a step (`Arena.place`) before one of them goes on.

    Raises SimulationError if SUMO can't load a scene.
    """
    seats = [with_walkers(part.seats, part.scene.world) for part in parts]
    played = [
        SceneGames(scene=part.scene, games=part.games, taken_over=taken_over(of_part))
        for part, of_part in zip(parts, seats, strict=True)
    ]
    simulations = open_simulations(played, seed=seed)
    try:
        return [
            Arena(part.scene, part.games, of_part, simulation=simulation)
            for part, of_part, simulation in zip(parts, seats, simulations, strict=True)
        ]
    except BaseException:
        for each in simulations:
            each.close()
        raise
