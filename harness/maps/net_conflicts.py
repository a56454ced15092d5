"""The conflicts at the junctions of a net, for tables and drawings: where two connections cross or merge."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from itertools import combinations

import numpy as np
from sumolib.net import Net
from sumolib.net.connection import Connection
from sumolib.net.node import Node

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
    for name in junctions:
        for first, second, place in _conflicts(net.getNode(name), feeders):
            found.append(_listed(len(found) + 1, name, one=first, other=second, place=place))
    return found


def _conflicts(node: Node, feeders: Feeders) -> Iterator[tuple[Connection, Connection, FloatArray]]:
    foes = {link: set(foes_of(link)) for link in node.getConnections()}
    streams = {link: Stream(link, feeders) for link in foes}
    for one, other in combinations(foes, 2):
        if other not in foes[one] or one not in foes[other]:
            continue
        overlap = overlap_of(streams[one], streams[other])
        if overlap is not None:
            merging = one.getToLane() is other.getToLane()
            place = lane_line(one.getToLane())[0] if merging else np.array(overlap.centroid.coords[0])
            yield one, other, place


def _listed(number: int, junction: str, *, one: Connection, other: Connection, place: FloatArray) -> ListedConflict:
    one_yields, first_come = yields_to(one, other)
    other_yields, _ = yields_to(other, one)
    first, second = (other, one) if one_yields and not first_come else (one, other)
    priority = Priority.FIRST if one_yields or other_yields else Priority.NONE
    return ListedConflict(
        number=number,
        junction=junction,
        merging=one.getToLane() is other.getToLane(),
        first=(first.getFromLane().getID(), first.getToLane().getID()),
        second=(second.getFromLane().getID(), second.getToLane().getID()),
        priority=Priority.FIRST_TO_ARRIVE if first_come else priority,
        with_signals=bool(one.getTLSID() or other.getTLSID()),
        place=place,
    )
