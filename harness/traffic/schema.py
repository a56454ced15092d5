"""What SUMO's own schemas allow in its files: elements, their attributes, what may stand within them.

SUMO without validation passes over what it doesn't know, and some of what it knows makes it read or write other files:
an `<include>`, a detector, the device of a vehicle type. Here a file holds what its schema declares, and of that only
what a scene needs.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import sumo
from sumolib.net.lane import SUMO_VEHICLE_CLASSES

from harness.config.toml_reading import nearest
from harness.errors import Problem

_XSD = "{http://www.w3.org/2001/XMLSchema}"
_FOLDER = Path(sumo.SUMO_HOME) / "data" / "xsd"
_MOST_PROBLEMS = 20
_OF_OTHER_FILES = ("file", "output", "device", "has.")  # in a param's key: files and what writes them
_FOLLOWING = "carFollowing-"
CLASSES = {*SUMO_VEHICLE_CLASSES, "all", "ignoring", "drone", "aircraft"}  # of vehicles, in permissions and types
_OF_CLASSES = ("allow", "disallow", "prefer", "vClass")


@dataclass(frozen=True)
class Kind:
    """What an element may hold: attributes (True: it must have it), and the kind of each element within."""

    attributes: Mapping[str, bool] = field(default_factory=dict)
    children: Mapping[str, str] = field(default_factory=dict)


@cache
def kinds(name: str) -> Mapping[str, Kind]:
    """The kinds that one of SUMO's schemas declares, by name; that of the root element by the element's name."""
    found: dict[str, Kind] = {}
    for file in _with_includes(_FOLDER / name):
        root = ElementTree.parse(file).getroot()
        for element in root.findall(f"{_XSD}element"):
            found[element.get("name", "")] = Kind(children={element.get("name", ""): element.get("type", "")})
        for declared in root.findall(f"{_XSD}complexType"):
            found[declared.get("name", "")] = _kind(declared)
        bases = {
            declared.get("name", ""): str(extension.get("base"))
            for declared in root.findall(f"{_XSD}complexType")
            for extension in declared.iter(f"{_XSD}extension")
        }
        for name_of, base in bases.items():
            if base in found:
                own, inherited = found[name_of], found[base]
                found[name_of] = Kind(
                    {**inherited.attributes, **own.attributes}, {**inherited.children, **own.children}
                )
    return found


def _with_includes(file: Path) -> list[Path]:
    """A schema and what it includes, directly or not; what is included comes first, once."""
    files: dict[Path, None] = {}
    for include in ElementTree.parse(file).getroot().findall(f"{_XSD}include"):
        inner = Path(os.path.normpath(file.parent / include.get("schemaLocation", "")))
        files |= dict.fromkeys(_with_includes(inner))
    return [*files, file]


def _kind(declared: ElementTree.Element) -> Kind:
    attributes = {each.get("name", ""): each.get("use") == "required" for each in declared.iter(f"{_XSD}attribute")}
    children = {each.get("name", ""): each.get("type", "") for each in declared.iter(f"{_XSD}element")}
    return Kind(attributes, children)


def problems_in(
    path: Path, root: ElementTree.Element, known: Mapping[str, Kind], kind: str, within: str = ""
) -> Iterator[Problem]:
    """What is wrong with an element of this kind and all that it holds, as names go; the first few."""
    for count, problem in enumerate(_problems(str(path), root, known, kind, within or root.tag)):
        if count == _MOST_PROBLEMS:
            return
        yield problem


def _problems(
    path: str, element: ElementTree.Element, known: Mapping[str, Kind], kind: str, where: str
) -> Iterator[Problem]:
    allowed = known.get(kind, Kind())
    for name in element.attrib:
        if name not in allowed.attributes and not name.startswith("{http://www.w3.org/2001/XMLSchema-instance}"):
            yield Problem(path, where, f"unknown attribute {name!r}", _nearest(name, allowed.attributes))
    for name, required in allowed.attributes.items():
        if required and name not in element.attrib:
            yield Problem(path, where, f"has no {name!r}", f"give every {element.tag} its {name}")
    for name in _OF_CLASSES:
        for each in element.get(name, "").split():
            if each not in CLASSES:
                message = f"SUMO knows no class of vehicles {each[:60]!r}"
                yield Problem(path, f"{where}.{name}", message, nearest(each, CLASSES))
    if element.tag == "param" and any(part in element.get("key", "").lower() for part in _OF_OTHER_FILES):
        message = f"a param {element.get('key')!r} makes SUMO read or write other files"
        yield Problem(path, where, message, "leave it out: the harness records every game itself")
    for child in element:
        inner = f"{child.tag} {child.get('id')}" if child.get("id") else str(child.tag)
        if " " in where and not child.get("id"):
            inner = f"{where}.{child.tag}"
        if not isinstance(child.tag, str) or child.tag not in allowed.children:
            yield Problem(path, str(child.tag), "is not understood here", _nearest(str(child.tag), allowed.children))
        else:
            yield from _problems(path, child, known, allowed.children[child.tag], inner)


def _nearest(name: str, valid: Mapping[str, object]) -> str:
    names = [each for each in valid if not each.startswith(_FOLLOWING)]
    return nearest(name, names) if names else "leave it out"
