"""What tables and drawings show of the edges, lanes, junctions and signals of a net."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import TypeAlias

import numpy as np
import shapely
from sumolib.net import Net
from sumolib.net.edge import Edge
from sumolib.net.lane import SUMO_VEHICLE_CLASSES, Lane
from sumolib.net.node import Node

from harness.game.arrays import FloatArray
from harness.road.net.network import car_lanes, find_edge, lane_line
from harness.road.net.surface import lane_shape

_SHORT_LIST = 4  # vehicle classes that are named one by one


# For those who do not import sumolib.
NetEdge: TypeAlias = Edge
NetLane: TypeAlias = Lane


def edges_within(net: Net, path: Path, name: str | None, within_m: float) -> list[Edge]:
    """The net's edges within a distance of an edge, the nearest first; without a name all of them, in the net's order.

    Raises UsageError with the most similar name if there is no such edge.
    """
    edges: list[Edge] = net.getEdges(withInternal=False)
    if name is None:
        return edges
    centre = _outline(find_edge(net, path, "--near", name))
    distances_m = [float(shapely.distance(centre, _outline(edge))) for edge in edges]
    order = sorted(range(len(edges)), key=lambda k: (edges[k].getID() != name, distances_m[k], edges[k].getID()))
    return [edges[k] for k in order if distances_m[k] <= within_m]


def lane_outline(lane: Lane) -> FloatArray:
    """[n, 2] the outline of a lane's area."""
    shape = max(shapely.get_parts(lane_shape(lane_line(lane), lane.getWidth())), key=shapely.area)
    return shapely.get_coordinates(shape.exterior)


def junction_outline(node: Node) -> FloatArray:
    """[n, 2] the outline of a junction's area; may be empty."""
    return np.array([point[:2] for point in node.getShape()], dtype=float).reshape(-1, 2)


def signalled_ends(node: Node, edges: Collection[Edge]) -> list[FloatArray]:
    """The ends [2] of the lanes for cars, of these edges, that a traffic light controls at a junction."""
    lanes = [lane for edge in node.getIncoming() if edge in edges for lane in car_lanes(edge)]
    return [lane_line(lane)[-1] for lane in lanes if any(link.getTLSID() for link in lane.getOutgoing())]


def permissions(lane: Lane) -> str:
    """Who may use a lane: the classes, or the classes that may not, whichever are fewer."""
    allowed = sorted(set(lane.getPermissions()))
    forbidden = sorted(set(SUMO_VEHICLE_CLASSES) - set(allowed))
    if not forbidden:
        return "all"
    if not allowed:
        return "none"
    if len(allowed) <= len(forbidden):
        return _shortened(allowed)
    return f"all but {_shortened(forbidden)}"


def _shortened(classes: Sequence[str]) -> str:
    shown = ", ".join(classes[:_SHORT_LIST])
    return shown if len(classes) <= _SHORT_LIST else f"{shown} and {len(classes) - _SHORT_LIST} more"


def _outline(edge: Edge) -> shapely.Geometry:
    return shapely.union_all([shapely.LineString(lane_line(lane)) for lane in edge.getLanes()])
