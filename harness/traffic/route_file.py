"""What a SUMO route file says: vehicle types, routes, and who departs when.

The harness starts every vehicle itself, relative to the start of each game, so that all games of an arena, however
often they restart, see the same traffic. XML is parsed with entities and external references refused.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from harness.config.toml_reading import nearest
from harness.errors import Problem, UsageError, collect
from harness.game.arrays import FloatArray
from harness.traffic.schema import Kind, kinds, problems_in
from harness.traffic.xml_file import number_of, parse_xml

_DEFAULT_TYPE = "DEFAULT_VEHTYPE"
_FLOW_RATES = ("number", "period", "vehsPerHour", "probability")
_DEPARTS = ("type", "route", "departLane", "departPos", "departSpeed")
_NAME = re.compile(r"[^\s|\\'\";,<>&:!?*]{1,200}")
_LEAST_PERIOD_S = 0.05
# What makes sense of each number: above (or from, where it may be 0) and up to
_RANGES = {
    "length": (0.0, 100.0),
    "width": (0.0, 10.0),
    "maxSpeed": (0.0, 200.0),
    "vehsPerHour": (0.0, 3600.0 / _LEAST_PERIOD_S),
    "period": (_LEAST_PERIOD_S * 0.999, 1e7),
    "probability": (-0.001, 1.0),
}
_TIMES = (-0.001, 1e7)
_EMISSIONS = re.compile(r"(HBEFA[234]|Energy)/\w+|zero|default")  # others are read from files beside the scene


@dataclass(frozen=True)
class VehicleType:
    """Size and top speed of a vType; SUMO's defaults for passenger cars where it says nothing."""

    name: str
    length_m: float = 5.0
    width_m: float = 1.8
    max_speed_mps: float = 55.55
    lane_changes: str = ""
    """Its laneChangeModel; empty: SUMO's default."""


@dataclass(frozen=True)
class Departure:
    """One vehicle: when, where and how it departs, in SUMO's own words for lane, position and speed."""

    name: str
    vehicle_type: str
    edges: tuple[str, ...]
    depart_s: float
    lane: str
    position: str
    speed: str


@dataclass(frozen=True)
class Flow:
    """Vehicles departing again and again."""

    departure: Departure
    end_s: float
    period_s: float | None
    probability_per_s: float | None
    number: int | None


@dataclass(frozen=True)
class RouteFile:
    """A route file, read."""

    path: Path
    types: Mapping[str, VehicleType]
    vehicles: Mapping[str, Departure]
    flows: tuple[Flow, ...]
    types_xml: str  # the file's vehicle types alone, as SUMO reads them

    def departures(self, but: set[str], until_s: float, generator: np.random.Generator) -> list[Departure]:
        """Everyone who departs in the first `until_s` seconds of a game, except the vehicles named in `but`."""
        found = [each for name, each in self.vehicles.items() if name not in but]
        for flow in self.flows:
            found += _expand(flow, until_s, generator)
        return sorted((each for each in found if each.depart_s < until_s), key=lambda each: (each.depart_s, each.name))


def read_route_file(path: Path) -> RouteFile:
    """Read a `.rou.xml`. Raises UsageError for what can't be understood."""
    root = parse_xml(path)
    _check_names(path, root)
    only_types = ElementTree.Element("routes")
    only_types.extend(element for element in root if element.tag in ("vType", "vTypeDistribution"))
    problems: list[Problem] = []
    types = {_DEFAULT_TYPE: VehicleType(_DEFAULT_TYPE)}
    for element in only_types.iter("vType"):
        kind = collect(problems, lambda element=element: _vehicle_type(path, element))  # type: ignore[misc]
        if kind is not None:
            types[kind.name] = kind
    distributions = {_attribute(path, element, "id") for element in root.iter("vTypeDistribution")}
    routes = {
        _attribute(path, element, "id"): tuple(element.get("edges", "").split())
        for element in root
        if element.tag == "route"
    }
    vehicles: dict[str, Departure] = {}
    flows: dict[str, Flow] = {}
    for element in root:
        if element.tag in ("vehicle", "flow"):
            departure = collect(
                problems,
                lambda element=element: _departure(path, element, routes, set(types) | distributions),  # type: ignore[misc]
            )
            if departure is None:
                continue
            if departure.name in vehicles or departure.name in flows:
                where = f"{element.tag} {departure.name}"
                problems.append(Problem(str(path), where, "stands twice", "call one something else"))
            elif element.tag == "vehicle":
                vehicles[departure.name] = departure
            else:
                flow = collect(problems, lambda e=element, d=departure: _flow(path, e, d))  # type: ignore[misc]
                if flow is not None:
                    flows[departure.name] = flow
    if problems:
        raise UsageError(problems)
    types_xml = ElementTree.tostring(only_types, encoding="unicode")
    return RouteFile(path, types, vehicles, tuple(flows.values()), types_xml)


def _check_names(path: Path, root: ElementTree.Element) -> None:
    """Raise UsageError for every element and attribute that nothing here would act upon, and for odd names."""
    if root.tag != "routes":
        raise UsageError.of(path, str(root.tag), "is not a SUMO route file: its root is not routes", "name a .rou.xml")
    problems = list(problems_in(path, root, _understood(), "routesType"))
    for element in root.iter():
        name = element.get("id")
        if name and not _NAME.fullmatch(name):
            message = f"{name[:60]!r} can't be a name in SUMO"
            problems.append(Problem(str(path), f"{element.tag}.id", message, "use letters, digits and _"))
        if not _EMISSIONS.fullmatch(element.get("emissionClass", "default")):
            message = f"{element.get('emissionClass')!r} may make SUMO read other files"
            problems.append(Problem(str(path), f"{element.tag} {name}.emissionClass", message, "leave it out"))
    if problems:
        raise UsageError(problems)


