"""Conflicts at the junctions of a net, and candidates for games: places where the ways of two road users meet.

Connections of the same two pairs of edges are one candidate, whatever their lanes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum, auto
from functools import lru_cache
from itertools import chain, combinations

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry
from shapely.ops import substring
from sumolib.net import Net
from sumolib.net.connection import Connection
from sumolib.net.edge import Edge
from sumolib.net.lane import Lane
from sumolib.net.node import Node

from harness.game.arrays import FloatArray
from harness.road.net.network import car_lanes, is_for_cars, lane_line
from harness.road.net.right_of_way_table import foes_of, overlap_of, yields_to
from harness.road.net.route_table import line_over_junction
from harness.road.net.stream import Feeders, Stream
from harness.road.net.surface import unit

_OPPOSITE = -0.7  # cosine of the angle between two approaches that come towards each other
_STRAIGHT = 0.87  # of the angle by which a way over a junction turns
_FORK = 3  # arms of a junction at which all ways may turn; elsewhere, two ways that turn make no scene
_BESIDE_M = 6.0  # of a junction, in which a crossing may be


class Priority(Enum):
    """Which of two connections has priority, apart from signals."""

    FIRST = auto()
    FIRST_TO_ARRIVE = auto()
    NONE = auto()  # the net has no rule


class CandidateKind(Enum):
    """The kinds of candidates, in the order in which they are numbered."""

    TURN_ACROSS = "turn across"
    CROSSING = "crossing"
    ROUNDABOUT = "roundabout entry"
    MERGE = "merge"
    LANE_END = "lane end"
    ZEBRA = "zebra crossing"
    FOLLOWING = "following"


@dataclass(frozen=True, kw_only=True, slots=True)
class LaneWay:
    """A way of cars over a junction, between two lanes."""

    start: Lane
    end: Lane

    @classmethod
    def of(cls, link: Connection) -> LaneWay:
        return cls(start=link.getFromLane(), end=link.getToLane())

    @property
    def edges(self) -> tuple[str, str]:
        """The edges before and behind the junction."""
        return self.start.getEdge().getID(), self.end.getEdge().getID()


@dataclass(frozen=True, kw_only=True, slots=True)
class Candidate:
    """A place where two ways meet. The first is the ego's: the one with priority, if a vehicle has it."""

    kind: CandidateKind
    junction: str
    first: LaneWay
    second: LaneWay | None  # None at a zebra crossing: the second is on foot
    place: FloatArray  # [2] where they cross, or where the common lane begins
    priority: Priority = Priority.NONE
    with_signals: bool = False
    footway: FloatArray | None = None  # [2, 2] middle line of a zebra crossing

    @property
    def order(self) -> tuple[int, str, tuple[str, ...], tuple[str, ...]]:
        """By kind, then by name."""
        second = self.second.edges if self.second is not None else ()
        return list(CandidateKind).index(self.kind), self.junction, self.first.edges, second


def listed_conflicts(net: Net, junctions: Sequence[str]) -> list[Candidate]:
    """The conflicts at junctions, lane by lane, in the order of the junctions: each a merge or a crossing."""
    feeders = Feeders(net)
    found: list[Candidate] = []
    for junction in junctions:
        links = net.getNode(junction).getConnections()
        streams = {link: Stream(link, feeders) for link in links}
        for one, other in foe_pairs(links):
            overlap = overlap_of(streams[one], streams[other])
            if overlap is not None:
                merging = one.getToLane() is other.getToLane()
                found.append(_conflict(CandidateKind.MERGE if merging else CandidateKind.CROSSING, one, other, overlap))
    return found


def _conflict(kind: CandidateKind, one: Connection, other: Connection, overlap: BaseGeometry) -> Candidate:
    """The conflict of two connections with a common area. If one of them has priority, it is the first."""
    one_yields, first_come = yields_to(one, other)
    other_yields, _ = yields_to(other, one)
    if first_come:
        priority = Priority.FIRST_TO_ARRIVE
    else:
        priority = Priority.FIRST if one_yields or other_yields else Priority.NONE
    first, second = (other, one) if one_yields and priority is Priority.FIRST else (one, other)
    merging = one.getToLane() is other.getToLane()
    return Candidate(
        kind=kind,
        junction=one.getJunction().getID(),
        first=LaneWay.of(first),
        second=LaneWay.of(second),
        place=lane_line(one.getToLane())[0] if merging else np.array(overlap.centroid.coords[0]),
        priority=priority,
        with_signals=bool(one.getTLSID() or other.getTLSID()),
    )


def foe_pairs(links: Sequence[Connection]) -> Iterator[tuple[Connection, Connection]]:
    """The connections of a junction whose traffic may be in conflict, two by two."""
    foes = {link: set(foes_of(link)) for link in links}
    for one, other in combinations(links, 2):
        if other in foes[one] and one in foes[other]:
            yield one, other


def candidates(net: Net) -> list[Candidate]:
    """The places where two ways meet on a net, in the order of their numbers."""
    feeders, rings = Feeders(net), ring_edges(net)
    nodes = sorted(net.getNodes(), key=lambda node: str(node.getID()))
    crossings = [edge for edge in net.getEdges(withInternal=True) if edge.getFunction() == "crossing"]
    everything = chain(
        chain.from_iterable(_at_junction(node, feeders, rings) for node in nodes),
        chain.from_iterable(_zebra(net, crossing) for crossing in crossings),
        chain.from_iterable(_lane_ends(edge) for edge in net.getEdges(withInternal=False)),
    )
    found: dict[tuple[object, ...], Candidate] = {}
    for each in everything:
        found.setdefault(each.order, each)
    return sorted(found.values(), key=lambda each: each.order)


