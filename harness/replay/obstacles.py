"""Obstacles that are no vehicles, and buildings, as polygons of a replay."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pandas as pd

from harness.game.arrays import FloatArray
from harness.game.placed_obstacles import Obstacles
from harness.replay.contact import box_of
from harness.replay.vehicles import OBSTACLE_COLOUR, DrawnVehicle

_COLOURS = {"cone": "255,110,0", "closed_lane": "200,60,40,120", "debris": "120,90,60", "wall": "90,90,100"}
_BUILDING_COLOUR = "150,140,130"
_WALL_M = 0.3


def shapes_of(
    trace: pd.DataFrame, types: Mapping[str, DrawnVehicle], obstacles: Obstacles
) -> Iterator[ElementTree.Element]:
    """The polygons of one game's obstacles that are not drawn as vehicles, and of the buildings."""
    first = {str(row.player): row for row in trace.drop_duplicates("player").itertuples()}
    for obstacle in obstacles.each:
        row: Any = first.get(obstacle.name)
        if row is not None and not types[obstacle.name].shape:
            corners = np.array(box_of(row, types[obstacle.name]).exterior.coords)
            yield _polygon(obstacle.name, corners, _COLOURS.get(obstacle.kind, OBSTACLE_COLOUR), filled=True)
    for number, outline in enumerate(obstacles.outlines):
        corners = np.concatenate((outline, outline[:1]))
        yield _polygon(f"building_{number}", corners, _BUILDING_COLOUR, filled=len(outline) > 2)


def painted(stripes: Sequence[FloatArray]) -> Iterator[ElementTree.Element]:
    """The polygons of the stripes of marked crossings, above the lanes and below the vehicles."""
    for number, corners in enumerate(stripes):
        yield _polygon(f"stripe_{number}", corners, "white", filled=True)


def _polygon(name: str, corners: FloatArray, colour: str, *, filled: bool) -> ElementTree.Element:
    shape = " ".join(f"{x:.3f},{y:.3f}" for x, y in corners)
    look = {"color": colour, "layer": "4", "fill": "1" if filled else "0", "lineWidth": f"{0.5 * _WALL_M:g}"}
    return ElementTree.Element("poly", {"id": name, "shape": shape} | look)
