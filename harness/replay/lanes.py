"""The lane and position of a point on the net, which SUMO's replay needs beside the coordinates."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.traffic.xml_file import parse_xml

_NOT_FOR_VEHICLES = {"crossing", "walkingarea"}


@dataclass(frozen=True, kw_only=True)
class Lanes:
    """The lanes of a net [L]: centre lines, SUMO's lengths (m), and for each lane the lane of an edge that it leads to:
    itself, or for a lane inside a junction the one after it."""

    ids: tuple[str, ...]
    centre_lines: tuple[FloatArray, ...]
    length_m: FloatArray
    onward: IntArray

    @classmethod
    def read(cls, net_file: Path) -> Lanes:
        root = parse_xml(net_file)
        ids, shapes, lengths = [], [], []
        for edge in root.iter("edge"):
            if edge.get("function") not in _NOT_FOR_VEHICLES:
                for lane in edge.iter("lane"):
                    ids.append(str(lane.get("id")))
                    points = [[float(c) for c in point.split(",")[:2]] for point in lane.get("shape", "").split()]
                    shapes.append(np.array(points))
                    lengths.append(float(lane.get("length", "nan")))
        row = {name: number for number, name in enumerate(ids)}
        onward = np.arange(len(ids))
        for connection in root.iter("connection"):
            inside = row.get(f"{connection.get('from')}_{connection.get('fromLane')}")
            after = row.get(f"{connection.get('to')}_{connection.get('toLane')}")
            if inside is not None and after is not None and ids[inside].startswith(":"):
                onward[inside] = after
        return cls(ids=tuple(ids), centre_lines=tuple(shapes), length_m=np.array(lengths), onward=onward)

    def bounds(self) -> tuple[float, float, float, float]:
        """min x, min y, max x, max y of all centre lines (m)."""
        points = np.concatenate(self.centre_lines)
        (left, bottom), (right, top) = points.min(0), points.max(0)
        return float(left), float(bottom), float(right), float(top)

    def locate(self, points_m: FloatArray, starts: BoolArray) -> IntArray:
        """Nearest lane [N] (row of `ids`) of points [N, 2].

        A point off the road gets the nearest lane. A vehicle can only be inserted on a lane outside junctions: points
        that are `starts` [N] get one of those.
        """
        lines = self._lines()
        points = shapely.points(points_m)
        lane = np.empty(len(points), dtype=np.int64)
        all_lanes = np.arange(len(lines))
        for chosen, usable in ((~starts, all_lanes), (starts, all_lanes[self.onward == all_lanes])):
            if chosen.any():
                lane[chosen] = usable[shapely.STRtree(lines[usable]).nearest(points[chosen])]
        return lane

    def position(self, lane: IntArray, points_m: FloatArray) -> FloatArray:
        """Position along lanes [N] of the place nearest to points [N, 2] (m) [N]."""
        share = shapely.line_locate_point(self._lines()[lane], shapely.points(points_m), normalized=True)
        return np.clip(share, 0.0, 1.0) * self.length_m[lane]

    def _lines(self) -> np.ndarray:
        return np.array([shapely.LineString(line) for line in self.centre_lines], dtype=object)
