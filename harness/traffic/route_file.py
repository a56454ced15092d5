"""SUMO route files: vehicle types, routes and departures.

The harness inserts every vehicle itself, at its time after the start of a game. All games of an arena therefore have
the same traffic, independent of earlier resets. The XML parser refuses entities and external references.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
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
# the range of each number: above the first value, up to the second
_RANGES = {
    "length": (0.0, 100.0),
    "width": (0.0, 10.0),
    "maxSpeed": (0.0, 200.0),
    "vehsPerHour": (0.0, 3600.0 / _LEAST_PERIOD_S),
    "period": (_LEAST_PERIOD_S * 0.999, 1e7),
    "probability": (-0.001, 1.0),
}
_TIMES = (-0.001, 1e7)
_EMISSIONS = re.compile(r"(HBEFA[234]|Energy)/\w+|zero|default")  # SUMO reads other classes from files


@dataclass(frozen=True, kw_only=True)
class VehicleType:
    """Size and top speed of a vType. The defaults are those of SUMO for passenger cars."""

    name: str
    length_m: float = 5.0
    width_m: float = 1.8
    max_speed_mps: float = 55.55
    lane_changes: str = ""
    """The vType's laneChangeModel; empty: SUMO's default."""


@dataclass(frozen=True, kw_only=True)
class Departure:
    """The departure of one vehicle. Lane, position and speed are SUMO's departLane, departPos and departSpeed."""

    name: str
    vehicle_type: str
    edges: tuple[str, ...]
    depart_s: float
    lane: str
    position: str
    speed: str


@dataclass(frozen=True, kw_only=True)
class Flow:
    """A flow of vehicles, by a period or by a probability per second."""

    departure: Departure
    end_s: float
    period_s: float | None
    probability_per_s: float | None
    number: int | None


@dataclass(frozen=True, kw_only=True)
class RouteFile:
    """The content of a route file."""

    path: Path
    types: Mapping[str, VehicleType]
    vehicles: Mapping[str, Departure]
    flows: tuple[Flow, ...]
    types_xml: str  # a route file with the vehicle types only, for SUMO

    def departures(self, excluded: set[str], until_s: float, generator: np.random.Generator) -> list[Departure]:
        """The departures in the first `until_s` seconds of a game, by time, without the `excluded` vehicles."""
        departures = [each for name, each in self.vehicles.items() if name not in excluded]
        for flow in self.flows:
            departures += _expand(flow, until_s, generator)
        due = (each for each in departures if each.depart_s < until_s)
        return sorted(due, key=lambda each: (each.depart_s, each.name))


def read_route_file(path: Path) -> RouteFile:
    """Read a `.rou.xml`. Raises UsageError for invalid or unsupported content."""
    root = parse_xml(path)
    _check_names(path, root)
    only_types = ElementTree.Element("routes")
    only_types.extend(element for element in root if element.tag in ("vType", "vTypeDistribution"))
    problems: list[Problem] = []
    types = {_DEFAULT_TYPE: VehicleType(name=_DEFAULT_TYPE)}
    for element in only_types.iter("vType"):
        vehicle_type = collect(problems, partial(_vehicle_type, path, element))
        if vehicle_type is not None:
            types[vehicle_type.name] = vehicle_type
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
            departure = collect(problems, partial(_departure, path, element, routes, set(types) | distributions))
            if departure is None:
                continue
            if departure.name in vehicles or departure.name in flows:
                where = f"{element.tag} {departure.name}"
                problems.append(Problem(str(path), where, "stands twice", "rename one of the two"))
            elif element.tag == "vehicle":
                vehicles[departure.name] = departure
            else:
                flow = collect(problems, partial(_flow, path, element, departure))
                if flow is not None:
                    flows[departure.name] = flow
    if problems:
        raise UsageError(problems)
    types_xml = ElementTree.tostring(only_types, encoding="unicode")
    return RouteFile(path=path, types=types, vehicles=vehicles, flows=tuple(flows.values()), types_xml=types_xml)


