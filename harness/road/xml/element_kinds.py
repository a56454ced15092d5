"""Checks of the elements of SUMO's files: a file may hold only those that a scene needs.

SUMO ignores unknown elements, and some known ones make it read or write other files: an `<include>`, a detector, the
device of a vehicle type. What SUMO's schemas say beyond that, SUMO checks itself: see `load_check`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from sumolib.net.lane import SUMO_VEHICLE_CLASSES

from harness.config.toml_reading import nearest
from harness.errors import Problem

_MOST_PROBLEMS = 20
_FILE_KEYS = ("file", "output", "device", "has.")  # parts of a param's key that make SUMO read or write files
_CLASSES = {*SUMO_VEHICLE_CLASSES, "all", "ignoring", "drone", "aircraft"}  # vehicle classes
_CLASS_ATTRIBUTES = ("allow", "disallow", "prefer", "vClass")


class ElementKind(NamedTuple):
    """The tags of the children of an element, and the names of its attributes (None: left to SUMO)."""

    children: Collection[str] = ("param",)
    attributes: Collection[str] | None = None


_PARAM = ElementKind((), ("key", "value"))


def problems_in(
    path: Path, root: ElementTree.Element, known: Mapping[str, ElementKind], reported: Collection[str] = ()
) -> list[Problem]:
    """The first problems with the names of an element and of its descendants.

    `known` has the kinds of elements by their tags. All others may have params only. Tags in `reported`, and attributes
    and children there after the tag of their element, are passed over.
    """
    kinds = {"param": _PARAM, **known}
    return list(islice(_problems(str(path), root, kinds, reported, where=root.tag), _MOST_PROBLEMS))


def _problems(
    path: str,
    element: ElementTree.Element,
    known: Mapping[str, ElementKind],
    reported: Collection[str],
    *,
    where: str,
) -> Iterator[Problem]:
    children, attributes = known.get(element.tag, ElementKind())
    for name in element.attrib if attributes is not None else ():
        is_other = name.startswith("{http://www.w3.org/2001/XMLSchema-instance}") or f"{element.tag}.{name}" in reported
        if name not in (attributes or ()) and not is_other:
            yield Problem(path, where, f"unknown attribute {name!r}", _nearest(name, attributes or ()))
    for name in _CLASS_ATTRIBUTES:
        for each in element.get(name, "").split():
            if each not in _CLASSES:
                message = f"SUMO has no vehicle class {each[:60]!r}"
                yield Problem(path, f"{where}.{name}", message, nearest(each, _CLASSES))
    if element.tag == "param" and any(part in element.get("key", "").lower() for part in _FILE_KEYS):
        message = f"a param {element.get('key')!r} makes SUMO read or write other files"
        yield Problem(path, where, message, "leave it out: the harness records every game itself")
    for child in element:
        if child.tag in reported or f"{element.tag}.{child.tag}" in reported:
            continue
        inner = f"{child.tag} {child.get('id')}" if child.get("id") else str(child.tag)
        if " " in where and not child.get("id"):
            inner = f"{where}.{child.tag}"
        if child.tag not in children:
            yield Problem(path, str(child.tag), "is not understood here", _nearest(str(child.tag), children))
        else:
            yield from _problems(path, child, known, reported, where=inner)


def _nearest(name: str, valid: Collection[str]) -> str:
    return nearest(name, valid) if valid else "leave it out"
