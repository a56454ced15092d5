"""The file of a tiled net: copies of a net side by side, cut down to what the players of a scene can reach.

netconvert could merge copies, but it builds junctions anew: in nets of older versions it moves lanes by metres, and
connections change. Here every element is copied as it is: names get a prefix, coordinates are shifted.

A net is cut at junctions. A junction that is kept has all its edges, connections and signals, with ids and indices.
Edges end where the next junction is left out.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from decimal import Decimal
from pathlib import Path
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

from harness.traffic.xml_file import parse_xml

_ORDER = ("type", "edge", "tlLogic", "junction", "connection", "roundabout")  # as SUMO reads them
_NAMES = {
    "edge": ("id", "from", "to", "bidi", "crossingEdges"),
    "lane": ("id",),
    "neigh": ("lane",),
    "tlLogic": ("id",),
    "junction": ("id", "incLanes", "intLanes"),
    "connection": ("from", "to", "via", "tl"),
    "roundabout": ("nodes", "edges"),
}
"""Attributes that name elements of the net, or several of them."""
_SHAPES = ("shape", "outlineShape")


def write_tiles(
    net_file: Path, file: Path, prefixes: Collection[str], offset_m: float, junctions: Collection[str] | None
) -> None:
    """Write a net with a copy of a net for each prefix, each `offset_m` north of the one before.

    With `junctions`, only these junctions of the net and their edges are copied.
    """
    root = parse_xml(net_file)
    elements = list(root) if junctions is None else list(_cut(root, set(junctions)))
    with file.open("w", encoding="utf-8") as out:
        attributes = {name: value for name, value in root.attrib.items() if not name.startswith("{")}
        out.write(f"<net{_written(attributes)}>\n")
        north_m = Decimal(str(offset_m)) * (len(prefixes) - 1)
        out.writelines(_copy(each, _wider(north_m)) for each in root.findall("location"))
        for tag in _ORDER:
            for k, prefix in enumerate(prefixes if tag != "type" else ("",)):
                change = _change(prefix, Decimal(str(offset_m)) * k)
                out.writelines(_copy(each, change) for each in elements if each.tag == tag)
        out.write("</net>\n")


def _wider(north_m: Decimal) -> Callable[[str, str, str], str]:
    """Changes the boundary of a net so that it reaches farther north."""

    def changed(tag: str, name: str, value: str) -> str:
        if name != "convBoundary":
            return value
        *numbers, north = value.split(",")
        return ",".join((*numbers, str(Decimal(north) + north_m)))

    return changed


def _change(prefix: str, shift_m: Decimal) -> Callable[[str, str, str], str]:
    """The value of an attribute, by element and attribute, in the copy with this prefix and shift."""

    def named(name: str) -> str:
        return f":{prefix}{name[1:]}" if name.startswith(":") else prefix + name

    def shifted(point: str) -> str:
        x, y, *z = point.split(",")
        return ",".join((x, str(Decimal(y) + shift_m), *z))

    def changed(tag: str, name: str, value: str) -> str:
        if name in _NAMES.get(tag, ()):
            return " ".join(named(each) for each in value.split(" ")) if value else value
        if name in _SHAPES:
            return " ".join(shifted(point) for point in value.split())
        return str(Decimal(value) + shift_m) if tag == "junction" and name == "y" else value

    return changed


def _copy(element: ElementTree.Element, change: Callable[[str, str, str], str]) -> str:
    tag = str(element.tag)
    attributes = {name: change(tag, name, value) for name, value in element.attrib.items()}
    inner = "".join(_copy(child, change) for child in element)
    return f"<{tag}{_written(attributes)}>{inner}</{tag}>\n" if inner else f"<{tag}{_written(attributes)}/>\n"


def _written(attributes: dict[str, str]) -> str:
    return "".join(f" {name}={quoteattr(value)}" for name, value in attributes.items())


def _cut(root: ElementTree.Element, kept: set[str]) -> Iterator[ElementTree.Element]:
    """The elements of a net that belong to junctions, in the net's order."""
    ends = {edge.get("id", ""): (edge.get("from"), edge.get("to")) for edge in root.findall("edge")}
    edges = {name for name, both in ends.items() if kept & set(both) or _junction_of(name) in kept}
    outer = {end for name in edges for end in ends[name] if end} - kept

    def is_kept(link: ElementTree.Element) -> bool:
        name = link.get("from", "")
        return (_junction_of(name) if name.startswith(":") else ends[name][1]) in kept

    links = [link for link in root.findall("connection") if is_kept(link)]
    signals = {link.get("tl") for link in links}
    for element in root:
        name = element.get("id", "")
        if element.tag == "junction":
            if name in kept or (name.startswith(":") and _junction_of(name.rsplit("_", 1)[0]) in kept):
                yield element
            elif name in outer:
                yield _dead_end(element, edges)
        elif element.tag == "connection":
            if is_kept(element):
                yield element
        elif element.tag == "edge":
            if name in edges:
                yield element
        elif element.tag == "tlLogic":
            if name in signals:
                yield element
        elif element.tag == "roundabout":
            if set(element.get("nodes", "").split()) <= kept:
                yield element
        else:
            yield element


def _junction_of(inside: str) -> str:
    """The junction of an edge inside a junction; empty for other edges."""
    return inside[1:].rsplit("_", 1)[0] if inside.startswith(":") else ""


def _dead_end(junction: ElementTree.Element, edges: Collection[str]) -> ElementTree.Element:
    """The junction at which the cut net ends."""
    lanes = [lane for lane in junction.get("incLanes", "").split() if lane.rsplit("_", 1)[0] in edges]
    incoming = [lane for lane in lanes if not lane.startswith(":")]
    changes = {"type": "dead_end", "incLanes": " ".join(incoming), "intLanes": ""}
    return ElementTree.Element("junction", {**junction.attrib, **changes})
