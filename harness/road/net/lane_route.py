"""The lanes of a route over the edges of a SUMO net: those that its line follows, and how far each lane leads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from sumolib.net.connection import Connection
from sumolib.net.edge import Edge
from sumolib.net.lane import Lane

from harness.road.net.network import car_lanes
from harness.road.net.own_lanes import LanesOf


@dataclass(frozen=True)
class LaneRoute:
    """A route along connected edges, which a player travels on some of their lanes."""

    edges: Sequence[Edge]
    _: KW_ONLY
    lanes_of: LanesOf = car_lanes
    """The lanes of an edge that the player may use."""
    start: Lane | None = None
    """The lane of the first edge in which the player starts. None: any."""

    @cached_property
    def links(self) -> list[Connection]:
        """The connections that the route's line follows, one between each two edges: those with the fewest changes of
        lane from the start to the end; of these, the leftmost.

        Raises ValueError if consecutive edges are not connected.
        """
        onward: dict[str, tuple[int, list[Connection]]] = {lane.getID(): (0, []) for lane in self.edges[-1].getLanes()}
        for k, links in reversed(list(enumerate(self.choices))):
            if not links:
                names = [each.getID() for each in self.edges[k : k + 2]]
                raise ValueError(f"has no connection from edge {names[0]!r} to {names[1]!r}")
            onward = {lane.getID(): _fewest_changes(lane, links, onward) for lane in self.edges[k].getLanes()}
        if self.start is not None:
            return onward[self.start.getID()][1]
        starts = self.lanes_of(self.edges[0]) or self.edges[0].getLanes()
        return min((onward[lane.getID()] for lane in reversed(starts)), key=lambda each: each[0])[1]

    @cached_property
    def entries(self) -> list[Lane]:
        """The lane of each edge at which the route's line begins. On the first edge it is the lane that the line leaves
        it by."""
        first = self.links[0].getFromLane() if self.links else self.start or self.lanes_of(self.edges[0])[-1]
        return [first, *(link.getToLane() for link in self.links)]

    @cached_property
    def choices(self) -> list[list[Connection]]:
        """Between each two edges: the connections on lanes that the player may use."""
        lanes = [self.lanes_of(edge) for edge in self.edges]
        return [
            [
                link
                for link in edge.getConnections(following)
                if link.getFromLane() in starts and link.getToLane() in ends
            ]
            for (edge, starts), (following, ends) in pairwise(zip(self.edges, lanes, strict=True))
        ]

    def lane_ends(self, end_of_edge_m: Sequence[float]) -> list[dict[str, float]]:
        """For each edge, by lane: the station where the lane stops leading along the route; inf if it never does.
        `end_of_edge_m` are the stations of the ends of the edges."""
        ends = [{lane.getID(): np.inf for lane in self.lanes_of(self.edges[-1])}]
        for k, links in reversed(list(enumerate(self.choices))):
            following = ends[0]
            of_lanes = {}
            for lane in self.lanes_of(self.edges[k]):
                reached = [following[link.getToLane().getID()] for link in links if link.getFromLane() is lane]
                of_lanes[lane.getID()] = max(reached, default=end_of_edge_m[k])
            ends.insert(0, of_lanes)
        return ends


def _fewest_changes(
    lane: Lane, links: Sequence[Connection], onward: dict[str, tuple[int, list[Connection]]]
) -> tuple[int, list[Connection]]:
    """The number of changes of lane from a lane to the end of a route, and the connections on the way: the best of
    `links` from the lane's edge, and what follows. `onward` has the same for the lanes of the next edge."""

    def changes(link: Connection) -> int:
        return abs(link.getFromLane().getIndex() - lane.getIndex()) + onward[link.getToLane().getID()][0]

    best = min(links, key=lambda link: (changes(link), -link.getFromLane().getIndex(), -link.getToLane().getIndex()))
    return changes(best), [best, *onward[best.getToLane().getID()][1]]
