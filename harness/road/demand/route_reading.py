"""Reading of route files: vehicles, trips and flows. The XML parser refuses entities and external references."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from itertools import groupby
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from harness.config.toml_reading import nearest
from harness.errors import Problem, UsageError, collect
from harness.road.demand.route_elements import NamedRoutes, Types, choices_in, ranged, read_routes, read_types, route_in
from harness.road.demand.route_file import (
    DEFAULT_PERSONS_TYPE,
    DEFAULT_TYPE,
    DESIRED_SPEEDS_MPS,
    LEAST_PERIOD_S,
    MOST_AT_ONCE,
    PLACES,
    SIZES_M,
    Departure,
    Flow,
    FlowRate,
    RouteChoice,
    RouteFile,
    VehicleType,
)
from harness.road.demand.route_schema import FLOW_RATES, FLOWS, PEOPLE, VEHICLES, check_content
from harness.road.demand.stops import stop_in
from harness.road.xml.xml_file import number_in, number_of, parse_xml, required, seconds_in

_RANDOM_PERIOD = re.compile(r"exp\((.+)\)")
_LATERAL = ("left", "right", "center", "random")
_ON_FOOT = "pedestrian"
_PERSONS_TYPE = VehicleType(
    name=DEFAULT_PERSONS_TYPE,
    length_m=SIZES_M[_ON_FOOT][0],
    width_m=SIZES_M[_ON_FOOT][1],
    max_speed_mps=37.58 / 3.6,
    desired_speed_mps=DESIRED_SPEEDS_MPS[_ON_FOOT],
    vehicle_class=_ON_FOOT,
)
_FASTEST_WALK_MPS = 12.5


def read_route_file(path: Path, *additional: Path) -> RouteFile:
    """Read a `.rou.xml`, with the content of additional files. Raises UsageError for invalid or unsupported content."""
    contents = [_content(each) for each in (path, *additional)]
    root = contents[0][0]
    for more, _ in contents[1:]:
        root.extend(more)
    only_types = ElementTree.Element("routes")
    only_types.extend(element for element in root if element.tag in ("vType", "vTypeDistribution"))
    problems: list[Problem] = []
    types = read_types(path, only_types, problems)
    elements = _travellers(root)
    if any(each.tag in PEOPLE for each in elements):
        types = replace(types, types={DEFAULT_PERSONS_TYPE: _PERSONS_TYPE, **types.types})
    named = read_routes(path, root, problems)
    vehicles: dict[str, Departure] = {}
    flows: dict[str, Flow] = {}
    for element in elements:
        read = partial(_person if element.tag in PEOPLE else _departure, path, element, named)
        departure = collect(problems, partial(read, types))
        if departure is None:
            continue
        if departure.name in vehicles or departure.name in flows:
            where = f"{element.tag} {departure.name}"
            problems.append(Problem(str(path), where, "stands twice", "rename one of the two"))
        elif element.tag in FLOWS:
            flow = collect(problems, partial(_flow, path, element, departure))
            if flow is not None:
                flows[departure.name] = flow
        else:
            vehicles[departure.name] = departure
    if problems:
        raise UsageError(problems)
    return RouteFile(
        path=path,
        types=types.types,
        mixes=types.mixes,
        vehicles=vehicles,
        flows=tuple(flows.values()),
        types_xml=ElementTree.tostring(only_types, encoding="unicode"),
        warnings=tuple(line for _, warnings in contents for line in warnings),
    )


def _content(path: Path) -> tuple[ElementTree.Element, tuple[str, ...]]:
    root = parse_xml(path)
    return root, check_content(path, root)


def _travellers(root: ElementTree.Element) -> list[ElementTree.Element]:
    """The vehicles, trips, flows and persons of a file. A flow within an interval has the times of the interval."""
    found = []
    for element in root:
        if element.tag in (*VEHICLES, *PEOPLE):
            found.append(element)
        elif element.tag == "interval":
            for flow in element:
                for name in ("begin", "end"):
                    flow.attrib.setdefault(name, element.get(name, ""))
                found.append(flow)
    return found


def _departure(path: Path, element: ElementTree.Element, named: NamedRoutes, types: Types) -> Departure:
    where, kind = _name_and_type(path, element, types, DEFAULT_TYPE)
    choices = tuple(_cut(path, where, element, each) for each in _choices(path, where, element, named))
    if not all(each.edges for each in choices):
        raise UsageError.of(path, where, "its route has no edges", "give the route's edges")
    stops = tuple(stop_in(path, where, each, named.bus_stops) for each in element.findall("stop"))
    departure = Departure(
        name=required(path, element, "id"),
        vehicle_type=kind,
        edges=(),
        depart_s=_depart_s(path, where, element),
        lane=element.get("departLane", "first"),
        position=element.get("departPos", "base"),
        speed=element.get("departSpeed", "0"),
        arrival=(
            element.get("arrivalLane", "current"),
            element.get("arrivalPos", "max"),
            element.get("arrivalSpeed", "current"),
        ),
        lateral=_lateral(path, where, element),
        speed_factor=ranged(path, element, "speedFactor", 1.0) if element.get("speedFactor") else None,
        stops=stops,
        element=element.tag,
    )
    if not choices:
        return replace(departure, trip=_trip(path, where, element, departure))
    if len(choices) == 1:
        return replace(departure, edges=choices[0].edges, stops=choices[0].stops + stops)
    return replace(departure, choices=choices)


def _person(path: Path, element: ElementTree.Element, named: NamedRoutes, types: Types) -> Departure:
    """The person that an element describes, or the first one of its flow. It has one walk.

    libsumo inserts a person with the edges of its walk. Rides, stops and journeys by several means need vehicles and
    stops that wait for one another, which the harness does not insert.
    """
    where, kind = _name_and_type(path, element, types, DEFAULT_PERSONS_TYPE)
    for name in types.mixes[kind].types if kind in types.mixes else (kind,):
        if types.types[name].vehicle_class != _ON_FOOT:
            message = f"its type {name!r} is of the class {types.types[name].vehicle_class}"
            raise UsageError.of(path, f"{where}.type", message, f'give a vType with vClass="{_ON_FOOT}"')
    walks = element.findall("walk")
    if len(walks) != 1:
        message = f"has {len(walks) or 'no'} {'walks' if walks else 'walk'}, one is possible"
        raise UsageError.of(path, where, message, "give one walk over all edges")
    walk = walks[0]
    edges, ends = _walked(path, f"{where}.walk", walk, named), tuple(filter(None, (walk.get("from"), walk.get("to"))))
    if not edges and len(ends) != 2:
        raise UsageError.of(path, f"{where}.walk", "has no edges", "give its edges, a route, or from and to")
    places = {"departPos": "0", "arrivalPos": "center"}
    for name, default in places.items():
        places[name] = text = walk.get(name, element.get(name, default))
        if text not in PLACES and not np.isfinite(number_of(text)):
            message = f"{text[:60]!r} is not a place along an edge"
            raise UsageError.of(path, f"{where}.{name}", message, f"give metres, or {nearest(text, PLACES)}")
    speed = number_in(path, f"{where}.walk", walk, "speed", above=0.0, most=_FASTEST_WALK_MPS)
    if element.tag == "person":
        required(path, element, "depart")
    return Departure(
        name=required(path, element, "id"),
        vehicle_type=kind,
        edges=edges,
        trip=() if edges else ends,
        depart_s=_depart_s(path, where, element),
        lane="",
        position=places["departPos"],
        speed="" if speed is None else f"{speed:g}",
        arrival=("", places["arrivalPos"], ""),
        speed_factor=ranged(path, element, "speedFactor", 1.0) if element.get("speedFactor") else None,
        element=element.tag,
    )


def _walked(path: Path, where: str, walk: ElementTree.Element, named: NamedRoutes) -> tuple[str, ...]:
    """The edges that a walk names, by itself or by its route."""
    edges = tuple(walk.get("edges", "").split())
    if walk.get("route") is None:
        return edges
    if edges:
        raise UsageError.of(path, where, "has edges and a route", "leave one of them out")
    choices = _named(path, where, walk, named)
    if len(choices) > 1:
        raise UsageError.of(path, where, f"{walk.get('route')!r} is a routeDistribution", "name one route")
    return choices[0].edges


def _name_and_type(path: Path, element: ElementTree.Element, types: Types, default: str) -> tuple[str, str]:
    """The name of an element in messages, and the type that it gives. Raises UsageError."""
    where = f"{element.tag} {required(path, element, 'id')}"
    kind = element.get("type", default)
    if kind not in types.names():
        raise UsageError.of(path, where, f"unknown vehicle type {kind!r}", nearest(kind, types.names()))
    return where, kind


def _depart_s(path: Path, where: str, element: ElementTree.Element) -> float:
    return seconds_in(path, where, element, "begin" if element.tag in FLOWS else "depart") or 0.0


def _choices(path: Path, where: str, element: ElementTree.Element, named: NamedRoutes) -> tuple[RouteChoice, ...]:
    """The routes that a vehicle has or chooses from; none for a trip."""
    own, several, name = element.find("route"), element.find("routeDistribution"), element.get("route")
    if own is not None:
        return (route_in(path, own, named.bus_stops),)
    if several is not None:
        return choices_in(path, several, named)
    if name is None and element.tag != "vehicle":
        return ()
    return _named(path, where, element, named)


def _named(path: Path, where: str, element: ElementTree.Element, named: NamedRoutes) -> tuple[RouteChoice, ...]:
    name = required(path, element, "route")
    if name not in named.routes:
        raise UsageError.of(path, where, f"unknown route {name!r}", nearest(name, named.routes))
    return named.routes[name]


def _trip(path: Path, where: str, element: ElementTree.Element, departure: Departure) -> tuple[str, ...]:
    """The edges that a trip passes, from first to last, each once in a row."""
    stops = [stop.edge for stop in departure.stops]
    start, end = element.get("from"), element.get("to")
    if not (start or stops) or not (end or stops):
        missing = "from" if not start else "to"
        if element.get(f"{missing}Taz"):
            message = f"has a zone and no edge as its {missing!r}"
            raise UsageError.of(path, where, message, "write the trips with SUMO's od2trips, which chooses edges")
        raise UsageError.of(path, where, f"has no route and no {missing!r}", "give from and to, or a route")
    if element.get("departEdge") or element.get("arrivalEdge"):
        raise UsageError.of(path, where, "departEdge and arrivalEdge need a route", "give from and to the right edges")
    passed = [start, *element.get("via", "").split(), *stops, end]
    return tuple(edge for edge, _ in groupby(each for each in passed if each))


def _cut(path: Path, where: str, element: ElementTree.Element, choice: RouteChoice) -> RouteChoice:
    """The part of a route from departEdge to arrivalEdge."""
    most = len(choice.edges) - 1
    first, last = (
        number_in(path, where, element, name, above=-0.001, most=most) for name in ("departEdge", "arrivalEdge")
    )
    if first is None and last is None:
        return choice
    return replace(choice, edges=choice.edges[int(first or 0) : int(most if last is None else last) + 1])


def _lateral(path: Path, where: str, element: ElementTree.Element) -> str:
    lateral = element.get("departPosLat", "")
    if lateral and lateral not in _LATERAL and not abs(number_of(lateral)) <= 10.0:
        message = f"{lateral[:60]!r} is not possible here"
        raise UsageError.of(path, f"{where}.departPosLat", message, nearest(lateral, _LATERAL))
    return "" if lateral == "center" else lateral


def _flow(path: Path, element: ElementTree.Element, departure: Departure) -> Flow:
    where = f"{element.tag} {departure.name}"
    rates = [name for name in FLOW_RATES if element.get(name) is not None]
    if not rates or (rates == ["number"] and element.get("end") is None):
        raise UsageError.of(path, where, "has no rate", "give one of period, vehsPerHour, probability")
    if len(set(rates) - {"number"}) > 1:
        raise UsageError.of(path, where, f"has its rate twice: {', '.join(rates)}", "give one")
    end = seconds_in(path, where, element, "end")
    end_s = np.inf if end is None else end
    number = _number(path, where, element) if "number" in rates else None
    at_once = rates == ["number"] and end_s == departure.depart_s
    if end_s <= departure.depart_s and not at_once:
        raise UsageError.of(path, f"{where}.end", "does not lie after its begin", "give a later end")
    if rates == ["number"]:
        assert number is not None
        rate = FlowRate(period_s=(end_s - departure.depart_s) / max(number, 1), number=number, spread=True)
        if number > MOST_AT_ONCE if at_once else (rate.period_s or 0.0) < LEAST_PERIOD_S:
            message = f"one vehicle every {rate.period_s:g} s is more than the capacity of a lane"
            raise UsageError.of(path, f"{where}.number", message, "give a smaller number")
    else:
        rate = replace(_rate(path, where, element), number=number)
    return Flow(departure=departure, end_s=end_s, rate=rate)


def _number(path: Path, where: str, element: ElementTree.Element) -> int:
    number = ranged(path, element, "number", 0.0)
    if number != int(number):
        raise UsageError.of(path, f"{where}.number", f"{number:g} is not a number that is possible here", "round it")
    return int(number)


def _rate(path: Path, where: str, element: ElementTree.Element) -> FlowRate:
    if element.get("probability") is not None:
        return FlowRate(probability_per_s=ranged(path, element, "probability", 0.0))
    for name in ("vehsPerHour", "personsPerHour", "perHour"):
        if element.get(name) is not None:
            return FlowRate(period_s=3600.0 / ranged(path, element, name, 1.0))
    random = _RANDOM_PERIOD.fullmatch(element.get("period", "").strip())
    if random is None:
        return FlowRate(period_s=ranged(path, element, "period", 1.0))
    per_second = number_of(random[1])
    if not 0.0 < per_second <= 1.0 / LEAST_PERIOD_S:
        message = f"{random[0][:60]!r} is not a rate that is possible here"
        remedy = f"give exp(vehicles per second), above 0 and up to {1.0 / LEAST_PERIOD_S:g}"
        raise UsageError.of(path, f"{where}.period", message, remedy)
    return FlowRate(mean_period_s=1.0 / per_second)
