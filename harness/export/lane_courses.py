"""The courses of a net's lanes: lanes that continue one another have one number, which changes with a lane change and
not with an edge."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import shapely

from harness.game.arrays import FloatArray, IntArray
from harness.replay.floating_car_data import Lanes
from harness.road.net.lane_map import neighbours
from harness.road.net.network import read_net
from harness.road.xml.xml_file import parse_xml

NONE = -1
_WIDTH_M = 3.2
"""Of a lane without a width in the net."""
_STRAIGHT_M = 0.05
"""A lane along x has all its points within this distance of one y."""


@dataclass(frozen=True, kw_only=True)
class LaneCourses:
    """The lanes [L] of a net for vehicles, and their courses [C], numbered from the greatest y of their middle on."""

    lanes: Lanes
    course: IntArray
    """[L] the course of each lane; of a lane inside a junction, that of the lane after it."""
    left: IntArray
    """[L] the course of the lane to the left of each lane; NONE without one."""
    right: IntArray
    lines: tuple[FloatArray, ...]
    """[C] centre lines [n, 2]; straight through junctions."""
    bounds_m: tuple[float, float, float, float]
    """min x, min y, max x, max y of all lanes."""
    speed_limit_mps: float
    """The highest of any lane."""
    markings_y_m: tuple[tuple[float, ...], tuple[float, ...]]
    """The edges of lanes that lie along x: of those towards smaller and towards greater x, from the greatest y on."""

    @classmethod
    def read(cls, net_file: Path) -> LaneCourses:
        """Raises UsageError for a net that can't be read, or has no lane for cars."""
        root, lanes = parse_xml(net_file), Lanes.read(net_file)
        row = {name: number for number, name in enumerate(lanes.ids)}
        after = _continuations(root, lanes, row)
        chains = _chains(lanes, after)
        middles = [np.mean([lanes.centre_lines[lane].mean(0)[1] for lane in chain]) for chain in chains]
        chains = [chains[place] for place in np.argsort(-np.array(middles), kind="stable")]
        course: IntArray = np.full(len(lanes.ids), NONE)
        for number, chain in enumerate(chains):
            course[chain] = number
        course = course[lanes.onward]
        net = read_net(net_file)
        left, right = (
            np.array([NONE if name is None else course[row[name]] for name in names])
            for names in zip(*(neighbours(net.getLane(name)) for name in lanes.ids), strict=True)
        )
        return cls(
            lanes=lanes,
            course=course,
            left=left,
            right=right,
            lines=tuple(np.concatenate([lanes.centre_lines[lane] for lane in chain]) for chain in chains),
            bounds_m=_bounds(root, lanes),
            speed_limit_mps=max(float(lane.get("speed", "nan")) for lane in root.iter("lane")),
            markings_y_m=_markings(root),
        )

    def lanes_of(self, points_m: FloatArray) -> IntArray:
        """[N] the lanes of one road user, from its places [N, 2] in order of time; in a junction the lane before it."""
        nearest = self.lanes.locate(points_m, np.zeros(len(points_m), dtype=bool))
        inside = np.array([self.lanes.ids[lane].startswith(":") for lane in nearest])
        if inside.all():
            return self.lanes.onward[nearest]
        last = np.maximum.accumulate(np.where(inside, -1, np.arange(len(nearest))))
        return nearest[np.where(last < 0, np.argmin(inside), last)]

    def stations(self, points_m: FloatArray) -> FloatArray:
        """[N, C] the places along each course (m) that are nearest to points [N, 2]."""
        points = shapely.points(points_m)
        return np.stack([shapely.line_locate_point(shapely.LineString(line), points) for line in self.lines], axis=-1)


def _bounds(root: ElementTree.Element, lanes: Lanes) -> tuple[float, float, float, float]:
    left, bottom, right, top = lanes.bounds()
    half_m = 0.5 * max(float(lane.get("width", _WIDTH_M)) for lane in root.iter("lane"))
    return left - half_m, bottom - half_m, right + half_m, top + half_m


def _continuations(root: ElementTree.Element, lanes: Lanes, row: dict[str, int]) -> dict[int, int]:
    """For each lane outside junctions the lane that continues it: each lane continues one other at most, and those with
    the least turn and offset come first."""
    pairs = []
    for each in root.iter("connection"):
        first = row.get(f"{each.get('from')}_{each.get('fromLane')}")
        then = row.get(f"{each.get('to')}_{each.get('toLane')}")
        if first is not None and then is not None and not lanes.ids[first].startswith(":"):
            before, behind = lanes.centre_lines[first], lanes.centre_lines[then]
            way = before[-1] - before[-2]
            gap, onward = behind[0] - before[-1], behind[1] - behind[0]
            turn = abs(np.angle(np.exp(1j * (np.arctan2(*onward[::-1]) - np.arctan2(*way[::-1])))))
            offset_m = abs(float(way[0] * gap[1] - way[1] * gap[0])) / float(np.hypot(*way))
            pairs.append((turn + 0.1 * offset_m, first, then))
    after: dict[int, int] = {}
    for _, first, then in sorted(pairs):
        if first not in after and then not in after.values():
            after[first] = then
    return after


def _chains(lanes: Lanes, after: dict[int, int]) -> list[list[int]]:
    outside = [lane for lane, name in enumerate(lanes.ids) if not name.startswith(":")]
    firsts = [lane for lane in outside if lane not in after.values()]
    chains, seen = [], set[int]()
    for first in [*firsts, *outside]:  # a circle has no first lane
        chain, lane = [], first
        while lane not in seen:
            seen.add(lane)
            chain.append(lane)
            lane = after.get(lane, lane)
        if chain:
            chains.append(chain)
    return chains


def _markings(root: ElementTree.Element) -> tuple[tuple[float, ...], tuple[float, ...]]:
    edges: tuple[set[float], set[float]] = (set(), set())
    for lane in root.iter("lane"):
        points = np.array([[float(c) for c in point.split(",")[:2]] for point in lane.get("shape", "").split()])
        if lane.get("id", ":").startswith(":") or np.ptp(points[:, 1]) > _STRAIGHT_M:
            continue
        half_m, y_m = 0.5 * float(lane.get("width", _WIDTH_M)), float(points[:, 1].mean())
        edges[int(points[-1, 0] > points[0, 0])].update((round(y_m - half_m, 2), round(y_m + half_m, 2)))
    leftwards, rightwards = (tuple(sorted(each, reverse=True)) for each in edges)
    return leftwards, rightwards
