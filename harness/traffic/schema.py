"""Checks of files by SUMO's schemas: elements, their attributes and their children.

Without validation, SUMO ignores unknown elements, and some known elements make it read or write other files: an
`<include>`, a detector, the device of a vehicle type. A file may hold only declared elements that a scene needs.
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
_FILE_KEYS = ("file", "output", "device", "has.")  # parts of a param's key that make SUMO read or write files
_FOLLOWING = "carFollowing-"
CLASSES = {*SUMO_VEHICLE_CLASSES, "all", "ignoring", "drone", "aircraft"}  # vehicle classes
_CLASS_ATTRIBUTES = ("allow", "disallow", "prefer", "vClass")


@dataclass(frozen=True)
class Kind:
    """The content of an element: its attributes (True: required), and the kind of each child by its tag."""

    attributes: Mapping[str, bool] = field(default_factory=dict)
    children: Mapping[str, str] = field(default_factory=dict)


@cache
def kinds(name: str) -> Mapping[str, Kind]:
    """The element kinds that one of SUMO's schemas declares, by name. Root elements are listed by their tags."""
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
    """A schema and all schemas that it includes, each once, included ones first."""
    files: dict[Path, None] = {}
    for include in ElementTree.parse(file).getroot().findall(f"{_XSD}include"):
        inner = Path(os.path.normpath(file.parent / include.get("schemaLocation", "")))
        files |= dict.fromkeys(_with_includes(inner))
    return [*files, file]


def _kind(declared: ElementTree.Element) -> Kind:
    attributes = {each.get("name", ""): each.get("use") == "required" for each in declared.iter(f"{_XSD}attribute")}
    children = {each.get("name", ""): each.get("type", "") for each in declared.iter(f"{_XSD}element")}
    return Kind(attributes, children)


def problems_in(path: Path, root: ElementTree.Element, known: Mapping[str, Kind], kind: str) -> Iterator[Problem]:
    """The first problems with the names of an element of this kind and of its descendants."""
    for count, problem in enumerate(_problems(str(path), root, known, kind=kind, where=root.tag)):
        if count == _MOST_PROBLEMS:
            return
        yield problem


def _problems(
    path: str, element: ElementTree.Element, known: Mapping[str, Kind], *, kind: str, where: str
) -> Iterator[Problem]:
    allowed = known.get(kind, Kind())
    for name in element.attrib:
        if name not in allowed.attributes and not name.startswith("{http://www.w3.org/2001/XMLSchema-instance}"):
            yield Problem(path, where, f"unknown attribute {name!r}", _nearest(name, allowed.attributes))
    for name, required in allowed.attributes.items():
        if required and name not in element.attrib:
            yield Problem(path, where, f"has no {name!r}", f"give every {element.tag} its {name}")
    for name in _CLASS_ATTRIBUTES:
        for each in element.get(name, "").split():
            if each not in CLASSES:
                message = f"SUMO has no vehicle class {each[:60]!r}"
                yield Problem(path, f"{where}.{name}", message, nearest(each, CLASSES))
    if element.tag == "param" and any(part in element.get("key", "").lower() for part in _FILE_KEYS):
        message = f"a param {element.get('key')!r} makes SUMO read or write other files"
        yield Problem(path, where, message, "leave it out: the harness records every game itself")
    for child in element:
        inner = f"{child.tag} {child.get('id')}" if child.get("id") else str(child.tag)
        if " " in where and not child.get("id"):
            inner = f"{where}.{child.tag}"
        if not isinstance(child.tag, str) or child.tag not in allowed.children:
            yield Problem(path, str(child.tag), "is not understood here", _nearest(str(child.tag), allowed.children))
        else:
            yield from _problems(path, child, known, kind=allowed.children[child.tag], where=inner)


def _nearest(name: str, valid: Mapping[str, object]) -> str:
    names = [each for each in valid if not each.startswith(_FOLLOWING)]
    return nearest(name, names) if names else "leave it out"
