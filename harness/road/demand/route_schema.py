"""The part of SUMO's route files that the harness supports, and the reasons for which it refuses the rest.

What only draws or records a vehicle is removed: pictures, emission classes, and devices that record. They make SUMO
read or write files, and do not change the traffic.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

from harness.errors import Problem, UsageError
from harness.road.demand.route_people import PEOPLE, kinds_of_people, without_other_stages
from harness.road.demand.stops import STOP_ATTRIBUTES
from harness.road.xml.element_kinds import PARAM, ElementKind, problems_in

ROOTS = ("routes", "additional", "flows", "trips")
VEHICLES = ("vehicle", "trip", "flow")
FLOW_RATES = ("number", "period", "vehsPerHour", "perHour", "probability")
_NAME = re.compile(r"[^\s|\\'\";,<>&]{1,200}")
_DRAWN_ONLY = ("imgFile", "osgFile", "emissionClass")
_RECORDERS = r"(battery|elechybrid|emissions|fcd|tripinfo|vehroute)"
_RECORDED_ONLY = re.compile(rf"has\.{_RECORDERS}\.device|device\.{_RECORDERS}\..*")
_NO_EFFECT = {
    "vehicle": (
        "color",
        "line",
        "personNumber",
        "containerNumber",
        "parkingBadges",
        "arrivalPosLat",
        "fromTaz",
        "toTaz",
    ),
    "stop": ("arrival", "actType", "tripId", "line", "started", "ended", "actualArrival", "depart", "priority"),
    "busStop": ("name", "lines", "personCapacity", "parkingLength", "color", "angle", "friendlyPos"),
    "route": ("color", "cost", "savings", "probability", "routeLength"),
}

Reason = tuple[str, str]
_NO_CONTAINERS: Reason = ("containers are not supported", "remove these elements")
_NOT_EDGES: Reason = ("routes are found between edges only", "give edges as from, to and via")
_NO_STATION: Reason = ("a stop at such a place is not supported", "give the stop's lane, startPos and endPos instead")
_NO_CAUSE: Reason = ("nothing arrives that the stop could wait for", "give a duration instead")
_REFUSED: Mapping[str, Reason] = {
    **dict.fromkeys(("container", "containerFlow"), _NO_CONTAINERS),
    "include": ("is not understood here: other files are not read", "copy their content into this file"),
}
_REFUSED_OF_VEHICLES: Mapping[str, Reason] = dict.fromkeys(
    (f"{end}{kind}" for end in ("from", "to", "via") for kind in ("Junction", "Junctions", "XY", "LonLat")), _NOT_EDGES
)
_REFUSED_OF_STOPS: Mapping[str, Reason] = {
    **dict.fromkeys(("trainStop", "containerStop", "chargingStation", "parkingArea", "lon", "lat"), _NO_STATION),
    **dict.fromkeys(("triggered", "containerTriggered", "expected", "expectedContainers", "join", "split"), _NO_CAUSE),
    **dict.fromkeys(("speed", "jump", "jumpUntil", "extension"), ("is not supported", "leave it out")),
}
_ONLY = {"reroute": ("false", "0"), "insertionChecks": ("all",)}  # the values of attributes that have no other


def check_content(path: Path, root: ElementTree.Element) -> None:
    """Raise UsageError for unsupported elements and attributes, and for names that SUMO does not allow.

    Removes from the tree what only draws or records.
    """
    if root.tag not in ROOTS:
        message = "is not a SUMO route file: its root is not routes"
        raise UsageError.of(path, str(root.tag), message, "name a .rou.xml")
    _remove_records(root)
    problems = [*without_other_stages(path, root), *_refused(path, root), *_invalid_names(path, root)]
    for parent in [root, *root.iter("interval")]:
        for element in [each for each in parent if each.tag in _REFUSED]:
            parent.remove(element)
    for element in root.iter():
        for name in _reasons_of(element) | _ONLY.keys():
            element.attrib.pop(name, None)
    problems += problems_in(path, root, _supported_kinds(), "root")
    if problems:
        raise UsageError(problems)


def _remove_records(root: ElementTree.Element) -> None:
    for element in [each for each in root.iter() if each.tag == "vType" or each.tag in VEHICLES]:
        for name in _DRAWN_ONLY:
            element.attrib.pop(name, None)
        for param in [each for each in element if each.tag == "param"]:
            if _RECORDED_ONLY.fullmatch(param.get("key", "")):
                element.remove(param)


def _reasons_of(element: ElementTree.Element) -> Mapping[str, Reason]:
    """The refused attributes of an element, with the reasons."""
    if element.tag in VEHICLES:
        return _REFUSED_OF_VEHICLES
    return _REFUSED_OF_STOPS if element.tag == "stop" else {}


def _refused(path: Path, root: ElementTree.Element) -> Iterator[Problem]:
    """A problem for each kind of element and attribute that is refused, with the number of its occurrences."""
    found: Counter[tuple[str, str, str]] = Counter()
    for element in root.iter():
        if element.tag in _REFUSED:
            message, remedy = _REFUSED[element.tag]
            found[element.tag, message, remedy] += 1
        for name, (message, remedy) in _reasons_of(element).items():
            if element.get(name) is not None:
                found[f"{element.tag}.{name}", message, remedy] += 1
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


@cache
def _supported_kinds() -> Mapping[str, ElementKind]:
    """What the harness reads, and vehicle types, whose attributes SUMO checks."""
    departs = ("type", "departLane", "departPos", "departSpeed", "departPosLat", "departEdge")
    arrives = ("arrivalLane", "arrivalPos", "arrivalSpeed", "arrivalEdge", "speedFactor", *_NO_EFFECT["vehicle"])
    vehicle, between = dict.fromkeys((*departs, *arrives), False), dict.fromkeys(("from", "to", "via"), False)
    once = {"id": True, "depart": False, **vehicle}
    routed = {"route": "route within", "routeDistribution": "routes within", "stop": "stop", "param": "param"}
    route = dict.fromkeys(("repeat", "cycleTime", *_NO_EFFECT["route"]), False)
    rates = dict.fromkeys(("begin", "end", *FLOW_RATES), False)
    unused = ("arrival", "routeLength")
    top = (*VEHICLES, *PEOPLE, "vType", "vTypeDistribution", "route", "routeDistribution", "interval", "busStop")
    return {
        "root": ElementKind(children={name: name for name in top}),
        "vType": ElementKind(None, {"param": "param"}),
        "vTypeDistribution": ElementKind({"id": True, "vTypes": False, "probabilities": False}, {"vType": "vType"}),
        "route": ElementKind({"id": True, "edges": True, **route}, {"stop": "stop", "param": "param"}),
        "route within": ElementKind({"id": False, "edges": True, **route}, {"stop": "stop", "param": "param"}),
        "route listed": ElementKind(
            {"id": False, "refId": False, "edges": False, **route}, {"stop": "stop", "param": "param"}
        ),
        "routeDistribution": ElementKind(
            {"id": True, "last": False, "routes": False, "probabilities": False}, {"route": "route listed"}
        ),
        "routes within": ElementKind(
            {"last": False, "routes": False, "probabilities": False}, {"route": "route listed"}
        ),
        "vehicle": ElementKind({**once, "route": False, **dict.fromkeys(unused, False)}, routed),
        "trip": ElementKind({**once, **between}, {"stop": "stop", "param": "param"}),
        "flow": ElementKind({"id": True, "route": False, **rates, **vehicle, **between}, routed),
        "interval": ElementKind({"begin": True, "end": True, "id": False}, {"flow": "flow"}),
        "stop": ElementKind(dict.fromkeys((*STOP_ATTRIBUTES, *_NO_EFFECT["stop"]), False), {"param": "param"}),
        "busStop": ElementKind(
            {
                "id": True,
                "lane": True,
                "startPos": False,
                "endPos": False,
                **dict.fromkeys(_NO_EFFECT["busStop"], False),
            },
            {"param": "param", "access": "access"},
        ),
        "access": ElementKind(dict.fromkeys(("lane", "pos", "length", "friendlyPos"), False)),
        "param": PARAM,
        **kinds_of_people(),
    }
