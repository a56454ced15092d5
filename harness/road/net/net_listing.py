"""The lanes, junctions and signals of a net as plain records, for tables and drawings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from sumolib.net import Net
from sumolib.net.edge import Edge
from sumolib.net.lane import SUMO_VEHICLE_CLASSES, Lane

from harness.game.arrays import FloatArray
from harness.road.net.network import car_lanes, find_edge, lane_line, nodes_of
from harness.road.net.surface import lane_shape

_SHORT_LIST = 4  # vehicle classes that are named one by one


@dataclass(frozen=True, kw_only=True)
class ListedLane:
    """A lane of an edge."""

    name: str
    edge: str
    start_junction: str
    end_junction: str
    leads_to: tuple[str, ...]
    """The next edges, each after SUMO's letter of the direction: `l north_out` is to the left."""
    length_m: float
    limit_mps: float
    width_m: float
    permissions: str
    for_cars: bool
    line: FloatArray  # [n, 2]
    outline: FloatArray  # [n, 2]


@dataclass(frozen=True, kw_only=True)
class ListedJunction:
    """A junction, with its area and its kind in SUMO: priority, traffic_light, dead_end and so on."""

    name: str
    kind: str
    outline: FloatArray  # [n, 2]; may be empty
    signals: FloatArray  # [n, 2] ends of the lanes that a traffic light controls


def edges_near(net: Net, path: Path, name: str | None, within_m: float) -> list[Edge]:
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


def listed(edges: Sequence[Edge]) -> tuple[list[ListedLane], list[ListedJunction]]:
    """The lanes of edges, and the junctions at their ends."""
    return [_listed_lane(lane) for edge in edges for lane in edge.getLanes()], _listed_junctions(edges)


def _listed_lane(lane: Lane) -> ListedLane:
    edge, line = lane.getEdge(), lane_line(lane)
    shape = max(shapely.get_parts(lane_shape(line, lane.getWidth())), key=shapely.area)
    return ListedLane(
        name=lane.getID(),
        edge=edge.getID(),
        start_junction=edge.getFromNode().getID(),
        leads_to=tuple(f"{link.getDirection()} {link.getTo().getID()}" for link in lane.getOutgoing()),
        end_junction=edge.getToNode().getID(),
        length_m=lane.getLength(),
        limit_mps=lane.getSpeed(),
        width_m=lane.getWidth(),
        permissions=_permissions(lane),
        for_cars=lane.allows("passenger"),
        line=line,
        outline=shapely.get_coordinates(shape.exterior),
    )


def _listed_junctions(edges: Sequence[Edge]) -> list[ListedJunction]:
    kept = set(edges)
    return [
        ListedJunction(
            name=node.getID(),
            kind=node.getType(),
            outline=np.array([point[:2] for point in node.getShape()], dtype=float).reshape(-1, 2),
            signals=np.array(
                [
                    lane_line(lane)[-1]
                    for edge in node.getIncoming()
                    if edge in kept
                    for lane in car_lanes(edge)
                    if any(link.getTLSID() for link in lane.getOutgoing())
                ],
                dtype=float,
            ).reshape(-1, 2),
        )
        for node in nodes_of(edges)
    ]


def _permissions(lane: Lane) -> str:
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
