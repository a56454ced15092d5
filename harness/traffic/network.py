"""The drivable area of a SUMO net, and its rails.

The drivable area is the union of the areas of all lanes that cars may use and of the junctions between them. Its
outline, without the openings where roads enter and leave the scene, is the rails.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import shapely
import sumolib
from shapely.geometry.base import BaseGeometry
from sumolib.net import Net
from sumolib.net.connection import Connection
from sumolib.net.edge import Edge
from sumolib.net.lane import Lane

from harness.config.toml_reading import nearest
from harness.errors import UsageError
from harness.game.arrays import FloatArray
from harness.game.rails import Rails

_SEAM_M = 0.05  # gaps up to twice this between lanes and junctions are closed
_OPENING_M = 0.3  # reach of an opening along the outline
_SMOOTH_M = 0.01
_CAR, _SHOULDER = "passenger", "emergency"  # a paved shoulder is a lane for emergency vehicles
_TURNAROUNDS = (Connection.LINKDIR_TURN, Connection.LINKDIR_TURN_LEFTHAND)


def read_net(path: Path) -> Net:
    """Read a `.net.xml` that is well-formed XML. Raises UsageError if SUMO's reader fails, or no lane is for cars."""
    try:
        net = sumolib.net.readNet(str(path), withInternal=True)
    except Exception as error:  # sumolib does not document its errors
        raise UsageError.of(path, "", f"is not a SUMO net: {error!r}", "build it with netconvert or netedit") from error
    if not any(car_lanes(edge) for edge in net.getEdges(withInternal=False)):
        raise UsageError.of(path, "", "has no lane that cars may use", "build it with netconvert or netedit")
    return net


def car_lanes(edge: Edge) -> list[Lane]:
    """The edge's lanes that cars may use, in SUMO's order."""
    return [lane for lane in edge.getLanes() if lane.allows(_CAR)]


def _paved_lanes(edge: Edge) -> list[Lane]:
    """The edge's lanes that a car can physically use: hard shoulders count, pavements do not."""
    return [lane for lane in edge.getLanes() if lane.allows(_CAR) or lane.allows(_SHOULDER)]


def lane_line(lane: Lane) -> FloatArray:
    """[n, 2] points of the lane's centre line."""
    return np.array([point[:2] for point in lane.getShape()], dtype=float)


def drivable_area(net: Net) -> BaseGeometry:
    """The area that cars can drive on, with hard shoulders, in network coordinates."""
    outside = _turnarounds_outside(net)
    parts = [
        shapely.LineString(lane_line(lane)).buffer(lane.getWidth() / 2.0, cap_style="flat", join_style="mitre")
        for edge in net.getEdges(withInternal=True)
        for lane in _paved_lanes(edge)
        if lane.getID() not in outside and np.ptp(lane_line(lane), axis=0).any()
    ]
    for node in net.getNodes():
        if len(node.getShape()) > 2:
            parts.append(shapely.Polygon([point[:2] for point in node.getShape()]).buffer(0))
    grown = shapely.union_all([part.buffer(_SEAM_M, join_style="mitre") for part in parts])
    return grown.buffer(-_SEAM_M, join_style="mitre").simplify(_SMOOTH_M)


def rail_lines(net: Net, area: BaseGeometry) -> list[FloatArray]:
    """The rails as polylines [n, 2]: the outline of the net's drivable area without the openings."""
    openings = [
        shapely.LineString(_cross_section(lane, at_end)).buffer(_OPENING_M, cap_style="square")
        for edge in net.getEdges(withInternal=False)
        for at_end in (False, True)
        if _is_fringe(edge, at_end)
        for lane in _paved_lanes(edge)
    ]
    outline = area.boundary
    rails = shapely.difference(outline, shapely.union_all(openings)) if openings else outline
    merged = shapely.line_merge(rails) if rails.geom_type == "MultiLineString" else rails
    return [np.asarray(line.coords) for line in getattr(merged, "geoms", [merged]) if len(line.coords) > 1]


def rails(lines: Sequence[FloatArray], reach_m: float) -> Rails:
    """Rails of polylines [n, 2]. Look-ups find all segments within `reach_m` of a point."""
    segments = [np.stack((line[:-1], line[1:]), axis=1) for line in lines]
    return Rails.of(np.concatenate(segments) if segments else np.zeros((0, 2, 2)), reach_m)


def find_edge(net: Net, path: Path, key: str, name: str) -> Edge:
    """The edge with this name. Raises UsageError with the most similar name if there is none."""
    if not net.hasEdge(name) or net.getEdge(name).isSpecial():
        names = [edge.getID() for edge in net.getEdges(withInternal=False)]
        raise UsageError.of(path, key, f"the net has no edge {name!r}", nearest(name, names))
    return net.getEdge(name)


def find_lane(net: Net, path: Path, key: str, name: str) -> Lane:
    """The lane with this name. Raises UsageError with the most similar name if there is none."""
    names = [lane.getID() for edge in net.getEdges(withInternal=False) for lane in edge.getLanes()]
    if name not in names:
        raise UsageError.of(path, key, f"the net has no lane {name!r}", nearest(name, names))
    return net.getLane(name)


def _is_fringe(edge: Edge, at_end: bool) -> bool:
    """Whether the scene ends at this end of the edge: only the opposite edge is connected there."""
    if at_end:
        return all(_is_opposite(edge, other) for other in edge.getToNode().getOutgoing() if not other.isSpecial())
    return all(_is_opposite(other, edge) for other in edge.getFromNode().getIncoming() if not other.isSpecial())


def _is_opposite(edge: Edge, other: Edge) -> bool:
    """Whether the other edge leads from the edge's end back to its start, through turnarounds only."""
    if other.getToNode() is not edge.getFromNode():
        return False
    return all(link.getDirection() in _TURNAROUNDS for link in edge.getConnections(other))


def _turnarounds_outside(net: Net) -> set[str]:
    """SUMO's turnaround lanes at roads that leave the scene. They extend beyond the end of the road."""
    return {
        link.getViaLaneID()
        for edge in net.getEdges(withInternal=False)
        if _is_fringe(edge, at_end=True)
        for links in edge.getOutgoing().values()
        for link in links
    }


def _cross_section(lane: Lane, at_end: bool) -> FloatArray:
    """[2, 2] line across a lane's start or end."""
    line = lane_line(lane)
    end, inner = (line[-1], line[-2]) if at_end else (line[0], line[1])
    along = (end - inner) / max(float(np.linalg.norm(end - inner)), 1e-9)
    across = 0.5 * lane.getWidth() * np.array([-along[1], along[0]])
    return np.stack((end - across, end + across))
