"""Speed limits of a simulation that vary from game to game."""

from __future__ import annotations

from collections.abc import Sequence

import libsumo


class SpeedLimits:
    """The limits of all lanes in the tiles with these prefixes; they are read from SUMO before the first game."""

    def __init__(self, prefixes: Sequence[str]) -> None:
        self._lanes: list[list[tuple[str, float]]] = [[] for _ in prefixes]
        tiles = {prefix: tile for tile, prefix in enumerate(prefixes)}
        for lane in libsumo.lane.getIDList():
            inner = lane.removeprefix(":")
            prefix = inner[: inner.find("_") + 1] if len(prefixes) > 1 else ""
            self._lanes[tiles[prefix]].append((lane, libsumo.lane.getMaxSpeed(lane)))

    def reset(self, game: int, share: float) -> None:
        """Multiply the net's limits in a game's tile by a factor."""
        for lane, limit_mps in self._lanes[game]:
            libsumo.lane.setMaxSpeed(lane, limit_mps * share)
