"""The conflicts at the junctions of a net, for tables and drawings: where two connections cross or merge."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from itertools import combinations

import numpy as np
from shapely.geometry.base import BaseGeometry
from sumolib.net import Net
from sumolib.net.connection import Connection

from harness.game.arrays import FloatArray
from harness.road.net.network import lane_line
from harness.road.net.right_of_way_table import foes_of, overlap_of, yields_to
from harness.road.net.stream import Feeders, Stream


class Priority(Enum):
    """Which of two connections has priority, apart from signals."""

    FIRST = auto()
    FIRST_TO_ARRIVE = auto()
    NONE = auto()  # the net has no rule


@dataclass(frozen=True, kw_only=True)
class ListedConflict:
    """A conflict of two connections of a junction. If one of them has priority, it is the first."""

    number: int
    junction: str
    merging: bool  # both lead to the same lane; else they cross
    first: tuple[str, str]
    """The lanes before and behind the junction."""
    second: tuple[str, str]
    priority: Priority
    with_signals: bool
    place: FloatArray  # [2] where they cross, or where the common lane begins


def listed_conflicts(net: Net, junctions: Sequence[str]) -> list[ListedConflict]:
    """The conflicts at junctions, numbered from 1 in the order of the junctions."""
    feeders = Feeders(net)
    found: list[ListedConflict] = []
    for junction in junctions:
        links = net.getNode(junction).getConnections()
        streams = {link: Stream(link, feeders) for link in links}
        for one, other in foe_pairs(links):
            overlap = overlap_of(streams[one], streams[other])
            if overlap is None:
                continue
            first, second, priority = in_order(one, other)
            found.append(
                ListedConflict(
                    number=len(found) + 1,
                    junction=junction,
                    merging=one.getToLane() is other.getToLane(),
                    first=(first.getFromLane().getID(), first.getToLane().getID()),
                    second=(second.getFromLane().getID(), second.getToLane().getID()),
                    priority=priority,
                    with_signals=bool(one.getTLSID() or other.getTLSID()),
                    place=place_of(one, other, overlap),
                )
            )
    return found


def foe_pairs(links: Sequence[Connection]) -> Iterator[tuple[Connection, Connection]]:
    """The connections of a junction whose traffic may be in conflict, two by two."""
    foes = {link: set(foes_of(link)) for link in links}
    for one, other in combinations(links, 2):
        if other in foes[one] and one in foes[other]:
            yield one, other


def in_order(one: Connection, other: Connection) -> tuple[Connection, Connection, Priority]:
    """Two connections and their priority; if one of them has it, it is the first."""
    one_yields, first_come = yields_to(one, other)
    other_yields, _ = yields_to(other, one)
    if first_come:
        return one, other, Priority.FIRST_TO_ARRIVE
    if not one_yields and not other_yields:
        return one, other, Priority.NONE
    return (other, one, Priority.FIRST) if one_yields else (one, other, Priority.FIRST)


def place_of(one: Connection, other: Connection, overlap: BaseGeometry) -> FloatArray:
    """[2] where two connections with a common area cross, or where the lane begins to which both lead."""
    if one.getToLane() is other.getToLane():
        return lane_line(one.getToLane())[0]
    return np.array(overlap.centroid.coords[0])
