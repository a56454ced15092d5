"""The way of a person over a zebra crossing: along the pavement, then across the road to the other pavement."""

from __future__ import annotations

import numpy as np
import shapely
from shapely.ops import substring
from sumolib.net.edge import Edge
from sumolib.net.lane import Lane

from harness.game.arrays import FloatArray
from harness.maps.candidates import Candidate
from harness.road.net.network import lane_line

_FARTHEST_M = 12.0  # between the end of a crossing and that of a pavement
_ONTO_M = 1.5  # of the pavement at the end of the way


def way_over(candidate: Candidate, before_m: float) -> FloatArray | None:
    """[n, 2] a way that comes from the side nearer to the ego's approach, with up to `before_m` of pavement before the
    road; None where a side has no pavement."""
    assert candidate.footway is not None, "only zebra crossings have a footway"
    ego_end = lane_line(candidate.first.start)[-1]
    near, far = sorted(candidate.footway, key=lambda point: float(np.hypot(*(point - ego_end))))
    lanes = _pavements(candidate.first.start.getEdge(), candidate.first.end.getEdge())
    come, go = _nearest(lanes, near, before_m), _nearest(lanes, far, _ONTO_M)
    if come is None or go is None:
        return None
    return _without_repeats(np.concatenate((come[::-1], [near], [far], go)))


def _pavements(*edges: Edge) -> list[Lane]:
    """The lanes for people on foot alone beside the edges of a junction."""
    nodes = {edges[0].getToNode(), edges[-1].getFromNode()}
    around = {edge for node in nodes for edge in (*node.getIncoming(), *node.getOutgoing()) if not edge.isSpecial()}
    lanes = [lane for edge in sorted(around, key=lambda edge: str(edge.getID())) for lane in edge.getLanes()]
    return [lane for lane in lanes if lane.allows("pedestrian") and not lane.allows("passenger")]


def _nearest(lanes: list[Lane], point: FloatArray, length_m: float) -> FloatArray | None:
    """[n, 2] the pavement that begins or ends nearest to a point, from there on for up to a length."""
    lines = [line for lane in lanes for line in (lane_line(lane), lane_line(lane)[::-1])]
    line = min(lines, key=lambda line: float(np.hypot(*(line[0] - point))), default=None)
    if line is None or float(np.hypot(*(line[0] - point))) > _FARTHEST_M:
        return None
    return shapely.get_coordinates(substring(shapely.LineString(line), 0.5, 0.5 + length_m))


def _without_repeats(points: FloatArray) -> FloatArray:
    apart = np.hypot(*np.diff(points, axis=0).T) > 0.05
    return points[np.concatenate(([True], apart))]
