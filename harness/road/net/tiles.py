"""Tiled nets: copies of the nets of scenes side by side in one net, a tile for each game, so that one SUMO plays all.

A tiled net is cached by the content of the nets, their tiles, and the format.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal
from functools import cache
from hashlib import sha256
from math import ceil
from pathlib import Path
from typing import NamedTuple
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


@dataclass(frozen=True, kw_only=True)
class Tile:
    """A copy of a net."""

    net_file: Path
    prefix: str = ""
    """Of all names in the copy."""
    offset_m: float = 0.0
    """To the north."""
    junctions: frozenset[str] | None = None
    """Only these junctions of the net and their edges are copied; None: all of it."""


def write_tiles(tiles: Sequence[Tile], file: Path) -> None:
    """Write a net with all tiles; its attributes, types and projection are those of the first net."""
    read = cache(_Net.read)
    copies = [(tile, read(tile.net_file, tile.junctions)) for tile in tiles]
    root = copies[0][1].root
    with file.open("w", encoding="utf-8") as out:
        attributes = {name: value for name, value in root.attrib.items() if not name.startswith("{")}
        out.write(f"<net{_written(attributes)}>\n")
        for location in root.findall("location"):
            location = ElementTree.Element("location", {**location.attrib, "convBoundary": _boundary(copies)})
            out.writelines(_copy(location, _change("", Decimal(0))))
        for tag in _ORDER:
            for tile, net in copies if tag != "type" else copies[:1]:
                prefix = tile.prefix if tag != "type" else ""
                change = _change(prefix, _decimal(tile.offset_m))
                out.writelines(_copy(each, change) for each in net.elements if each.tag == tag)
        out.write("</net>\n")


class _Net(NamedTuple):
    """A net, or the part of it at some junctions."""

    root: ElementTree.Element
    elements: list[ElementTree.Element]

    @classmethod
    def read(cls, net_file: Path, junctions: frozenset[str] | None) -> _Net:
        root = parse_xml(net_file, None if junctions is None else _at(set(junctions)))
        return cls(root, list(root) if junctions is None else list(_cut(root, set(junctions))))


def _boundary(copies: Iterable[tuple[Tile, _Net]]) -> str:
    """The smallest box around all tiles, as text."""
    corners = []
    for tile, net in copies:
        location = net.root.find("location")
        text = "0,0,0,0" if location is None else location.get("convBoundary", "0,0,0,0")
        west, south, east, north = map(Decimal, text.split(","))
        offset = _decimal(tile.offset_m)
        corners.append((west, south + offset, east, north + offset))
    ends = zip((min, min, max, max), zip(*corners, strict=True), strict=True)
    return ",".join(str(end(values)) for end, values in ends)


def _decimal(metres: float) -> Decimal:
    return Decimal(str(metres))


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
_FORMAT = 2  # raised when the same tiles give another file
_LOGGER = logging.getLogger("harness.preparation")


class Copies(NamedTuple):
    """How many copies of a net, or of the part of it at some junctions, are wanted."""

    net_file: Path
    games: int
    junctions: frozenset[str] | None = None


def tiles_of(nets: Sequence[Copies], *, in_one_place: bool = False) -> list[list[Tile]]:
    """The tiles of each net, from south to north with room between them, or all in one place. A single one is the net
    as it is."""
    games = sum(each.games for each in nets)
    tiles: list[list[Tile]] = []
    south_m: float | None = None  # of the next tile's southern end
    for net in nets:
        location = parse_xml(net.net_file).find("location")
        corners = "0,0,0,0" if location is None or games == 1 else location.get("convBoundary", "0,0,0,0")
        _, low, _, high = (float(each) for each in corners.split(","))
        apart = location is not None and games > 1 and not in_one_place
        between_m = float(round(high - low + _GAP_M)) if apart else 0.0
        first_m = 0.0 if south_m is None or in_one_place else float(ceil(south_m - low))
        names = [f"g{sum(map(len, tiles)) + k}_" if games > 1 else "" for k in range(net.games)]
        offsets = [first_m + between_m * k for k in range(net.games)]
        tiles.append(
            [
                Tile(net_file=net.net_file, prefix=name, offset_m=offset_m, junctions=net.junctions)
                for name, offset_m in zip(names, offsets, strict=True)
            ]
        )
        south_m = first_m + between_m * net.games + low
    return tiles


def tiled_net(tiles: Sequence[Tile]) -> Path:
    """A net with these tiles, which is a file of the cache; a single tile of a whole net needs no copy."""
    first = tiles[0]
    if len(tiles) == 1 and first.junctions is None:
        return first.net_file

    def write(file: Path) -> None:
        total = len(tiles) + 1
        _LOGGER.info("copying the network %d times, once per scene", len(tiles), extra={"done": 0, "total": total})
        write_tiles(tiles, file)

    digests = {file: sha256(file.read_bytes()).hexdigest() for file in {each.net_file for each in tiles}}
    parts = [(digests[each.net_file], each.junctions and sorted(each.junctions)) for each in tiles]
    places = [(each.prefix, each.offset_m) for each in tiles]
    return cached_file("tiles/.net.xml", first.net_file, (parts, places, _FORMAT), write)


def nets_can_share(first: Path, second: Path) -> bool:
    """Whether tiles of two nets can be in one net: what SUMO reads of a net as a whole is equal."""
    return first == second or _of_the_whole(first) == _of_the_whole(second)


def _of_the_whole(net_file: Path) -> tuple[str | None, bool, list[bytes]]:
    """The format's version, the side of the road, and the types of edges. netconvert alone reads other attributes."""
    root = parse_xml(net_file)
    types = [ElementTree.tostring(each).strip() for each in root.findall("type")]
    return root.get("version"), root.get("lefthand") in ("true", "1"), types
