"""Vehicle types, routes and their distributions in a route file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from math import isnan
from pathlib import Path
from xml.etree import ElementTree

from harness.config.toml_reading import nearest
from harness.errors import Problem, UsageError, collect
from harness.road.demand.route_file import (
    CAR_SIZE_M,
    DEFAULT_TYPE,
    DESIRED_SPEEDS_MPS,
    LEAST_PERIOD_S,
    SIZES_M,
    STEADY,
    Mix,
    RouteChoice,
    VehicleType,
)
from harness.road.demand.stops import stop_in
from harness.road.xml.xml_file import number_in, number_of, required

_MOST_EDGES = 10_000
_BESIDE_STEADY = {
    *("id", "vClass", "length", "width", "height", "minGap", "maxSpeed", "speedFactor", "color", "guiShape"),
    *("accel", "decel", "emergencyDecel", "tau"),
}
"""The attributes that a steady vType may have beside `STEADY`."""
# the range of each number: above the first value, up to the second
_RANGES = {
    "length": (0.0, 100.0),
    "width": (0.0, 10.0),
    "maxSpeed": (0.0, 200.0),
    "desiredMaxSpeed": (0.0, 200.0),
    "vehsPerHour": (0.0, 3600.0 / LEAST_PERIOD_S),
    "personsPerHour": (0.0, 3600.0 / LEAST_PERIOD_S),
    "perHour": (0.0, 3600.0 / LEAST_PERIOD_S),
    "period": (LEAST_PERIOD_S * 0.999, 1e7),
    "probability": (-0.001, 1.0),
    "speedFactor": (0.0, 10.0),
    "number": (-0.001, 1e7),
}


@dataclass(frozen=True)
class Types:
    """The vehicle types of a file, and their distributions."""

    types: Mapping[str, VehicleType]
    mixes: Mapping[str, Mix]

    def names(self) -> set[str]:
        """All names that a vehicle may give as its type."""
        return set(self.types) | set(self.mixes)


@dataclass(frozen=True)
class NamedRoutes:
    """The routes and route distributions of a file by name, each as the routes to choose from, and its bus stops."""

    routes: Mapping[str, tuple[RouteChoice, ...]]
    bus_stops: Mapping[str, ElementTree.Element]


def ranged(path: Path, element: ElementTree.Element, name: str, default: float) -> float:
    """The number of an attribute in its range. Raises UsageError."""
    above, most = _RANGES[name]
    number = number_in(path, f"{element.tag} {element.get('id', '')}", element, name, above=above, most=most)
    return default if number is None else number


def read_types(path: Path, root: ElementTree.Element, problems: list[Problem]) -> Types:
    """The vehicle types of a file; mistakes are added to `problems`."""
    types = {DEFAULT_TYPE: VehicleType(name=DEFAULT_TYPE)}
    weights: dict[str, float] = {}
    for element in root.iter("vType"):
        if element.get("refId") is not None:
            continue
        vehicle_type = collect(problems, partial(_vehicle_type, path, element))
        if vehicle_type is not None:
            types[vehicle_type.name] = vehicle_type
            share = collect(problems, partial(_share, path, element))
            if share is not None:
                weights[vehicle_type.name] = share
    mixes = {}
    for element in root.iter("vTypeDistribution"):
        mix = collect(problems, partial(_mix, path, element, types, weights))
        if mix is not None:
            mixes[required(path, element, "id")] = mix
    return Types({name: each for name, each in types.items() if name not in mixes}, mixes)


def read_routes(path: Path, root: ElementTree.Element, problems: list[Problem]) -> NamedRoutes:
    """The routes, route distributions and bus stops of a file; mistakes are added to `problems`."""
    bus_stops = {element.get("id", ""): element for element in root.findall("busStop")}
    for element in bus_stops.values():
        collect(problems, partial(_check_bus_stop, path, element))
    routes: dict[str, tuple[RouteChoice, ...]] = {}
    for element in [*root.findall("route"), *root.findall("routeDistribution/route")]:
        if element.get("id") and element.get("edges") is not None:
            route = collect(problems, partial(route_in, path, element, bus_stops))
            if route is not None:
                routes[required(path, element, "id")] = (route,)
    for element in root.findall("routeDistribution"):
        choices = collect(problems, partial(choices_in, path, element, NamedRoutes(routes, bus_stops)))
        if choices is not None:
            routes[required(path, element, "id")] = choices
    return NamedRoutes(routes, bus_stops)


def route_in(path: Path, element: ElementTree.Element, bus_stops: Mapping[str, ElementTree.Element]) -> RouteChoice:
    """The route that an element writes out. Raises UsageError."""
    where = f"route {element.get('id')}" if element.get("id") else "route"
    edges = tuple(element.get("edges", "").split())
    passes = 1 + int(number_in(path, where, element, "repeat", above=-0.001, most=1e6) or 0)
    if len(edges) * passes > _MOST_EDGES:
        message = f"has {len(edges) * passes:,} edges, up to {_MOST_EDGES:,} are possible"
        raise UsageError.of(path, f"{where}.repeat", message, "choose fewer repetitions")
    stops = tuple(stop_in(path, where, each, bus_stops) for each in element.findall("stop"))
    cycle_s = number_in(path, where, element, "cycleTime", above=0.0, most=1e6) or 0.0
    share = _share(path, element)
    return RouteChoice(
        share=1.0 if share is None else share,
        edges=edges * passes,
        stops=tuple(stop.later(k * cycle_s) for k in range(passes) for stop in stops),
    )


def choices_in(path: Path, element: ElementTree.Element, named: NamedRoutes) -> tuple[RouteChoice, ...]:
    """The routes of a route distribution. Raises UsageError."""
    where = f"routeDistribution {element.get('id')}" if element.get("id") else "routeDistribution"

    def listed(name: str, share: float | None) -> list[RouteChoice]:
        if name not in named.routes:
            raise UsageError.of(path, where, f"unknown route {name!r}", nearest(name, named.routes))
        return [each if share is None else replace(each, share=share) for each in named.routes[name]]

    choices: list[RouteChoice] = []
    names = element.get("routes", "").split()
    for name, share in zip(names, _shares(path, where, element, len(names)), strict=True):
        choices += listed(name, share)
    for child in element.findall("route"):
        if child.get("edges") is None:
            choices += listed(child.get("refId", ""), _share(path, child))
        else:
            choices.append(route_in(path, child, named.bus_stops))
    choices = [each for each in choices if each.share > 0.0]
    if not choices:
        raise UsageError.of(path, where, "has no route with a probability above 0", "give it routes")
    return tuple(choices)


def _vehicle_type(path: Path, element: ElementTree.Element) -> VehicleType:
    vehicle_class = element.get("vClass", VehicleType.vehicle_class)
    length_m, width_m = SIZES_M.get(element.get("vClass", ""), CAR_SIZE_M)
    desired_mps = DESIRED_SPEEDS_MPS.get(vehicle_class, VehicleType.desired_speed_mps)
    return VehicleType(
        name=required(path, element, "id"),
        length_m=ranged(path, element, "length", length_m),
        width_m=ranged(path, element, "width", width_m),
        max_speed_mps=ranged(path, element, "maxSpeed", VehicleType.max_speed_mps),
        desired_speed_mps=ranged(path, element, "desiredMaxSpeed", desired_mps),
        lane_changes=element.get("laneChangeModel", ""),
        vehicle_class=vehicle_class,
        steady=_is_steady(element),
    )


def _is_steady(element: ElementTree.Element) -> bool:
    drawn = len(element) or isnan(number_of(element.get("speedFactor", "1")))  # params, or a distribution
    others = element.attrib.keys() - STEADY.keys() - _BESIDE_STEADY
    has_all = all(number_of(element.get(name, "")) == number_of(value) for name, value in STEADY.items())
    return has_all and not others and not drawn


def _mix(
    path: Path, element: ElementTree.Element, types: Mapping[str, VehicleType], weights: Mapping[str, float]
) -> Mix:
    where = f"vTypeDistribution {required(path, element, 'id')}"
    names = element.get("vTypes", "").split()
    listed = [*zip(names, _shares(path, where, element, len(names)), strict=True)]
    for child in element.findall("vType"):
        name = required(path, child, "id" if child.get("refId") is None else "refId")
        listed.append((name, _share(path, child)))
    members: list[tuple[str, float]] = []
    for name, share in listed:
        if name not in types:
            raise UsageError.of(path, where, f"unknown vehicle type {name!r}", nearest(name, types))
        members.append((name, weights.get(name, 1.0) if share is None else share))
    members = [each for each in members if each[1] > 0.0]
    if not members:
        raise UsageError.of(path, where, "has no vehicle type with a probability above 0", "give it vehicle types")
    return Mix(types=tuple(name for name, _ in members), shares=tuple(share for _, share in members))


def _share(path: Path, element: ElementTree.Element) -> float | None:
    where = f"{element.tag} {element.get('id', '')}"
    return number_in(path, where, element, "probability", above=-0.001, most=1e9)


def _shares(path: Path, where: str, element: ElementTree.Element, count: int) -> list[float | None]:
    """The first `count` probabilities of a distribution; None for those that it does not give."""
    text = element.get("probabilities", "")
    shares = [number_of(each) for each in text.split()]
    if not all(0.0 <= each <= 1e9 for each in shares):
        message = f"{text[:60]!r} is not a list of numbers that are possible here"
        raise UsageError.of(path, f"{where}.probabilities", message, "give a number from 0 on for each")
    return [*shares, *[None] * count][:count]


def _check_bus_stop(path: Path, element: ElementTree.Element) -> None:
    where = f"busStop {required(path, element, 'id')}"
    required(path, element, "lane")
    for name in ("startPos", "endPos"):
        number_in(path, where, element, name)
