"""Checks of the elements of SUMO's files: a file may hold only those that a scene needs.

SUMO ignores unknown elements, and some known ones make it read or write other files: an `<include>`, a detector, the
device of a vehicle type. What SUMO's schemas say beyond that, SUMO checks itself: see `load_check`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

from sumolib.net.lane import SUMO_VEHICLE_CLASSES

from harness.config.toml_reading import nearest
from harness.errors import Problem

_MOST_PROBLEMS = 20
_FILE_KEYS = ("file", "output", "device", "has.")  # parts of a param's key that make SUMO read or write files
CLASSES = {*SUMO_VEHICLE_CLASSES, "all", "ignoring", "drone", "aircraft"}  # vehicle classes
_CLASS_ATTRIBUTES = ("allow", "disallow", "prefer", "vClass")


@dataclass(frozen=True)
class ElementKind:
    """The content of an element: its attributes (True: required; None: left to SUMO), and the kind of each child by its
    tag."""

    attributes: Mapping[str, bool] | None = field(default_factory=dict)
    children: Mapping[str, str] = field(default_factory=dict)


PARAM = ElementKind({"key": True, "value": False})


def problems_in(
    path: Path, root: ElementTree.Element, known: Mapping[str, ElementKind], kind: str
) -> Iterator[Problem]:
    """The first problems with the names of an element of this kind and of its descendants."""
    for count, problem in enumerate(_problems(str(path), root, known, kind=kind, where=root.tag)):
        if count == _MOST_PROBLEMS:
            return
        yield problem


def _problems(
    path: str, element: ElementTree.Element, known: Mapping[str, ElementKind], *, kind: str, where: str
) -> Iterator[Problem]:
    allowed = known.get(kind, ElementKind())
    attributes = allowed.attributes or {}
    for name in element.attrib if allowed.attributes is not None else ():
        if name not in attributes and not name.startswith("{http://www.w3.org/2001/XMLSchema-instance}"):
            yield Problem(path, where, f"unknown attribute {name!r}", _nearest(name, attributes))
    for name, required in attributes.items():
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
    return nearest(name, valid) if valid else "leave it out"
