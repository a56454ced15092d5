"""Stops of vehicles on their routes: reading, placing on the net, and checking against the route."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree import ElementTree

from sumolib.net import Net
from sumolib.net.edge import Edge

from harness.errors import Problem, UsageError
from harness.road.xml.xml_file import number_in, seconds_in

_SHORTEST_M = 0.2  # SUMO refuses a shorter place


@dataclass(frozen=True, kw_only=True)
class Stop:
    """A stop of a vehicle: on a part of a lane, for a duration or until a time."""

    edge: str
    lane: int | None
    """Index of the lane; None: the first one that the vehicle may use."""
    start_m: float | None
    end_m: float | None
    """None: the lane's end. Negative: from the lane's end."""
    duration_s: float | None
    until_s: float | None
    parking: bool
    friendly: bool = False
    """Whether a place beyond the lane is moved onto it."""

    def later(self, by_s: float) -> Stop:
        """The same stop on a clock that shows a later time."""
        return self if self.until_s is None else replace(self, until_s=self.until_s + by_s)


def stop_in(path: Path, where: str, element: ElementTree.Element, bus_stops: Mapping[str, ElementTree.Element]) -> Stop:
    """The stop that an element describes. Raises UsageError, with `where` as its key, if it has no place or no end."""
    duration, until = seconds_in(path, where, element, "duration"), seconds_in(path, where, element, "until")
    if duration is None and until is None:
        raise UsageError.of(path, where, "has neither duration nor until: the vehicle never drives on", "give one")
    parking = element.get("parking", "false").lower()
    if parking not in ("true", "false", "1", "0"):
        raise UsageError.of(path, f"{where}.parking", f"{parking[:60]!r} is not supported", "write true or false")
    place = element
    if name := element.get("busStop"):
        if name not in bus_stops:
            message = f"names the bus stop {name[:60]!r}, which this file does not define"
            raise UsageError.of(path, where, message, "give the stop's lane, startPos and endPos instead")
        place = bus_stops[name]
    start, end = (number_in(path, where, place, name) for name in ("startPos", "endPos"))
    lane, edge, index = place.get("lane", ""), element.get("edge", ""), None
    if lane:
        edge, _, number = lane.rpartition("_")
        index = int(number) if number.isdecimal() and len(number) < 4 else -1
    if not edge or index == -1:
        message = f"{lane[:60]!r} is not the name of a lane" if lane else "has no place"
        raise UsageError.of(path, f"{where}.lane", message, "give the lane of the stop")
    return Stop(
        edge=edge,
        lane=index,
        start_m=start,
        end_m=end,
        duration_s=duration,
        until_s=until,
        parking=parking in ("true", "1"),
        friendly=element.get("friendlyPos", "false").lower() in ("true", "1"),
    )


def placed(stop: Stop, net: Net, vehicle_class: str) -> Stop:
    """A stop with its lane and the ends of its place filled in, as far as the net has them."""
    if not net.hasEdge(stop.edge):
        return stop
    lanes = net.getEdge(stop.edge).getLanes()
    allowed = [lane.getIndex() for lane in lanes if lane.allows(vehicle_class)]
    index = stop.lane if stop.lane is not None else next(iter(allowed), 0)
    if index >= len(lanes):
        return stop
    length_m = lanes[index].getLength()
    end = length_m if stop.end_m is None else stop.end_m + (length_m if stop.end_m < 0.0 else 0.0)
    end = min(max(end, _SHORTEST_M), length_m) if stop.friendly else end
    start = end - _SHORTEST_M if stop.start_m is None else stop.start_m + (length_m if stop.start_m < 0.0 else 0.0)
    start = min(max(start, 0.0), end - _SHORTEST_M) if stop.friendly else start
    return replace(stop, lane=index, start_m=max(start, 0.0) if stop.start_m is None else start, end_m=end)


def stop_problems(
    file: str, key: str, *, stops: Sequence[Stop], edges: Sequence[Edge], vehicle_class: str
) -> list[Problem]:
    """The problems of placed stops with the route of their vehicle: SUMO would refuse them during a game."""
    names = [edge.getID() for edge in edges]
    problems, reached = [], (0, 0.0)
    for stop in stops:
        where = (file, f"{key}.stop")
        if stop.edge not in names[reached[0] :]:
            message = f"stops on edge {stop.edge!r}, which its route does not reach after the stop before"
            problems.append(Problem(*where, message, "put the edge on the route, and the stops in their order"))
            continue
        position = names.index(stop.edge, reached[0])
        lanes = edges[position].getLanes()
        if stop.lane is None or stop.lane >= len(lanes):
            message = f"edge {stop.edge!r} has no lane {stop.lane}"
            problems.append(Problem(*where, message, f"give a lane from 0 to {len(lanes) - 1}"))
            continue
        lane, (start, end) = lanes[stop.lane], (stop.start_m or 0.0, stop.end_m or 0.0)
        if not lane.allows(vehicle_class):
            message = f"a {vehicle_class} may not use lane {lane.getID()!r}"
            problems.append(Problem(*where, message, "choose another lane"))
        elif not 0.0 <= start <= end - _SHORTEST_M + 1e-9 or end > lane.getLength():
            message = f"reaches from {start:g} to {end:g} m of a lane of {lane.getLength():g} m"
            remedy = f"keep startPos and endPos between 0 and {lane.getLength():g} m, {_SHORTEST_M:g} m apart"
            problems.append(Problem(*where, message, remedy))
        elif (position, end) < reached:
            problems.append(Problem(*where, "lies before the stop before", "put the stops in their order"))
        reached = (position, end)
    return problems
