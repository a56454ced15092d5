"""The attributes that SUMO's schemas have. SUMO ignores all others."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import sumo

_XSD = "{http://www.w3.org/2001/XMLSchema}"
_EXTENSION = f"{_XSD}complexContent/{_XSD}extension"


@cache
def attributes_of(schema: str) -> Mapping[str, frozenset[str]]:
    """The names of the attributes of each element, by its tag, in a schema of the installed SUMO, such as `net_file`.

    An element that stands in several places has the attributes of all of them.
    """
    roots = list(_included(Path(sumo.SUMO_HOME) / "data" / "xsd" / f"{schema}.xsd"))
    types = {each.get("name"): each for root in roots for each in root.findall(f"{_XSD}complexType")}

    def names_in(kind: ElementTree.Element | None) -> Iterator[str]:
        """Those that a type declares itself, and those of the type that it extends."""
        for part in () if kind is None else (kind, *kind.findall(_EXTENSION)):
            yield from (each.get("name", "") for each in part.findall(f"{_XSD}attribute"))
            yield from names_in(types.get(part.get("base")))

    found = defaultdict[str, set[str]](set)
    for element in (each for root in roots for each in root.iter(f"{_XSD}element")):
        own = element.find(f"{_XSD}complexType")
        found[element.get("name", "")].update(names_in(types.get(element.get("type")) if own is None else own))
    return {tag: frozenset(names) for tag, names in found.items()}


def _included(file: Path) -> Iterator[ElementTree.Element]:
    root = ElementTree.parse(file).getroot()
    yield root
    for each in root.findall(f"{_XSD}include"):
        yield from _included(file.parent / each.get("schemaLocation", ""))
