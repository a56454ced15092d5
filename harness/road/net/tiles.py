"""Tiled nets: G copies of a scene's net side by side in one net, so that one SUMO plays G games.

The tiled net is cached by the net's content, the number of games, the junctions that are kept, and the format.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Collection, Iterator
from decimal import Decimal
from pathlib import Path
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

from harness.road.xml.sumo_program import cached_file
from harness.road.xml.xml_file import parse_xml

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
    net_file: Path, file: Path, *, prefixes: Collection[str], offset_m: float, junctions: Collection[str] | None
) -> None:
    """Write a net with a copy of a net for each prefix, each `offset_m` north of the one before.

    With `junctions`, only these junctions of the net and their edges are copied.
    """
    root = parse_xml(net_file, None if junctions is None else _at(set(junctions)))
    elements = list(root) if junctions is None else list(_cut(root, set(junctions)))
    with file.open("w", encoding="utf-8") as out:
        attributes = {name: value for name, value in root.attrib.items() if not name.startswith("{")}
        out.write(f"<net{_written(attributes)}>\n")
        for location in root.findall("location"):
            *numbers, north = location.get("convBoundary", "0,0,0,0").split(",")
            north_m = Decimal(north) + Decimal(str(offset_m)) * (len(prefixes) - 1)
            location.set("convBoundary", ",".join((*numbers, str(north_m))))
            out.writelines(_copy(location, _change("", Decimal(0))))
        for tag in _ORDER:
            for k, prefix in enumerate(prefixes if tag != "type" else ("",)):
                change = _change(prefix, Decimal(str(offset_m)) * k)
                out.writelines(_copy(each, change) for each in elements if each.tag == tag)
        out.write("</net>\n")


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


def _at(kept: set[str]) -> Callable[[ElementTree.Element], bool]:
    """Whether an edge is at junctions that are kept, and a connection from such an edge; true of most others. A net has
    its edges before their connections."""
    edges: set[str] = set()

    def is_at(element: ElementTree.Element) -> bool:
        name = element.get("id", "")
        if element.tag == "edge" and (kept & {element.get("from"), element.get("to")} or _junction_of(name) in kept):
            edges.add(name)
        if element.tag == "junction" and name.startswith(":"):
            return _junction_of(name.rsplit("_", 1)[0]) in kept
        return name in edges if element.tag == "edge" else element.tag != "connection" or element.get("from") in edges

    return is_at


def _cut(root: ElementTree.Element, kept: set[str]) -> Iterator[ElementTree.Element]:
    """The elements of a net with the edges at the junctions `kept` alone."""
    ends = {edge.get("id", ""): (edge.get("from"), edge.get("to")) for edge in root.findall("edge")}
    outer = {end for both in ends.values() for end in both if end} - kept

    def is_kept(link: ElementTree.Element) -> bool:
        name = link.get("from", "")
        return (_junction_of(name) if name.startswith(":") else ends[name][1]) in kept

    links = [link for link in root.findall("connection") if is_kept(link)]
    signals = {link.get("tl") for link in links}
    keeps: dict[str, Callable[[ElementTree.Element], bool]] = {
        "junction": lambda junction: junction.get("id", "") in kept or junction.get("id", "").startswith(":"),
        "connection": is_kept,
        "tlLogic": lambda logic: logic.get("id") in signals,
        "roundabout": lambda ring: set(ring.get("nodes", "").split()) <= kept,
    }
    for element in root:
        if element.tag not in keeps or keeps[element.tag](element):
            yield element
        elif element.tag == "junction" and element.get("id") in outer:
            yield _dead_end(element, ends)


def _junction_of(inside: str) -> str:
    """The junction of an edge inside a junction; empty for other edges."""
    return inside[1:].rsplit("_", 1)[0] if inside.startswith(":") else ""


def _dead_end(junction: ElementTree.Element, edges: Collection[str]) -> ElementTree.Element:
    lanes = [lane for lane in junction.get("incLanes", "").split() if lane.rsplit("_", 1)[0] in edges]
    incoming = [lane for lane in lanes if not lane.startswith(":")]
    changes = {"type": "dead_end", "incLanes": " ".join(incoming), "intLanes": ""}
    return ElementTree.Element("junction", {**junction.attrib, **changes})


_GAP_M = 200.0
_FORMAT = 2  # raised when the same net gives another file
_LOGGER = logging.getLogger("harness.preparation")


def tile_prefix(game: int, games: int) -> str:
    """The prefix of every name in a game's tile; empty if there is one game."""
    return f"g{game}_" if games > 1 else ""


def tile_offset_m(net_file: Path, games: int) -> float:
    """Distance from each tile to the next one, in y; 0 for one game."""
    location = parse_xml(net_file).find("location")
    if games == 1 or location is None:
        return 0.0
    _, low, _, high = (float(each) for each in location.get("convBoundary", "0,0,0,0").split(","))
    return float(round(high - low + _GAP_M))


def tiled_net(net_file: Path, games: int, junctions: Collection[str] | None = None) -> Path:
    """A net with G = `games` tiles of the scene's net, cut down to these junctions and their edges if they are given.

    One game on the whole net needs no copy; other nets are files of the cache.
    """
    if games == 1 and junctions is None:
        return net_file

    def write(file: Path) -> None:
        _LOGGER.info("copying the network %d times, once per scene", games, extra={"done": 0, "total": games + 1})
        prefixes = [tile_prefix(game, games) for game in range(games)]
        write_tiles(net_file, file, prefixes=prefixes, offset_m=tile_offset_m(net_file, games), junctions=junctions)

    key = (games, _GAP_M, _FORMAT, None if junctions is None else sorted(junctions))
    return cached_file("tiles/.net.xml", net_file, key, write)
