"""Persons of a route file: `<person>` and `<personFlow>` with one walk. SUMO moves them.

libsumo inserts a person with the edges of its walk. Rides, stops and journeys by several means need vehicles and stops
that wait for one another, which the harness does not insert.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from xml.etree import ElementTree

from harness.config.toml_reading import nearest
from harness.errors import Problem, UsageError
from harness.road.demand.route_elements import Types, ranged
from harness.road.demand.route_file import DESIRED_SPEEDS_MPS, SIZES_M, Departure, VehicleType
from harness.road.xml.element_kinds import ElementKind
from harness.road.xml.xml_file import number_in, number_of, required, seconds_in

PEOPLE = ("person", "personFlow")
PERSONS_RATES = ("number", "period", "personsPerHour", "perHour", "probability")
DEFAULT_PERSONS_TYPE = "DEFAULT_PEDTYPE"
PLACES = ("base", "center", "max", "random")
"""Words for places along an edge."""
_CLASS = "pedestrian"
PERSONS_TYPE = VehicleType(
    name=DEFAULT_PERSONS_TYPE,
    length_m=SIZES_M[_CLASS][0],
    width_m=SIZES_M[_CLASS][1],
    max_speed_mps=37.58 / 3.6,
    desired_speed_mps=DESIRED_SPEEDS_MPS[_CLASS],
    vehicle_class=_CLASS,
)
"""SUMO's type of persons that have no other."""
_STAGES = ("ride", "stop", "personTrip", "transport", "tranship", "access")
_NO_STAGES = ("is not supported: no vehicle takes persons along, and nothing comes that they wait for", "remove it")
_PLACES = ("busStop", "trainStop", "parkingArea", "containerStop", "chargingStation", "route", "viaJunctions")
_NOT_EDGES = tuple(f"{end}{kind}" for end in ("from", "to") for kind in ("Taz", "XY", "LonLat", "Junction"))
_REFUSED_OF_WALKS = {
    **dict.fromkeys((*_PLACES, *_NOT_EDGES), ("is not supported", "give edges, or from and to")),
    "duration": ("is not supported", "give a speed"),
    **dict.fromkeys(("departPosLat", "departLane"), ("is not supported: SUMO chooses the place", "leave it out")),
}
_UNUSED_OF_WALKS = ("cost", "routeLength", "exitTimes", "started", "ended", "waitingTime")
_FASTEST_MPS = 12.5


def kinds_of_people() -> dict[str, ElementKind]:
    """The supported attributes and children of persons, flows of them, and walks."""
    person = dict.fromkeys(("type", "departPos", "arrivalPos", "color", "arrival", "speedFactor"), False)
    inside = {"walk": "walk", "param": "param"}
    rates = dict.fromkeys(("begin", "end", *PERSONS_RATES), False)
    walk = ("edges", "from", "to", "departPos", "arrivalPos", "speed", *_UNUSED_OF_WALKS)
    return {
        "person": ElementKind({"id": True, "depart": True, **person}, inside),
        "personFlow": ElementKind({"id": True, **rates, **person}, inside),
        "walk": ElementKind(dict.fromkeys(walk, False), {"param": "param"}),
    }


def without_other_stages(path: Path, root: ElementTree.Element) -> Iterator[Problem]:
    """A problem for each kind of stage that is no walk, and for each unsupported attribute of walks, with their
    numbers. Both are removed from the tree."""
    found: Counter[tuple[str, str, str]] = Counter()
    for person in [each for each in root if each.tag in PEOPLE]:
        for stage in [each for each in person if each.tag in _STAGES]:
            message, remedy = _NO_STAGES
            found[f"{person.tag}.{stage.tag}", message, remedy] += 1
            person.remove(stage)
        for walk in person.findall("walk"):
            for name in _REFUSED_OF_WALKS.keys() & walk.attrib.keys():
                message, remedy = _REFUSED_OF_WALKS[name]
                found[f"walk.{name}", message, remedy] += 1
                del walk.attrib[name]
    for (key, message, remedy), count in sorted(found.items()):
        yield Problem(str(path), key, message if count == 1 else f"{message} ({count:,} times)", remedy)


def person_in(path: Path, element: ElementTree.Element, types: Types) -> Departure:
    """The person that an element describes, or the first one of its flow. Raises UsageError."""
    where = f"{element.tag} {required(path, element, 'id')}"
    problem = partial(UsageError.of, path)
    kind = element.get("type", DEFAULT_PERSONS_TYPE)
    if kind not in types.names():
        raise problem(where, f"unknown type {kind!r}", nearest(kind, types.names()))
    for name in types.mixes[kind].types if kind in types.mixes else (kind,):
        if types.types[name].vehicle_class != _CLASS:
            message = f"its type {name!r} is of the class {types.types[name].vehicle_class}"
            raise problem(f"{where}.type", message, f'give a vType with vClass="{_CLASS}"')
    walks = element.findall("walk")
    if len(walks) != 1:
        message = f"has {len(walks) or 'no'} {'walks' if walks else 'walk'}, one is possible"
        raise problem(where, message, "give one walk over all edges")
    walk = walks[0]
    edges, ends = tuple(walk.get("edges", "").split()), tuple(filter(None, (walk.get("from"), walk.get("to"))))
    if not edges and len(ends) != 2:
        raise problem(f"{where}.walk", "has no edges", "give its edges, or from and to")
    arrival = walk.get("arrivalPos", element.get("arrivalPos", "center"))
    speed = number_in(path, f"{where}.walk", walk, "speed", above=0.0, most=_FASTEST_MPS)
    return Departure(
        name=required(path, element, "id"),
        vehicle_type=kind,
        edges=edges,
        trip=() if edges else ends,
        depart_s=seconds_in(path, where, element, "begin" if element.tag == "personFlow" else "depart") or 0.0,
        lane="",
        position=_place(path, where, "departPos", walk.get("departPos", element.get("departPos", "0"))),
        speed="" if speed is None else f"{speed:g}",
        arrival=(
            "",
            _place(path, where, "arrivalPos", arrival),
            "",
        ),
        speed_factor=ranged(path, element, "speedFactor", 1.0) if element.get("speedFactor") else None,
        on_foot=True,
    )


def _place(path: Path, where: str, name: str, text: str) -> str:
    """A place along an edge: a number of metres, or a word of `PLACES`. Raises UsageError."""
    if text not in PLACES and not math.isfinite(number_of(text)):
        message = f"{text[:60]!r} is not a place along an edge"
        raise UsageError.of(path, f"{where}.{name}", message, f"give metres, or {nearest(text, PLACES)}")
    return text
