"""The lanes of an edge that a kind of road user travels on."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from sumolib.net.edge import Edge
from sumolib.net.lane import Lane

from harness.config.road_user import CYCLING, Kind
from harness.traffic.network import car_lanes

LanesOf: TypeAlias = Callable[[Edge], list[Lane]]


def lanes_for(kind: Kind) -> LanesOf:
    """The lanes of an edge for a kind, in SUMO's order."""
    return bicycle_lanes if kind in CYCLING else car_lanes


def bicycle_lanes(edge: Edge) -> list[Lane]:
    """The edge's lanes for bicycles alone; without any, the rightmost lane that admits them: it may be a pavement."""
    admit = [lane for lane in edge.getLanes() if lane.allows("bicycle")]
    alone = [lane for lane in admit if not lane.allows("passenger") and not lane.allows("pedestrian")]
    return alone or admit[:1]