@cache
def _understood() -> Mapping[str, Kind]:
    """Of SUMO's schema, what the harness acts upon or hands to SUMO; of that, nothing that names files."""
    known = kinds("routes_file.xsd")
    files = ("imgFile", "osgFile")
    types = {
        name: Kind({each: must for each, must in kind.attributes.items() if each not in files}, kind.children)
        for name, kind in known.items()
    }
    inside = {"route": "route within"}
    rates = dict.fromkeys(("begin", "end", *_FLOW_RATES), False)
    return types | {
        "routesType": Kind(
            children={name: name for name in ("vType", "vTypeDistribution", "route", "vehicle", "flow")}
        ),
        "vType": types["vTypeType"],
        "vTypeDistribution": types["vTypeDistributionType"],
        "route": Kind({"id": True, "edges": True, "color": False}),
        "route within": Kind({"edges": True}),
        "vehicle": Kind({"id": True, "depart": False, **dict.fromkeys(_DEPARTS, False)}, inside),
        "flow": Kind({"id": True, **rates, **dict.fromkeys(_DEPARTS, False)}, inside),
    }


def _vehicle_type(path: Path, element: ElementTree.Element) -> VehicleType:
    return VehicleType(
        _attribute(path, element, "id"),
        _number(path, element, "length", 5.0),
        _number(path, element, "width", 1.8),
        _number(path, element, "maxSpeed", 55.55),
        element.get("laneChangeModel", ""),
    )


def _departure(
    path: Path, element: ElementTree.Element, routes: Mapping[str, tuple[str, ...]], types: set[str]
) -> Departure:
    name = _attribute(path, element, "id")
    kind = element.get("type", _DEFAULT_TYPE)
    if kind not in types:
        raise UsageError.of(path, f"{element.tag} {name}", f"unknown vehicle type {kind!r}", nearest(kind, types))
    own = element.find("route")
    if own is not None:
        edges = tuple(own.get("edges", "").split())
    else:
        route = _attribute(path, element, "route")
        if route not in routes:
            raise UsageError.of(path, f"{element.tag} {name}", f"unknown route {route!r}", nearest(route, routes))
        edges = routes[route]
    if not edges:
        raise UsageError.of(path, f"{element.tag} {name}", "its route has no edges", "give the route's edges")
    return Departure(
        name,
        kind,
        edges,
        _number(path, element, "begin" if element.tag == "flow" else "depart", 0.0),
        element.get("departLane", "first"),
        element.get("departPos", "base"),
        element.get("departSpeed", "0"),
    )


def _flow(path: Path, element: ElementTree.Element, departure: Departure) -> Flow:
    given = [name for name in _FLOW_RATES if element.get(name) is not None]
    if not given or (given == ["number"] and element.get("end") is None):
        raise UsageError.of(path, f"flow {departure.name}", "has no rate", f"give one of {', '.join(_FLOW_RATES[1:])}")
    if len(set(given) - {"number"}) > 1:
        raise UsageError.of(path, f"flow {departure.name}", f"has its rate twice: {', '.join(given)}", "give one")
    end = _number(path, element, "end", np.inf)
    if end <= departure.depart_s:
        raise UsageError.of(path, f"flow {departure.name}.end", "does not lie after its begin", "give a later end")
    number = int(_number(path, element, "number", 0)) if "number" in given else None
    period = None
    if "vehsPerHour" in given:
        period = 3600.0 / _number(path, element, "vehsPerHour", 1.0)
    elif "period" in given:
        period = _number(path, element, "period", 1.0)
    elif "number" in given:
        period = (end - departure.depart_s) / max(number or 1, 1)
        if period < _LEAST_PERIOD_S:
            text = f"one vehicle every {period:g} s is more than a lane takes"
            raise UsageError.of(path, f"flow {departure.name}.number", text, "give a smaller number")
    probability = _number(path, element, "probability", 0.0) if "probability" in given else None
    return Flow(departure, end, period, probability, number)


def _expand(flow: Flow, until_s: float, generator: np.random.Generator) -> list[Departure]:
    first, end = flow.departure.depart_s, min(flow.end_s, until_s)
    if flow.period_s is not None:
        times: FloatArray = np.arange(first, end, flow.period_s)
    else:
        seconds = np.arange(first, end, 1.0)
        times = seconds[generator.random(len(seconds)) < (flow.probability_per_s or 0.0)]
    if flow.number is not None:
        times = times[: flow.number]
    departure = flow.departure
    return [
        Departure(
            f"{departure.name}.{k}",
            departure.vehicle_type,
            departure.edges,
            float(time),
            departure.lane,
            departure.position,
            departure.speed,
        )
        for k, time in enumerate(times)
    ]


def _attribute(path: Path, element: ElementTree.Element, name: str) -> str:
    value = element.get(name)
    if not value:
        raise UsageError.of(path, element.tag, f"has no {name!r}", f"give every {element.tag} its {name}")
    return value


def _number(path: Path, element: ElementTree.Element, name: str, default: float) -> float:
    value = element.get(name)
    if value is None:
        return default
    number = number_of(value)
    above, most = _RANGES.get(name, _TIMES)
    if not above < number <= most or (name == "number" and number != int(number)):
        where = f"{element.tag} {element.get('id', '')}.{name}"
        raise UsageError.of(
            path,
            where,
            f"{value[:60]!r} is not a number that makes sense here",
            f"give a number of seconds, metres or m/s, up to {most:g}",
        )
    return number
