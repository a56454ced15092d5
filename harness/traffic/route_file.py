"""What a SUMO route file says: vehicle types, routes, and who departs when.

The harness starts every vehicle itself, relative to the start of each game, so that all games of an arena, however
often they restart, see the same traffic. XML is parsed with entities and external references refused.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from defusedxml import ElementTree as SafeElementTree
from defusedxml.common import DefusedXmlException

from harness.documents.reading import nearest
from harness.errors import UsageError
from harness.game.arrays import FloatArray

_DEFAULT_TYPE = "DEFAULT_VEHTYPE"
_FLOW_RATES = ("number", "period", "vehsPerHour", "probability")


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


def parse_xml(path: Path) -> ElementTree.Element:
    """The root of an XML file. Raises UsageError where it is missing, malformed or carries entities."""
    try:
        return SafeElementTree.parse(path).getroot()
    except FileNotFoundError:
        siblings = [each.name for each in path.parent.glob("*.xml")] or ["(no XML file in the folder)"]
        raise UsageError.of(path, "", "there is no such file", nearest(path.name, siblings)) from None
    except DefusedXmlException as error:
        raise UsageError.of(path, "", f"carries XML entities: {error}", "remove them") from None
    except (ElementTree.ParseError, OSError, ValueError, LookupError, RecursionError) as error:
        raise UsageError.of(path, "", f"is not readable XML: {error}", "open it in netedit and save it again") from None


def read_route_file(path: Path) -> RouteFile:
    """Read a `.rou.xml`. Raises UsageError for what can't be understood."""
    root = parse_xml(path)
    types = {_DEFAULT_TYPE: VehicleType(_DEFAULT_TYPE)}
    only_types = ElementTree.Element("routes")
    for element in root:
        if element.tag in ("vType", "vTypeDistribution"):
            only_types.append(element)
    for element in only_types.iter("vType"):
        name = _attribute(path, element, "id")
        types[name] = VehicleType(
            name,
            _number(path, element, "length", 5.0),
            _number(path, element, "width", 1.8),
            _number(path, element, "maxSpeed", 55.55),
            element.get("laneChangeModel", ""),
        )
    distributions = {_attribute(path, element, "id") for element in root.iter("vTypeDistribution")}
    routes = {
        _attribute(path, element, "id"): tuple(element.get("edges", "").split())
        for element in root
        if element.tag == "route"
    }
    vehicles: dict[str, Departure] = {}
    flows: list[Flow] = []
    for element in root:
        if element.tag in ("vehicle", "flow"):
            departure = _departure(path, element, routes, set(types) | distributions)
            if departure.name in vehicles or departure.name in (flow.departure.name for flow in flows):
                raise UsageError.of(path, f"{element.tag} {departure.name}", "stands twice", "call one something else")
            if element.tag == "vehicle":
                vehicles[departure.name] = departure
            else:
                flows.append(_flow(path, element, departure))
        elif element.tag not in ("vType", "vTypeDistribution", "route"):
            raise UsageError.of(
                path,
                element.tag,
                "is not understood here",
                "use vType, vTypeDistribution, route, vehicle or flow",
            )
    return RouteFile(path, types, vehicles, tuple(flows), ElementTree.tostring(only_types, encoding="unicode"))


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
    try:
        number = float(value)
    except ValueError:
        number = np.nan
    if (
        not np.isfinite(number)
        or number < 0.0
        or (name in ("length", "width", "maxSpeed", "vehsPerHour", "period") and number == 0.0)
        or (name == "probability" and number > 1.0)
    ):
        where = f"{element.tag} {element.get('id', '')}.{name}"
        raise UsageError.of(
            path,
            where,
            f"{value!r} is not a number that makes sense here",
            "give a number of seconds, metres or m/s",
        )
    return number