def _check_names(path: Path, root: ElementTree.Element) -> None:
    """Raise UsageError for unsupported elements and attributes, and for names that SUMO does not allow."""
    if root.tag != "routes":
        raise UsageError.of(path, str(root.tag), "is not a SUMO route file: its root is not routes", "name a .rou.xml")
    problems = list(problems_in(path, root, _supported_kinds(), "routesType"))
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
def _supported_kinds() -> Mapping[str, Kind]:
    """The part of SUMO's schema that the harness uses or passes on to SUMO, without attributes that name files."""
    file_attributes = ("imgFile", "osgFile")
    types = {
        name: Kind(
            {each: required for each, required in kind.attributes.items() if each not in file_attributes}, kind.children
        )
        for name, kind in kinds("routes_file.xsd").items()
    }
    children = {"route": "route within"}
    rates = dict.fromkeys(("begin", "end", *_FLOW_RATES), False)
    return types | {
        "routesType": Kind(
            children={name: name for name in ("vType", "vTypeDistribution", "route", "vehicle", "flow")}
        ),
        "vType": types["vTypeType"],
        "vTypeDistribution": types["vTypeDistributionType"],
        "route": Kind({"id": True, "edges": True, "color": False}),
        "route within": Kind({"edges": True}),
        "vehicle": Kind({"id": True, "depart": False, **dict.fromkeys(_DEPARTS, False)}, children),
        "flow": Kind({"id": True, **rates, **dict.fromkeys(_DEPARTS, False)}, children),
    }


def _vehicle_type(path: Path, element: ElementTree.Element) -> VehicleType:
    return VehicleType(
        name=_attribute(path, element, "id"),
        length_m=_number(path, element, "length", VehicleType.length_m),
        width_m=_number(path, element, "width", VehicleType.width_m),
        max_speed_mps=_number(path, element, "maxSpeed", VehicleType.max_speed_mps),
        lane_changes=element.get("laneChangeModel", ""),
    )


def _departure(
    path: Path, element: ElementTree.Element, routes: Mapping[str, tuple[str, ...]], types: set[str]
) -> Departure:
    name = _attribute(path, element, "id")
    kind = element.get("type", _DEFAULT_TYPE)
    if kind not in types:
        raise UsageError.of(path, f"{element.tag} {name}", f"unknown vehicle type {kind!r}", nearest(kind, types))
    own_route = element.find("route")
    if own_route is not None:
        edges = tuple(own_route.get("edges", "").split())
    else:
        route = _attribute(path, element, "route")
        if route not in routes:
            raise UsageError.of(path, f"{element.tag} {name}", f"unknown route {route!r}", nearest(route, routes))
        edges = routes[route]
    if not edges:
        raise UsageError.of(path, f"{element.tag} {name}", "its route has no edges", "give the route's edges")
    return Departure(
        name=name,
        vehicle_type=kind,
        edges=edges,
        depart_s=_number(path, element, "begin" if element.tag == "flow" else "depart", 0.0),
        lane=element.get("departLane", "first"),
        position=element.get("departPos", "base"),
        speed=element.get("departSpeed", "0"),
    )


def _flow(path: Path, element: ElementTree.Element, departure: Departure) -> Flow:
    rates = [name for name in _FLOW_RATES if element.get(name) is not None]
    if not rates or (rates == ["number"] and element.get("end") is None):
        raise UsageError.of(path, f"flow {departure.name}", "has no rate", f"give one of {', '.join(_FLOW_RATES[1:])}")
    if len(set(rates) - {"number"}) > 1:
        raise UsageError.of(path, f"flow {departure.name}", f"has its rate twice: {', '.join(rates)}", "give one")
    end = _number(path, element, "end", np.inf)
    if end <= departure.depart_s:
        raise UsageError.of(path, f"flow {departure.name}.end", "does not lie after its begin", "give a later end")
    number = int(_number(path, element, "number", 0)) if "number" in rates else None
    period = None
    if "vehsPerHour" in rates:
        period = 3600.0 / _number(path, element, "vehsPerHour", 1.0)
    elif "period" in rates:
        period = _number(path, element, "period", 1.0)
    elif "number" in rates:
        period = (end - departure.depart_s) / max(number or 1, 1)
        if period < _LEAST_PERIOD_S:
            message = f"one vehicle every {period:g} s is more than the capacity of a lane"
            raise UsageError.of(path, f"flow {departure.name}.number", message, "give a smaller number")
    probability = _number(path, element, "probability", 0.0) if "probability" in rates else None
    return Flow(departure=departure, end_s=end, period_s=period, probability_per_s=probability, number=number)


def _expand(flow: Flow, until_s: float, generator: np.random.Generator) -> list[Departure]:
    """The departures of a flow before `until_s`, named as in SUMO: f.0, f.1 and so on."""
    first, end = flow.departure.depart_s, min(flow.end_s, until_s)
    if flow.period_s is not None:
        times: FloatArray = np.arange(first, end, flow.period_s)
    else:
        seconds = np.arange(first, end, 1.0)
        times = seconds[generator.random(len(seconds)) < (flow.probability_per_s or 0.0)]
    if flow.number is not None:
        times = times[: flow.number]
    template = flow.departure
    return [replace(template, name=f"{template.name}.{k}", depart_s=float(time)) for k, time in enumerate(times)]


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
            f"{value[:60]!r} is not a number that is possible here",
            f"give a number of seconds, metres or m/s, up to {most:g}",
        )
    return number