def for_cars(links: Iterable[Connection]) -> list[Connection]:
    """The connections that cars may use, without turnarounds."""
    return [
        link for link in links if is_for_cars(link) and not link.getFrom().isSpecial() and not link.getTo().isSpecial()
    ]


def onward(edge: Edge) -> list[Connection]:
    """The connections from an edge that cars may use."""
    return for_cars(link for links in edge.getOutgoing().values() for link in links)


def ring_edges(net: Net) -> set[str]:
    """The edges of the roundabouts of a net."""
    return {name for each in net.getRoundabouts() for name in each.getEdges()}


def _at_junction(node: Node, feeders: Feeders, rings: set[str]) -> Iterator[Candidate]:
    links = for_cars(node.getConnections())
    if len(links) < 2:
        return
    arms = len({link.getFrom() for link in links})
    streams = {link: Stream(link, feeders) for link in links}
    seen: set[tuple[object, ...]] = set()
    for one, other in foe_pairs(links):
        key = (one.getFrom(), one.getTo(), other.getFrom(), other.getTo(), one.getToLane() is other.getToLane())
        kind = _kind(one, other, rings, arms) if key not in seen else None
        overlap = overlap_of(streams[one], streams[other]) if kind is not None else None
        if kind is None or overlap is None:
            continue
        seen.add(key)
        found = _conflict(kind, one, other, overlap)
        straighter = float(_out(one) @ _into(one)) >= float(_out(other) @ _into(other))
        if found.priority is Priority.FIRST or straighter:
            yield found
        else:  # of equal ones, the straighter way is the ego's
            yield replace(found, first=LaneWay.of(other), second=LaneWay.of(one))


def _kind(one: Connection, other: Connection, rings: set[str], arms: int) -> CandidateKind | None:
    """The kind of a conflict of two connections of a junction with so many arms; None for one that makes no scene."""
    if one.getFromLane() is other.getFromLane():
        return None
    if one.getFrom() is other.getFrom():
        return CandidateKind.LANE_END if one.getToLane() is other.getToLane() else None
    in_ring = [link.getFrom().getID() in rings for link in (one, other)]
    if any(in_ring):
        return None if all(in_ring) else CandidateKind.ROUNDABOUT
    turns = [float(_out(link) @ _into(link)) < _STRAIGHT for link in (one, other)]
    if all(turns) and arms > _FORK:
        return None
    if one.getToLane() is other.getToLane():
        return CandidateKind.MERGE
    opposite = float(_into(one) @ _into(other)) < _OPPOSITE
    return CandidateKind.TURN_ACROSS if opposite and any(turns) else CandidateKind.CROSSING


def _lane_ends(edge: Edge) -> Iterator[Candidate]:
    lanes = car_lanes(edge)
    leading = {lane: for_cars(lane.getOutgoing()) for lane in lanes}
    for lane in lanes:
        beside = [each for each in lanes if abs(each.getIndex() - lane.getIndex()) == 1 and leading[each]]
        if leading[lane] or not beside:
            continue
        through = leading[beside[-1]][0]
        yield Candidate(
            kind=CandidateKind.LANE_END,
            junction=edge.getToNode().getID(),
            first=LaneWay.of(through),
            second=LaneWay(start=lane, end=through.getToLane()),
            priority=Priority.FIRST,
            place=lane_line(lane)[-1],
        )


def _zebra(net: Net, crossing: Edge) -> Iterator[Candidate]:
    """The ways of cars, as straight as there are, over a crossing for people on foot that has no signals."""
    node, line = crossing.getFromNode(), lane_line(crossing.getLane(0))
    if "traffic_light" in node.getType() or "rail" in node.getType():
        return
    for edge in node.getIncoming():
        link = max(onward(edge), key=lambda link: float(_out(link) @ _into(link)), default=None)
        if link is not None and shapely.intersects(shapely.LineString(line), way_over(net, link)):
            yield Candidate(
                kind=CandidateKind.ZEBRA,
                junction=node.getID(),
                first=LaneWay.of(link),
                second=None,
                place=line.mean(axis=0),
                footway=np.stack((line[0], line[-1])),
            )


def way_over(net: Net, link: Connection) -> shapely.LineString:
    """The way of a connection over its junction, with the ends of its lanes in which a crossing may be."""
    incoming = shapely.LineString(lane_line(link.getFromLane()))
    before = substring(incoming, max(incoming.length - _BESIDE_M, 0.0), incoming.length)
    behind = substring(shapely.LineString(lane_line(link.getToLane())), 0.0, _BESIDE_M)
    ends = [shapely.get_coordinates(each) for each in (before, behind)]
    return shapely.LineString(np.concatenate((ends[0], line_over_junction(net, link), ends[1])))


def following(net: Net) -> Iterator[Candidate]:
    """The longest roads of a net, on which one player may follow the other."""
    edges = [edge for edge in net.getEdges(withInternal=False) if car_lanes(edge)]
    for edge in sorted(edges, key=lambda edge: (-edge.getLength(), edge.getID()))[:10]:
        lane = car_lanes(edge)[0]
        way = LaneWay(start=lane, end=lane)
        line = lane_line(lane)
        yield Candidate(
            kind=CandidateKind.FOLLOWING,
            junction=edge.getToNode().getID(),
            first=way,
            second=way,
            place=line.mean(axis=0),
        )


@lru_cache(maxsize=64)
def _into(link: Connection) -> FloatArray:
    """[2] the unit direction in which a connection enters its junction."""
    before, end = lane_line(link.getFromLane())[-2:]
    return unit(end - before)


@lru_cache(maxsize=64)
def _out(link: Connection) -> FloatArray:
    """[2] the unit direction in which it leaves the junction."""
    begin, behind = lane_line(link.getToLane())[:2]
    return unit(behind - begin)
