"""The traffic of a map, from a route file of its user, and the part of it that a scene's net has."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from sumolib.net import Net
from sumolib.net.edge import Edge

from harness.errors import Problem, UsageError
from harness.road.demand.departures import check_departures, edges_of
from harness.road.demand.route_file import Departure, RouteFile
from harness.road.demand.route_reading import read_route_file
from harness.road.demand.route_writing import elements_of
from harness.road.demand.trips import with_routes
from harness.road.xml.xml_file import parse_xml


def read_traffic(file: Path, net_file: Path, net: Net, *, is_cut: bool) -> RouteFile:
    """The content of a route file, checked against the net of its map, with the routes of its trips.

    `is_cut`: scenes have parts of the net. Raises UsageError for what is invalid or unsupported, for a file without
    traffic, and, if `is_cut`, for vehicles that choose among routes.
    """
    routes = read_route_file(file)
    everything = routes.within(-inf, inf)
    if not everything:
        raise UsageError.of(file, "", "has no vehicle, person or flow", "name the route file of the map's traffic")
    _check_edges(everything, routes, net)
    routes = with_routes(routes, net_file, net, everything)
    check_departures(set(), net, routes)
    if is_cut:
        message = "draws its route, and in a part of the map its departure depends on the route"
        choosing = [each.name for each in routes.within(-inf, inf) if len(_routes_of(each, routes)) > 1]
        if choosing:
            raise UsageError(
                Problem(str(file), each, message, "give it one route, or --whole-net") for each in choosing
            )
    return routes


def _check_edges(departures: Sequence[Departure], routes: RouteFile, net: Net) -> None:
    """Raise UsageError, one line, if routes name edges that the net does not have."""
    named: dict[str, str] = {}  # the first traveller of each edge
    for departure in departures:
        for each in routes.variants(departure):
            named |= {edge: departure.name for edge in (*each.edges, *each.trip) if edge not in named}
    unknown = [edge for edge in named if not net.hasEdge(edge)]
    if unknown:
        more = f", and {len(unknown) - 1} more edges that the routes name" if len(unknown) > 1 else ""
        message = f"the net has no edge {unknown[0]!r}{more}"
        raise UsageError.of(routes.path, named[unknown[0]], message, "name the route file of this map")


class SceneTraffic(NamedTuple):
    """The elements of a scene's route file that are its traffic, and when the first vehicle departs (s)."""

    elements: list[ElementTree.Element]
    begin_s: float


def scene_traffic(routes: RouteFile, net: Net, junctions: Collection[str] | None) -> SceneTraffic:
    """The traffic of a scene whose net has these junctions of a map; None: it has all of them, and the traffic is that
    of the route file, unchanged.

    Raises UsageError if no route leads through the scene's net.
    """
    within = routes if junctions is None else traffic_within(routes, net, junctions)
    departures = within.within(-inf, inf)
    if not departures:
        message = f"no route of {routes.path} leads through its part of the net"
        raise UsageError.of("traffic", "", message, "choose another conflict, or give --whole-net")
    elements = list(parse_xml(routes.path)) if junctions is None else elements_of(within)
    return SceneTraffic(elements, min(each.depart_s for each in departures))


def traffic_within(routes: RouteFile, net: Net, junctions: Collection[str]) -> RouteFile:
    """The traffic in the part of a net that has these junctions and their edges.

    A route is cut to its stretches in the part. A vehicle enters a stretch as late as it gets there at the speed limits
    of the edges before, or at its own top speed, and not before the times until which it stops there: as with SUMO's
    cutRoutes.py and the options --orig-net and --disconnected-action keep.
    """

    def stretches(departure: Departure) -> Iterator[Departure]:
        return _stretches(departure, routes, net, set(junctions))

    flows = [
        replace(flow, departure=each, end_s=flow.end_s + each.depart_s - flow.departure.depart_s)
        for flow in routes.flows
        for each in stretches(flow.departure)
    ]
    vehicles = {each.name: each for vehicle in routes.vehicles.values() for each in stretches(vehicle)}
    return replace(routes, vehicles=vehicles, flows=tuple(flows))


def _routes_of(departure: Departure, routes: RouteFile) -> dict[tuple[str, ...], Departure]:
    return {each.edges: each for each in routes.variants(departure)}


def _stretches(departure: Departure, routes: RouteFile, net: Net, junctions: set[str]) -> Iterator[Departure]:
    (routed,) = _routes_of(departure, routes).values()
    kind = routes.types[routed.vehicle_type]
    edges = edges_of(routed, net, routes)
    ranges = _ranges(edges, junctions)
    for number, (first, last) in enumerate(ranges):
        kept = routed.edges[first : last + 1]
        passed_s = [stop.until_s for stop in routed.stops if stop.until_s and stop.edge in routed.edges[:first]]
        way_s = sum(
            each.getLength() / min(each.getSpeed(), kind.max_speed_mps, kind.desired_speed_mps)
            for each in edges[:first]
        )
        piece = replace(
            routed,
            name=f"{departure.name}_part{number}" if len(ranges) > 1 else departure.name,
            vehicle_type=departure.vehicle_type,
            edges=kept,
            trip=(),
            depart_s=max([departure.depart_s + way_s, *passed_s]),
            stops=tuple(stop for stop in routed.stops if stop.edge in kept),
        )
        if first > 0 and piece.on_foot:
            piece = replace(piece, position=_end(edges[first], edges[first - 1]))
        elif first > 0:
            piece = replace(piece, lane="best", position="base", speed="max", lateral="")  # as cutRoutes.py
        if last < len(edges) - 1:
            end = ("", _end(edges[last], edges[last + 1]), "") if piece.on_foot else Departure.arrival
            piece = replace(piece, arrival=end)
        yield piece


def _ranges(edges: Sequence[Edge], junctions: set[str]) -> list[tuple[int, int]]:
    """The first and the last index of each stretch of a route at these junctions."""
    ends = [{edge.getFromNode().getID(), edge.getToNode().getID()} for edge in edges]
    ranges: list[tuple[int, int]] = []
    for k in (k for k, both in enumerate(ends) if both & junctions):
        goes_on = k > 0 and ranges and ranges[-1][1] == k - 1 and ends[k - 1] & ends[k] <= junctions
        first = ranges.pop()[0] if goes_on else k
        ranges.append((first, k))
    return ranges


def _end(edge: Edge, neighbour: Edge) -> str:
    """The place along an edge at which a person comes from, or goes to, a neighbour of the edge."""
    at_start = edge.getFromNode() in (neighbour.getFromNode(), neighbour.getToNode())
    return "0" if at_start else f"{edge.getLength():.2f}"
