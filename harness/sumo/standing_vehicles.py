"""Obstacles in SUMO's traffic: vehicles that stand, so that the traffic stops behind them or drives round them.

Where an obstacle blocks lanes, one vehicle stands on each. Contact is tested against the obstacle itself.
"""

from __future__ import annotations

from collections.abc import Sequence

import libsumo

from harness.road.scene.blocked_lanes import Blockage, blockages
from harness.road.scene.open_scene import OpenScene
from harness.sumo.insertion import Insertion, in_tile

OBSTACLE_TYPE = "harness_obstacle"
TYPE_XML = f'<vType id="{OBSTACLE_TYPE}" vClass="ignoring" minGap="0"/>'
"""Their vehicle type: no lane's permissions exclude it."""


class StandingVehicles:
    """The standing vehicles of all games."""

    def __init__(self, scene: OpenScene, prefixes: Sequence[str], insertion: Insertion) -> None:
        self._scene, self._prefixes, self._insertion = scene, prefixes, insertion
        self._names: list[list[str]] = [[] for _ in prefixes]

    @property
    def count(self) -> int:
        """Vehicles of all games."""
        return sum(map(len, self._names))

    def reset(self, game: int, *parts: str | int) -> None:
        """Replace the vehicles of a game by those of the game whose seeds have these parts."""
        for name in self._names[game]:
            libsumo.vehicle.remove(name)
        obstacles = self._scene.obstacles
        blocked = blockages(self._scene.lane_strips, obstacles.poses(*parts), obstacles)
        self._names[game] = [self._add(self._prefixes[game], k, each) for k, each in enumerate(blocked)]

    def _add(self, prefix: str, number: int, blockage: Blockage) -> str:
        name = f"{prefix}{self._scene.obstacles.each[blockage.obstacle].name}.{number}"
        edges = blockage.strip.edges
        self._insertion.add(
            prefix, name, edges=edges, vehicle_type=OBSTACLE_TYPE, lane="first", position="base", speed="0"
        )
        stand(name, in_tile(prefix, blockage.strip.name), blockage.front_m, blockage.length_m)
        return name


def stand(name: str, lane: str, front_m: float, length_m: float) -> None:
    """Let a vehicle of this length that was just added stand on a lane for good."""
    vehicle = libsumo.vehicle
    vehicle.setLength(name, length_m)
    vehicle.moveTo(name, lane, front_m)  # at once: SUMO would wait for room
    vehicle.setSpeedMode(name, 0)
    vehicle.setLaneChangeMode(name, 0)
    vehicle.setSpeed(name, 0.0)
