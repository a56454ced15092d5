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
from harness.road.xml.element_kinds import ElementKind, problems_in

VEHICLES = ("vehicle", "trip", "flow")
PEOPLE = ("person", "personFlow")
FLOWS = ("flow", "personFlow")
FLOW_RATES = ("number", "period", "vehsPerHour", "personsPerHour", "perHour", "probability")
_ROOTS = ("routes", "additional", "flows", "trips")
_NAME = re.compile(r"[^\s|\\'\";,<>&]{1,200}")
_DRAWN_ONLY = ("imgFile", "osgFile", "emissionClass")
_RECORDERS = r"(battery|elechybrid|emissions|fcd|tripinfo|vehroute)"
_RECORDED_ONLY = re.compile(rf"has\.{_RECORDERS}\.device|device\.{_RECORDERS}\..*")


def _kind(children: str, *attributes: str) -> ElementKind:
    return ElementKind(children.split(), " ".join(attributes).split())


_VEHICLE = (
    "id type departLane departPos departSpeed departPosLat departEdge",
    "arrivalLane arrivalPos arrivalSpeed arrivalEdge speedFactor reroute insertionChecks",
    "color line personNumber containerNumber parkingBadges arrivalPosLat fromTaz toTaz",  # without effect
)
_PERSON = "id type departPos arrivalPos color arrival speedFactor"
_FLOW = "begin end number period perHour probability"
_INSIDE = "route routeDistribution stop param"
_KINDS = {
    **dict.fromkeys(
        _ROOTS,
        _kind(" ".join((*VEHICLES, *PEOPLE, "vType vTypeDistribution route routeDistribution interval busStop"))),
    ),
    "vType": ElementKind(),  # SUMO checks its attributes
    "vTypeDistribution": _kind("vType", "id vTypes probabilities"),
    "route": _kind("stop param", "id refId edges repeat cycleTime color cost savings probability routeLength"),
    "routeDistribution": _kind("route", "id last routes probabilities"),
    "vehicle": _kind(_INSIDE, *_VEHICLE, "depart route arrival routeLength"),
    "trip": _kind("stop param", *_VEHICLE, "depart from to via"),
    "flow": _kind(_INSIDE, *_VEHICLE, "route from to via vehsPerHour", _FLOW),
    "interval": _kind("flow", "id begin end"),
    "stop": _kind(
        "param",
        "lane edge busStop startPos endPos friendlyPos duration until parking",
        "arrival actType tripId line started ended actualArrival depart priority",  # without effect
    ),
    "busStop": _kind(
        "param access",
        "id lane startPos endPos",
        "name lines personCapacity parkingLength color angle friendlyPos",  # without effect
    ),
    "access": _kind("", "lane pos length friendlyPos"),
    "person": _kind("walk param", _PERSON, "depart"),
    "personFlow": _kind("walk param", _PERSON, "personsPerHour", _FLOW),
    "walk": _kind(
        "param",
        "edges route from to departPos arrivalPos speed",
        "cost routeLength exitTimes started ended waitingTime",  # without effect
    ),
}


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
    **_each_of("stop", "speed jump jumpUntil extension", "is not supported", "leave it out"),
    **_each_of(
        "person personFlow",
        "ride stop personTrip transport tranship access",
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


def check_content(path: Path, root: ElementTree.Element) -> None:
    """Raise UsageError for unsupported elements and attributes, and for names that SUMO does not allow.

    Removes from the tree what only draws or records.
    """
    if root.tag not in _ROOTS:
        message = "is not a SUMO route file: its root is not routes"
        raise UsageError.of(path, str(root.tag), message, "name a .rou.xml")
    _remove_records(root)
    problems = [*_refused(path, root), *_invalid_names(path, root), *problems_in(path, root, _KINDS, _REFUSED)]
    if problems:
        raise UsageError(problems)


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
