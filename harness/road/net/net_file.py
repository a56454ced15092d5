"""Checks of a net file before any other use: its names, its numbers and its references.

SUMO does not validate the numbers of a net, and invalid ones may crash it (SIGSEGV).
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from graphlib import CycleError, TopologicalSorter
from itertools import chain, islice
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from harness.config.toml_reading import nearest
from harness.errors import MOST_PROBLEMS, Problem, UsageError
from harness.game.arrays import FloatArray
from harness.road.xml.element_kinds import drop_ignored, problems_in
from harness.road.xml.sumo_schema import attributes_of
from harness.road.xml.xml_file import number_of, parse_xml

_REMEDY = "build it with netconvert or netedit"
_FARTHEST_M = 2e7  # from the origin of any map projection
_WIDEST_M = 100_000.0
_MOST_CELLS, _CELL_M = 4e6, 20.0  # of the grid of rails
_MOST_LANES = 63
_MOST_LINKS = 10_000  # of a traffic light
_REQUIRED = {
    "location": ("netOffset", "convBoundary", "origBoundary", "projParameter"),
    "edge": ("id",),
    "junction": ("id", "type", "incLanes", "intLanes"),
    "request": ("index", "response", "foes"),
    "connection": ("from", "to", "fromLane", "toLane", "dir", "state"),
    "roundabout": ("nodes", "edges"),
    "tlLogic": ("id",),
}
_FUNCTIONS = ("normal", "internal", "connector", "crossing", "walkingarea")
_MAY_BE_EMPTY = ("incLanes", "intLanes")
_INTEGERS = {
    "edge": ("priority",),
    "lane": ("index",),
    "connection": ("fromLane", "toLane", "linkIndex", "linkIndex2"),
    "request": ("index",),
}
_MAY_BE_NEGATIVE = ("priority", "linkIndex", "linkIndex2")  # netconvert writes a link index of -1 where no light rules
_INDEX, _INTEGER = re.compile(r"\d{1,6}", re.ASCII), re.compile(r"-?\d{1,6}", re.ASCII)
_CHILDREN = {
    "net": "location type edge tlLogic junction connection prohibition roundabout taz",
    "type": "restriction meso laneType",
    "taz": "tazSource tazSink",
    "edge": "lane stopOffset",
    "lane": "neigh stopOffset",
    "tlLogic": "phase condition assignment function",
    "junction": "request",
    "connection": "conflict",
}
_KINDS = {tag: (*children.split(), "param") for tag, children in _CHILDREN.items()}
"""The elements of a net that SUMO and the harness read. All others have params only."""


class CheckedNet(NamedTuple):
    """The root of a net without the attributes that SUMO ignores, and a warning of these, in a line each."""

    root: ElementTree.Element
    warnings: tuple[str, ...]


def check_net(path: Path) -> CheckedNet:
    """Read a net. Raises UsageError, with file and element, for an invalid net, or one that makes SUMO use other
    files."""
    root = parse_xml(path)
    if root.tag != "net":
        raise UsageError.of(path, str(root.tag), "is not a SUMO net: its root is not net", _REMEDY)
    warnings = drop_ignored(path, root, attributes_of("net_file"))
    if unknown := problems_in(path, root, _KINDS):
        raise UsageError(unknown)
    faults = chain(_attribute_faults(root), _number_faults(root), _reference_faults(root), _signal_faults(root))
    problems = [Problem(str(path), key, message, _REMEDY) for key, message in islice(faults, MOST_PROBLEMS)]
    if problems:
        raise UsageError(problems)
    if too_large := _too_large(root):
        raise UsageError.of(path, "", too_large, "cut out the part that the scene needs")
    return CheckedNet(root, warnings)


def _named(element: ElementTree.Element) -> str:
    if element.tag == "connection":
        return f"connection from {element.get('from')} to {element.get('to')}"
    return f"{element.tag} {element.get('id')}" if element.get("id") else str(element.tag)


def _attribute_faults(root: ElementTree.Element) -> Iterator[tuple[str, str]]:
    """Key and message of each attribute that is missing, and of each index or priority that is not an integer."""
    for parent in root:
        for element in (parent, *parent):
            inside = element is not parent and not element.get("id")
            where = f"{_named(parent)}.{element.tag}" if inside else _named(element)
            for name in _REQUIRED.get(element.tag, ()):
                if not element.get(name) and (element.get(name) is None or name not in _MAY_BE_EMPTY):
                    yield f"{where}.{name}", "is missing or empty"
            for name in _INTEGERS.get(element.tag, ()):
                value = element.get(name)
                if value and not (_INTEGER if name in _MAY_BE_NEGATIVE else _INDEX).fullmatch(value):
                    yield f"{where}.{name}", f"{value[:60]!r} is not an integer that is possible here"


def _number_faults(root: ElementTree.Element) -> Iterator[tuple[str, str]]:
    """Key and message of each invalid number."""
    if not np.isfinite(number_of(root.get("version", ""))):
        yield "net.version", "is no number"
    location = root.find("location")
    boundary = (location.get("convBoundary", "0,0,0,0") if location is not None else "0,0,0,0").split(",")
    if len(boundary) != 4 or not np.isfinite([number_of(each) for each in boundary]).all():
        yield "location.convBoundary", "is not four numbers"
    for lane in root.iter("lane"):
        key, internal = f"lane {lane.get('id')}", lane.get("id", "").startswith(":")
        for name, default, least, most in (
            ("length", "", 0.0, _WIDEST_M),
            ("speed", "", 0.0, 1000.0),
            ("width", "3.2", 0.01, 200.0),
        ):
            value = lane.get(name, default)
            if not least < number_of(value) <= most:
                yield f"{key}.{name}", f"{value[:60]!r} is not above {least:g} and up to {most:g}"
        points = _points(lane.get("shape", ""))
        if points is None or len(points) < 2:
            yield f"{key}.shape", f"{lane.get('shape', '')[:60]!r} is not a line of points x,y"
        elif not internal and not np.ptp(points, axis=0).any():
            yield f"{key}.shape", "is a single point: the lane has no length"
    for junction in root.findall("junction"):
        key = f"junction {junction.get('id')}"
        if not np.isfinite([number_of(junction.get(name, "")) for name in "xy"]).all():
            yield key, "its place is not two numbers"
        if junction.get("shape") and _points(junction.get("shape", "")) is None:
            yield f"{key}.shape", f"{junction.get('shape', '')[:60]!r} is not points x,y"


def _reference_faults(root: ElementTree.Element) -> Iterator[tuple[str, str]]:
    """Key and message of each name that is used twice, and each reference that has no target."""
    junctions = {each.get("id", "") for each in root.findall("junction")}
    lanes: dict[str, list[str]] = {}
    for edge in root.findall("edge"):
        name = edge.get("id", "")
        if name in lanes:
            yield f"edge {name}", "stands twice"
        lanes[name] = [lane.get("id", "") for lane in edge.findall("lane")]
        if lanes[name] != [f"{name}_{k}" for k in range(len(lanes[name]))] or not 0 < len(lanes[name]) <= _MOST_LANES:
            yield f"edge {name}", f"its lanes are not called {name}_0, {name}_1 and so on"
        function = edge.get("function", "normal")
        if function not in _FUNCTIONS:
            yield f"edge {name}.function", f"SUMO has no function {function[:60]!r}; {nearest(function, _FUNCTIONS)}"
        if function == "normal":
            for end in ("from", "to"):
                if edge.get(end) not in junctions:
                    yield f"edge {name}.{end}", _absent("junction", edge.get(end, ""), junctions)
    known = set(chain.from_iterable(lanes.values()))
    for element in root.iter():
        for attribute, kind, names in (
            ("incLanes", "lane", known),
            ("intLanes", "lane", known),
            ("lane", "lane", known),  # of a neigh
            ("bidi", "edge", lanes),
            ("crossingEdges", "edge", lanes),
            ("nodes", "junction", junctions),  # of a roundabout, as its edges
            ("edges", "edge", lanes),
        ):
            for name in element.get(attribute, "").split():
                if name not in names:
                    yield f"{_named(element)}.{attribute}", _absent(kind, name, names)
    following: dict[str, list[str]] = {}
    for link in root.findall("connection"):
        key = _named(link)
        for end in ("from", "to"):
            lane = f"{link.get(end)}_{link.get(f'{end}Lane')}"
            if lane not in known:
                yield f"{key}.{end}", _absent("lane", lane, known)
        via = link.get("via")
        if via and via not in known:
            yield f"{key}.via", _absent("lane", via, known)
        if via and link.get("from", "").startswith(":"):
            following.setdefault(f"{link.get('from')}_{link.get('fromLane')}", []).append(via)
    try:
        TopologicalSorter(following).prepare()
    except CycleError as error:
        yield f"lane {error.args[1][0]}", "leads back to itself inside a junction"


def _absent(kind: str, name: str, names: Collection[str]) -> str:
    return f"there is no {kind} {name[:60]!r}" + (f"; {nearest(name, names)}" if names else "")


def _signal_faults(root: ElementTree.Element) -> Iterator[tuple[str, str]]:
    """Key and message of each traffic light without a programme, or with phases that leave out a link."""
    shortest: dict[str, int] = {}  # number of states in the shortest phase, by light
    for logic in root.findall("tlLogic"):
        name, phases = logic.get("id", ""), logic.findall("phase")
        if not sum(number_of(phase.get("duration", "")) for phase in phases) > 0.0:
            yield f"tlLogic {name}", "its phases have no duration"
        lengths = (len(phase.get("state", "")) for phase in phases)
        shortest[name] = min([*lengths, shortest.get(name, _MOST_LINKS)])
    rails = {each.get("id") for each in root.findall("junction") if each.get("type", "").startswith("rail")}
    named: set[str] = set()
    for link in root.findall("connection"):
        light, index = link.get("tl", ""), number_of(link.get("linkIndex", "0"))
        if not light or light in rails or light in named:  # SUMO makes the programmes of rail signals
            continue
        if light not in shortest:
            named.add(light)
            found = f"; {nearest(light, shortest)}" if shortest else ""
            yield f"tlLogic {light}", f"the traffic light of a connection has no programme{found}"
        elif not index < shortest[light]:
            named.add(light)
            message = f"a connection has link {index:g}, a phase has {shortest[light]} states"
            yield f"tlLogic {light}", message


def _points(shape: str) -> FloatArray | None:
    """[n, 2] the points of a shape; None if it has anything but valid coordinates."""
    parts = [point.split(",") for point in shape.split()]
    if not parts or not all(len(part) in (2, 3) for part in parts):
        return None
    numbers: Sequence[Sequence[float]] = [[number_of(each) for each in part] for part in parts]
    points = np.array([part[:2] for part in numbers])
    within = all(abs(each) <= _FARTHEST_M for part in numbers for each in part)  # false for NaN
    return points if within else None


def _too_large(root: ElementTree.Element) -> str:
    """The message for a net whose grid of rails would be too large; empty if it is not."""
    lines = [_points(lane.get("shape", "")) for lane in root.iter("lane")]
    shapes = [line for line in lines if line is not None]
    if not shapes:
        return ""
    width_m, height_m = np.ptp(np.concatenate(shapes), axis=0)
    if width_m * height_m > _MOST_CELLS * _CELL_M**2 or max(width_m, height_m) > _WIDEST_M:
        return f"is too large for a scene: {width_m / 1e3:,.0f} by {height_m / 1e3:,.0f} km"
    cells = sum(float(np.prod(np.abs(np.diff(line, axis=0)) / _CELL_M + 1.0, axis=1).sum()) for line in shapes)
    return f"has lines that are too long for a scene: {cells:,.0f} fields of 20 m" if cells > _MOST_CELLS else ""
