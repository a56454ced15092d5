"""The levels of roads: which background vehicles are above or below the players' roads, so that no player meets them.

The road of a game is flat: the drivable area has the level of the players' routes (`network.drivable_area`), and so
have contact and observation. A vehicle on a bridge over a player's road, or under it, takes no part in the game.
Players' routes that lie over one another are refused.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import combinations
from pathlib import Path

import numpy as np
from sumolib.net import Net
from sumolib.net.edge import Edge
from sumolib.net.lane import Lane

from harness.errors import UsageError
from harness.game.arrays import BoolArray, FloatArray
from harness.road.net.network import nodes_of, passes_other_levels
from harness.road.net.surface import CLEARANCE_M, stations_of

_SPACING_M = 4.0  # between points of the players' roads
_AT_ONE_PLACE_M = 5.0  # our own: points of the players' roads whose distances differ by less are at one place
_GRADE, _RISE_M = 0.06, 1.5  # our own: a road beside the players' roads rises by at most so much per metre, and in all


def heights_of_players_roads(net: Net, own: Collection[Edge]) -> FloatArray | None:
    """[n, 3] points of the edges `own` of the players' routes and of the junctions on them; None if no other road
    passes over or under them."""
    if not passes_other_levels(net, own):
        return None
    nodes = nodes_of(own)
    inside = [edge for edge in net.getEdges() if edge.isSpecial() and edge.getFromNode() in nodes]
    lanes = [lane for edge in [*own, *inside] for lane in edge.getLanes()]
    return np.concatenate([_points(lane) for lane in lanes])


def check_one_level(file: Path, own: Sequence[Edge]) -> None:
    """Raise UsageError if edges of the players' routes lie over one another: a game is flat, and its players would
    touch there."""
    if not own or np.ptp([height for edge in own for *_, height in edge.getLanes()[0].getShape3D()]) <= CLEARANCE_M:
        return
    points = [np.concatenate([_points(lane) for lane in edge.getLanes()]) for edge in own]
    for one, other in combinations(range(len(own)), 2):
        away = points[one][:, None] - points[other][None, :]
        heights_m = np.where(np.hypot(away[..., 0], away[..., 1]) <= _SPACING_M, np.abs(away[..., 2]), 0.0)
        if heights_m.max() > CLEARANCE_M:
            names = f"{own[one].getID()!r} and {own[other].getID()!r}"
            message = f"edges {names} of the players' routes lie over one another, {heights_m.max():.1f} m apart: "
            message += "a game is flat, and its players would touch there"
            raise UsageError.of(file, "routes", message, "choose routes on one level")


def _points(lane: Lane) -> FloatArray:
    """[m, 3] points of a lane at equal distances, with both ends."""
    line = np.array(lane.getShape3D(), dtype=float)
    along_m = stations_of(line)
    places_m = np.linspace(0.0, along_m[-1], int(along_m[-1] / _SPACING_M) + 2)
    return np.stack([np.interp(places_m, along_m, column) for column in line.T], axis=1)


def on_players_level(roads: FloatArray, places: FloatArray) -> BoolArray:
    """[m] whether vehicles at places [m, 3] are on the level of the players' roads, given as points [n, 3].

    The height of a vehicle is compared with that of the players' roads where they are nearest to it.
    """
    away_m = np.hypot(*(places[:, None, :2] - roads[None, :, :2]).transpose(2, 0, 1))
    nearest_m = away_m.min(1)
    differences_m = np.abs(places[:, None, 2] - roads[None, :, 2])
    least_m = np.where(away_m <= nearest_m[:, None] + _AT_ONE_PLACE_M, differences_m, np.inf).min(1)
    on_level: BoolArray = least_m <= CLEARANCE_M + np.minimum(_GRADE * nearest_m, _RISE_M)
    return on_level
