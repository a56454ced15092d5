"""The part of SUMO's route files that the harness supports, and the reasons for which it refuses the rest.

What only draws or records a vehicle is removed: pictures, emission classes, and devices that record. They make SUMO
read or write files, and do not change the traffic.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from xml.etree import ElementTree

from harness.errors import Problem, UsageError
from harness.road.xml.element_kinds import drop_ignored, problems_in
from harness.road.xml.sumo_schema import attributes_of

VEHICLES = ("vehicle", "trip", "flow")
PEOPLE = ("person", "personFlow")
FLOWS = ("flow", "personFlow")
FLOW_RATES = ("number", "period", "vehsPerHour", "personsPerHour", "perHour", "probability")
_ROOTS = ("routes", "additional", "flows", "trips")
_NAME = re.compile(r"[^\s|\\'\";,<>&]{1,200}")
_DRAWN_ONLY = ("imgFile", "osgFile", "emissionClass")
_RECORDERS = r"(battery|elechybrid|emissions|fcd|tripinfo|vehroute)"
_RECORDED_ONLY = re.compile(rf"has\.{_RECORDERS}\.device|device\.{_RECORDERS}\..*")


_INSIDE = "route routeDistribution stop param"
_CHILDREN = {
    **dict.fromkeys(
        _ROOTS, " ".join((*VEHICLES, *PEOPLE, "vType vTypeDistribution route routeDistribution interval busStop"))
    ),
    "vType": "param",
    "vTypeDistribution": "vType",
    "route": "stop param",
    "routeDistribution": "route",
    "vehicle": _INSIDE,
    "trip": "stop param",
    "flow": _INSIDE,
    "interval": "flow",
    "stop": "param",
    "busStop": "param access",
    "access": "",
    "person": "walk param",
    "personFlow": "walk param",
    "walk": "param",
}
KINDS = {tag: tuple(children.split()) for tag, children in _CHILDREN.items()}
"""The tags of the children of each element. Its attributes are those of SUMO, but for those that are refused."""


def _each_of(tags: str, names: str, message: str, remedy: str) -> dict[str, tuple[str, str]]:
    return {f"{tag}.{name}": (message, remedy) for tag in tags.split() for name in names.split()}


_REFUSED: Mapping[str, tuple[str, str]] = {
    **dict.fromkeys(("container", "containerFlow"), ("containers are not supported", "remove these elements")),
    "include": ("is not understood here: other files are not read", "copy their content into this file"),
    **_each_of(
        "vehicle trip flow",
        " ".join(f"{end}{kind}" for end in ("from", "to", "via") for kind in ("Junction", "Junctions", "XY", "LonLat")),
        "routes are found between edges only",
        "give edges as from, to and via",
    ),
    **_each_of(
        "stop",
        "trainStop containerStop chargingStation parkingArea lon lat",
        "a stop at such a place is not supported",
        "give the stop's lane, startPos and endPos instead",
    ),
    **_each_of(
        "stop",
        "triggered containerTriggered expected expectedContainers join split",
        "nothing arrives that the stop could wait for",
        "give a duration instead",
    ),
    **_each_of(
        "stop",
        "speed jump jumpUntil extension posLat index onDemand permitted collision priorEdges priorEdgesLength",
        "is not supported",
        "leave it out",
    ),
    **_each_of("vTypeDistribution", "deterministic", "is not supported", "leave it out"),
    **_each_of("vehicle", "via", "is not supported", "give a route, or write a trip"),
    **_each_of(
        "person personFlow",
        "ride stop personTrip transport tranship access modes vTypes",
        "is not supported: no vehicle takes persons along, and nothing comes that they wait for",
        "remove it",
    ),
    **_each_of(
        "walk",
        " ".join(f"{end}{kind}" for end in ("from", "to") for kind in ("Taz", "XY", "LonLat", "Junction"))
        + " busStop trainStop parkingArea containerStop chargingStation viaJunctions",
        "is not supported",
        "give edges, or from and to",
    ),
    **_each_of("walk", "duration", "is not supported", "give a speed"),
    **_each_of("walk", "departPosLat departLane", "is not supported: SUMO chooses the place", "leave it out"),
}
"""Message and remedy of refused elements, and of attributes and children after the tag of their element."""
_ONLY = {"reroute": ("false", "0"), "insertionChecks": ("all",)}  # the values of attributes that have no other
_CHECKED = {f"{tag}.{name}" for tag in VEHICLES for name in _ONLY}


def check_content(path: Path, root: ElementTree.Element) -> tuple[str, ...]:
    """Remove from the tree what only draws or records, and the attributes that SUMO ignores, with a line of warning for
    each of these.

    Raises UsageError for unsupported elements and attributes, and for names that SUMO does not allow.
    """
    if root.tag not in _ROOTS:
        message = "is not a SUMO route file: its root is not routes"
        raise UsageError.of(path, str(root.tag), message, "name a .rou.xml")
    _remove_records(root)
    problems = [*_refused(path, root), *_invalid_names(path, root), *problems_in(path, root, KINDS, _REFUSED)]
    if problems:
        raise UsageError(problems)
    attributes = {**attributes_of("additional_file"), **attributes_of("routes_file")}
    return drop_ignored(path, root, attributes, _CHECKED)


def _remove_records(root: ElementTree.Element) -> None:
    for element in [each for each in root.iter() if each.tag == "vType" or each.tag in VEHICLES]:
        for name in _DRAWN_ONLY:
            element.attrib.pop(name, None)
        for param in [each for each in element if each.tag == "param"]:
            if _RECORDED_ONLY.fullmatch(param.get("key", "")):
                element.remove(param)


def _refused(path: Path, root: ElementTree.Element) -> Iterator[Problem]:
    """A problem for each kind of element and attribute that is refused, with the number of its occurrences."""
    found: Counter[tuple[str, str, str]] = Counter()
    for element in root.iter():
        inside = (f"{element.tag}.{name}" for name in (*element.attrib, *(child.tag for child in element)))
        for key in (str(element.tag), *inside):
            if key in _REFUSED:
                message, remedy = _REFUSED[key]
                found[key, message, remedy] += 1
        for name, only in _ONLY.items():
            if element.tag in VEHICLES and element.get(name, only[0]) not in only:
                message = f"{element.get(name, '')[:60]!r} is not supported"
                found[f"{element.tag}.{name}", message, f"write {only[0]!r}, or leave it out"] += 1
    for (key, message, remedy), count in found.items():
        yield Problem(str(path), key, message if count == 1 else f"{message} ({count:,} times)", remedy)


def _invalid_names(path: Path, root: ElementTree.Element) -> Iterator[Problem]:
    for element in root.iter():
        name = element.get("id")
        if name and not _NAME.fullmatch(name):
            message = f"{name[:60]!r} can't be a name in SUMO"
            yield Problem(str(path), f"{element.tag}.id", message, "use letters, digits and _")
