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
from harness.road.net.surface import cross_section
from harness.road.scene.open_scene import OpenScene

_WALKERS_GOAL_M = 2.0  # length of the line at the end of a way


def surfaces(net: Net) -> list[list[FloatArray]]:
    """The drivable area as polygons. Each polygon is a list of rings [n, 2]: its outline, then its holes."""
    polygons = [part for part in shapely.get_parts(drivable_area(net)) if part.geom_type == "Polygon"]
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
    return [np.asarray(part.coords) for part in shapely.get_parts(line) if len(part.coords) > 1]


def goal_lines(scene: OpenScene, net: Net) -> list[FloatArray]:
    """The lines [2, 2] across the lanes at the players' goals, one for each goal, and across the ends of ways."""
    players = scene.document.players
    goals = {scene.document.goal_of(player)[1] for player in players if not player.on_foot}
    ways = [np.array(player.way) for player in players if player.way is not None]
    lines = [_goal_line(goal, net) for goal in sorted(goals, key=lambda goal: (goal.edge, goal.position_m))]
    return lines + [cross_section(way[-1], way[-1] - way[-2], _WALKERS_GOAL_M) for way in ways]


def _goal_line(goal: Goal, net: Net) -> FloatArray:
    ends = []
    for lane in car_lanes(net.getEdge(goal.edge)):
        line = shapely.LineString(lane_line(lane))
        place = min(goal.position_m / lane.getLength(), 1.0) * line.length
        stations_m = (max(place - 0.5, 0.0), place, place + 0.5)
        before, here, after = shapely.get_coordinates(shapely.line_interpolate_point(line, stations_m))
        ends += [*cross_section(here, after - before, lane.getWidth())]
    return np.array([ends[0], ends[-1]])
