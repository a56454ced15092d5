"""Checks of the elements and attributes of SUMO's files: a file may hold only the elements that a scene needs.

SUMO ignores unknown elements, and some known ones make it read or write other files: an `<include>`, a detector, the
device of a vehicle type. Attributes that SUMO ignores are taken out, with a warning. What SUMO's schemas say beyond
that, SUMO checks itself: see `load_check`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from itertools import islice
from pathlib import Path
from xml.etree import ElementTree

from sumolib.net.lane import SUMO_VEHICLE_CLASSES

from harness.config.toml_reading import nearest
from harness.errors import MOST_PROBLEMS, Problem

_MOST_WARNINGS = 5
_FILE_KEYS = ("file", "output", "device", "has.")  # parts of a param's key that make SUMO read or write files
_CLASSES = {*SUMO_VEHICLE_CLASSES, "all", "ignoring", "drone", "aircraft"}  # vehicle classes
_CLASS_ATTRIBUTES = ("allow", "disallow", "prefer", "vClass")
_ANY_SCHEMA = "{http://www.w3.org/2001/XMLSchema-instance}"


def drop_ignored(
    path: Path, root: ElementTree.Element, known: Mapping[str, Collection[str]], kept: Collection[str] = ()
) -> tuple[str, ...]:
    """Remove the attributes that SUMO ignores. Returns a warning for each name in a kind of element, the first few, and
    one with the number of the others.

    `known` has the attributes of elements by their tags. Those in `kept`, after the tag of their element, stay.
    """
    first, counts = dict[tuple[str, str], str](), Counter[tuple[str, str]]()
    for element in root.iter():
        tag = str(element.tag)
        for name in element.attrib.keys() - known.get(tag, element.attrib.keys()):
            if f"{tag}.{name}" not in kept and not name.startswith(_ANY_SCHEMA):
                del element.attrib[name]
                first.setdefault((tag, name), f"{tag} {element.get('id')}" if element.get("id") else tag)
                counts[tag, name] += 1
    warnings = []
    for (tag, name), where in sorted(first.items())[:_MOST_WARNINGS]:
        times = f", {counts[tag, name]:,} times" if counts[tag, name] > 1 else ""
        message = f"SUMO ignores the attribute {name!r}{times}"
        warnings.append(f"warning: {Problem(str(path), where, message, _nearest(name, known[tag]))}")
    if len(first) > _MOST_WARNINGS:
        warnings.append(f"warning: {path}: SUMO ignores {len(first) - _MOST_WARNINGS:,} more attributes")
    return tuple(warnings)


def problems_in(
    path: Path, root: ElementTree.Element, known: Mapping[str, Collection[str]], reported: Collection[str] = ()
) -> list[Problem]:
    """The first problems with the elements below an element.

    `known` has the tags of children of elements by their tags. All others may have params only. Tags in `reported`, and
    children there after the tag of their element, are passed over.
    """
    kinds = {"param": (), **known}
    return list(islice(_problems(str(path), root, kinds, reported, where=root.tag), MOST_PROBLEMS))


def _problems(
    path: str,
    element: ElementTree.Element,
    known: Mapping[str, Collection[str]],
    reported: Collection[str],
    *,
    where: str,
) -> Iterator[Problem]:
    children = known.get(element.tag, ("param",))
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
