"""Routes of trips: from edge to edge, found by SUMO's duarouter.

SUMO would find them itself when the vehicles depart, but libsumo inserts vehicles with routes. duarouter has the same
costs and permissions as SUMO in an empty net; sumolib's path search has neither the delays at junctions nor the top
speeds of types. It runs as a separate process, because libsumo of this process may be in use and a net may crash SUMO.
The routes are cached by the content of the net, the trips and SUMO's version.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from xml.etree import ElementTree

from sumolib.net import Net

from harness.errors import MOST_PROBLEMS, Problem, UsageError, collect
from harness.files import write_atomically
from harness.road.demand.route_file import Departure, RouteFile, VehicleType
from harness.road.demand.stops import placed
from harness.road.demand.walks import with_places_in_metres
from harness.road.net import network
from harness.road.xml.sumo_program import cached_file, run_program
from harness.road.xml.xml_file import parse_xml

PATIENCE_S, PATIENCE_S_PER_BYTE = 60.0, 4e-6  # time limit: a constant, and a part per byte of the net
_Query = tuple[str, str, tuple[str, ...]]  # vehicle class, top speed, edges from first to last
_ON_FOOT = "person"  # in place of the class


def with_routes(routes: RouteFile, net_file: Path, net: Net, needed: Iterable[Departure]) -> RouteFile:
    """A route file with routes for the trips among the `needed` vehicles, and with their stops placed on the net.

    Raises UsageError for trips with unknown edges, and for trips without a route.
    """
    names = {each.name for each in needed}
    trips = [
        each
        for departure in [*routes.vehicles.values(), *(flow.departure for flow in routes.flows)]
        if departure.name in names and departure.trip
        for each in routes.variants(departure)
    ]
    routes = replace(routes, found=_find(routes, net_file, net, trips) if trips else {})

    def settled(each: Departure) -> Departure:
        return _settled(each, routes, net) if each.name in names else each

    return replace(
        routes,
        vehicles={name: settled(each) for name, each in routes.vehicles.items()},
        flows=tuple(replace(flow, departure=settled(flow.departure)) for flow in routes.flows),
    )


def _settled(departure: Departure, routes: RouteFile, net: Net) -> Departure:
    """A departure with its route, if that does not depend on its type, and with the places of its stops."""
    kind = routes.types.get(departure.vehicle_type, VehicleType(name="")).vehicle_class
    departure = routes.routed(departure)
    if departure.on_foot and departure.edges:
        return with_places_in_metres(departure, net)
    stops = tuple(placed(stop, net, kind) for stop in departure.stops)
    choices = tuple(
        replace(each, stops=tuple(placed(stop, net, kind) for stop in each.stops)) for each in departure.choices
    )
    first = next(iter(stops), None)
    if departure.position == "stop" and first is not None and first.end_m is not None:
        departure = replace(departure, position=f"{first.end_m:g}", lane=str(first.lane))
    return replace(departure, stops=stops, choices=choices)


def _find(
    routes: RouteFile, net_file: Path, net: Net, trips: Sequence[Departure]
) -> dict[tuple[str, tuple[str, ...]], tuple[str, ...]]:
    problems: list[Problem] = []
    queries: dict[tuple[str, tuple[str, ...]], _Query] = {}
    for trip in trips:
        for edge in dict.fromkeys(trip.trip):
            collect(problems, partial(network.find_edge, net, routes.path, trip.key, edge))
        kind = routes.types[trip.vehicle_type]
        walk, drive = (_ON_FOOT, "0"), (kind.vehicle_class, f"{kind.max_speed_mps:g}")
        queries[kind.name, trip.trip] = (*(walk if trip.on_foot else drive), trip.trip)
        if len(problems) >= MOST_PROBLEMS:
            break
    if problems:
        raise UsageError(sorted(set(problems)))
    answers = _answers(net_file, routes.path, sorted(set(queries.values())))
    for trip in trips:
        vehicle_class, _, places = query = queries[trip.vehicle_type, trip.trip]
        if query not in answers:
            way = f"from {' over '.join(map(repr, places[:-1]))} to {places[-1]!r}"
            message = f"no route for a {vehicle_class} leads {way}"
            problems.append(Problem(str(routes.path), trip.key, message, "correct its edges or its type"))
    if problems:
        raise UsageError(sorted(set(problems))[:MOST_PROBLEMS])
    return {key: answers[query] for key, query in queries.items()}


def _answers(net_file: Path, route_path: Path, queries: Sequence[_Query]) -> dict[_Query, tuple[str, ...]]:
    def write(file: Path) -> None:
        write_atomically(file, json.dumps(_run_duarouter(net_file.resolve(), route_path, queries)).encode())

    edges = json.loads(cached_file("trips/.json", net_file, queries, write).read_text(encoding="utf-8"))
    return {query: tuple(route) for query, route in zip(queries, edges, strict=True) if route}


def _run_duarouter(net_file: Path, route_path: Path, queries: Sequence[_Query]) -> list[list[str]]:
    """The edges of each route, empty where there is none. Raises UsageError if duarouter fails."""
    root = ElementTree.Element("routes")
    kinds = {each[:2]: f"t{k}" for k, each in enumerate(dict.fromkeys(query[:2] for query in queries))}
    for (vehicle_class, speed), name in kinds.items():
        if vehicle_class != _ON_FOOT:
            ElementTree.SubElement(root, "vType", id=name, vClass=vehicle_class, maxSpeed=speed)
    for k, (vehicle_class, speed, places) in enumerate(queries):
        if vehicle_class == _ON_FOOT:
            person = ElementTree.SubElement(root, "person", id=str(k), depart="0")
            ElementTree.SubElement(person, "walk", {"from": places[0], "to": places[1]})
            continue
        via = {"via": " ".join(places[1:-1])} if len(places) > 2 else {}
        attributes = {"id": str(k), "type": kinds[vehicle_class, speed], "depart": "0", "from": places[0]}
        ElementTree.SubElement(root, "trip", attributes | via | {"to": places[-1]})
    with tempfile.TemporaryDirectory(prefix="harness-trips-") as folder:
        trips, found = Path(folder) / "trips.xml", Path(folder) / "found.rou.xml"
        ElementTree.ElementTree(root).write(trips, encoding="utf-8", xml_declaration=True)
        options = ["--net-file", str(net_file), "--route-files", str(trips), "--output-file", str(found)]
        options += ["--ignore-errors", "--no-warnings", "--no-step-log", "--xml-validation", "never"]
        run = run_program("duarouter", options, folder, PATIENCE_S + PATIENCE_S_PER_BYTE * net_file.stat().st_size)
        if run is None or run.returncode or not found.exists():
            said = run.stderr.strip()[-300:] if run else "no answer in time"
            raise UsageError.of(
                route_path, "trip", f"SUMO's duarouter failed: {said}", "write the routes into the file"
            )
        edges: list[list[str]] = [[] for _ in queries]
        for traveller in parse_xml(found):
            route = traveller.find("walk" if traveller.tag == "person" else "route")
            if route is not None:
                edges[int(traveller.get("id", "0"))] = route.get("edges", "").split()
    return edges
