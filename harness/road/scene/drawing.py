"""Shapes for drawings of a net: the road surface, the marks between lanes, and the goal."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import shapely
from sumolib.net import Net
from sumolib.net.lane import Lane

from harness.config.scene import Goal
from harness.game.arrays import FloatArray
from harness.road.net.lane_map import is_left
from harness.road.net.network import car_lanes, drivable_area, lane_line, paved_lanes
from harness.road.scene.open_scene import OpenScene

_WALKERS_GOAL_M = 2.0  # length of the line at the end of a way


def surfaces(net: Net) -> list[list[FloatArray]]:
    """The drivable area as polygons. Each polygon is a list of rings [n, 2]: its outline, then its holes."""
    area = drivable_area(net)
    polygons = [part for part in getattr(area, "geoms", [area]) if part.geom_type == "Polygon"]
    return [[np.asarray(ring.coords) for ring in (part.exterior, *part.interiors)] for part in polygons]


def lane_marks(net: Net) -> list[FloatArray]:
    """The lines [n, 2] between neighbouring lanes of an edge."""
    pairs = (pair for edge in net.getEdges(withInternal=False) for pair in pairwise(car_lanes(edge)))
    return [line for outer, inner in pairs for line in _lines_between(outer, inner)]


def edge_lines(net: Net) -> list[FloatArray]:
    """The lines [n, 2] between a lane of cars and a paved lane beside it that is none, such as a hard shoulder."""
    pairs = (pair for edge in net.getEdges(withInternal=True) for pair in pairwise(paved_lanes(edge)))
    mixed = ((outer, inner) for outer, inner in pairs if outer.allows("passenger") != inner.allows("passenger"))
    return [line for outer, inner in mixed for line in _lines_between(outer, inner)]


def _lines_between(outer: Lane, inner: Lane) -> list[FloatArray]:
    """The lines [n, 2] at the inner side of a lane: SUMO counts an edge's lanes from its outer side."""
    side = 1.0 if is_left(outer, inner) else -1.0  # left where traffic keeps right
    line = shapely.LineString(lane_line(outer)).offset_curve(side * outer.getWidth() / 2.0, join_style="mitre")
    return [np.asarray(part.coords) for part in getattr(line, "geoms", [line]) if len(part.coords) > 1]


def goal_lines(scene: OpenScene, net: Net) -> list[FloatArray]:
    """The lines [2, 2] across the lanes at the players' goals, one for each goal, and across the ends of ways."""
    players = scene.document.players
    goals = {scene.document.goal_of(player)[1] for player in players if not player.on_foot}
    ways = [np.array(player.way) for player in players if player.way is not None]
    lines = [_goal_line(goal, net) for goal in sorted(goals, key=lambda goal: (goal.edge, goal.position_m))]
    return lines + [_end_of(way) for way in ways]


def _end_of(way: FloatArray) -> FloatArray:
    along = way[-1] - way[-2]
    across = 0.5 * _WALKERS_GOAL_M * np.array([-along[1], along[0]]) / np.hypot(*along)
    return np.array([way[-1] - across, way[-1] + across])


def _goal_line(goal: Goal, net: Net) -> FloatArray:
    ends = []
    for lane in car_lanes(net.getEdge(goal.edge)):
        line = shapely.LineString(lane_line(lane))
        place = min(goal.position_m / lane.getLength(), 1.0) * line.length
        here, before = (np.array(line.interpolate(each).coords[0]) for each in (place, max(place - 0.5, 0.0)))
        after = np.array(line.interpolate(place + 0.5).coords[0])
        along = (after - before) / max(float(np.hypot(*(after - before))), 1e-9)
        across = 0.5 * lane.getWidth() * np.array([-along[1], along[0]])
        ends += [here - across, here + across]
    return np.array([ends[0], ends[-1]])
