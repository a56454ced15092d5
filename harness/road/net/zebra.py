"""Marked crossings: whether a way follows one of the net, where vehicles must yield, and its stripes, for drawings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry
from sumolib.net import Net

from harness.game.arrays import FloatArray
from harness.road.net.network import lane_line

_STRIPE_M, _LONG_M = 0.5, 4.0  # along the way, and across it
_LEAST_M = 1.0  # of the carriageway on a way


_FOLLOWED_SHARE = 0.5  # of the length of a crossing


def follows_crossing(net: Net, way: shapely.LineString) -> bool:
    """Whether a way crosses a road on a crossing of the net: it keeps to the crossing for most of its length."""
    for edge in net.getEdges(withInternal=True):
        if edge.getFunction() == "crossing":
            line = shapely.LineString(lane_line(edge.getLane(0)))
            area = line.buffer(0.5 * edge.getLane(0).getWidth(), cap_style="flat")
            if way.intersection(area).length > _FOLLOWED_SHARE * line.length:
                return True
    return False


def stripes(ways: Sequence[FloatArray], carriageway: BaseGeometry) -> Iterator[FloatArray]:
    """The corners [5, 2] of each stripe where ways [n, 2] pass the carriageway: half of its width is painted."""
    for way in ways:
        for part in shapely.get_parts(shapely.intersection(shapely.LineString(way), carriageway)):
            if part.length >= _LEAST_M:
                yield from _painted(shapely.get_coordinates(part))


def _painted(ends: FloatArray) -> Iterator[FloatArray]:
    line = shapely.LineString(ends)
    for station_m in np.arange(_STRIPE_M, line.length, 2.0 * _STRIPE_M):
        near, far = (
            shapely.get_coordinates(line.interpolate(station_m + side * 0.5 * _STRIPE_M))[0] for side in (-1.0, 1.0)
        )
        along = (far - near) / np.hypot(*(far - near))
        across = 0.5 * _LONG_M * np.array([-along[1], along[0]])
        yield np.array([near - across, far - across, far + across, near + across, near - across])
