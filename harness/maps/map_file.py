"""A map file: its kind, and what is checked before SUMO's netconvert reads it.

The file is read once in parts, so that one that is too large, has no roads or names other files is refused before it is
converted.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from xml.parsers import expat

from harness.errors import UsageError
from harness.files import check_file

MOST_BYTES = 100_000_000
"""Of a map to convert, unpacked."""
_CHUNK_BYTES = 1 << 20
_GZIP = 16 + zlib.MAX_WBITS
_CUT = "cut out the part around the junction, for instance with: osmium extract --bbox WEST,SOUTH,EAST,NORTH"
_FOR_CARS = {
    *("motorway", "trunk", "primary", "secondary", "tertiary", "unclassified", "residential", "living_street"),
    *("motorway_link", "trunk_link", "primary_link", "secondary_link", "tertiary_link", "service", "road"),
}
_CUBIC = ("a", "b", "c", "d")
_NUMBERS: dict[str, tuple[str, ...]] = {  # attributes of OpenDRIVE from which netconvert makes a net, whatever they are
    "road": ("length",),
    "geometry": ("s", "x", "y", "hdg", "length"),
    "arc": ("curvature",),
    "spiral": ("curvStart", "curvEnd"),
    "elevation": ("s", *_CUBIC),
    "laneOffset": ("s", *_CUBIC),
    "laneSection": ("s",),
    "width": ("sOffset", *_CUBIC),
}
_OPEN_ROAD = "-1"  # the junction of an OpenDRIVE road outside junctions
_DRIVING = ("driving", "bidirectional", "entry", "exit", "onRamp", "offRamp")  # lanes of OpenDRIVE


class MapKind(Enum):
    """The kinds of maps, with what their files end with."""

    NET = (".net.xml", ".net.xml.gz")
    OSM = (".osm", ".osm.xml", ".osm.gz", ".osm.xml.gz")
    OPENDRIVE = (".xodr", ".xodr.gz")


@dataclass
class MapFacts:
    """What a map says of itself."""

    roads: int = 0
    has_layers: bool = False  # some roads of an OpenStreetMap file pass over or under others
    rules: set[str] = field(default_factory=set)  # RHT and LHT, of the roads of an OpenDRIVE file
    broken: tuple[str, str] | None = None  # the first road of an OpenDRIVE file that is not sound, and why
    uneven: str = ""  # the first road with left-hand traffic whose two directions have different lanes


def kind_of(path: Path) -> MapKind:
    """The kind of a map, by the end of its name. Raises UsageError for other files."""
    name = path.name.lower()
    for kind in MapKind:
        if name.endswith(kind.value):
            return kind
    if name.endswith((".pbf", ".bz2")):
        raise UsageError.of(path, "", "is packed in a way that is not read", "unpack it: osmium cat FILE -o map.osm.gz")
    known = ", ".join(end for kind in MapKind for end in kind.value)
    raise UsageError.of(path, "", "is no map: the end of its name is not known", f"name a file that ends with {known}")


def facts_of(path: Path, kind: MapKind) -> MapFacts:
    """What an OpenStreetMap or OpenDRIVE file says of itself.

    Raises UsageError for a file that is missing, too large, not XML or of another kind, that has a document type, for
    one without roads, and for one with a road that is not sound.
    """
    facts = MapFacts()
    reader = _OsmReader(facts) if kind is MapKind.OSM else _OpenDriveReader(facts)
    parser = expat.ParserCreate()

    def refuse(*_: object) -> None:
        raise UsageError.of(path, "", "carries XML entities or a document type", "remove them")

    def start(tag: str, attributes: dict[str, str]) -> None:
        parser.StartElementHandler = reader.start
        if tag != reader.root:
            raise UsageError.of(path, tag, f"its root is not {reader.root}", "name another file, or rename it")

    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = refuse
    parser.StartElementHandler, parser.EndElementHandler = start, reader.end
    try:
        for part in _parts(path):
            parser.Parse(part, False)
        parser.Parse(b"", True)
    except expat.ExpatError as error:
        raise UsageError.of(path, "", f"is not readable XML: {error}", "export it again") from None
    if facts.broken is not None:
        raise UsageError.of(path, *facts.broken, "repair the map, or export it again")
    if not facts.roads:
        raise UsageError.of(path, "", f"has no road for cars: {reader.missing}", "export an area with roads")
    return facts


class _OsmReader:
    """Counts the roads among the ways of an OpenStreetMap file."""

    root, missing = "osm", "no way has the tag highway with a class of roads"

    def __init__(self, facts: MapFacts) -> None:
        self._facts, self._in_way, self._is_road, self._has_layer = facts, False, False, False

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        if tag == "way":
            self._in_way, self._is_road, self._has_layer = True, False, False
        elif tag == "tag" and self._in_way:
            key, value = attributes.get("k"), attributes.get("v", "")
            self._is_road |= key == "highway" and value in _FOR_CARS
            self._has_layer |= key == "layer" and value.lstrip("+-").strip("0") != ""

    def end(self, tag: str) -> None:
        if tag == "way":
            self._in_way = False
            self._facts.roads += self._is_road
            self._facts.has_layers |= self._is_road and self._has_layer


class _OpenDriveReader:
    """Counts the roads of an OpenDRIVE file, and compares the lanes of the two directions of left-hand roads.

    Finds what netconvert takes for sound although it is not: numbers that are none, roads in a missing junction.
    """

    root, missing = "OpenDRIVE", "it has no element road with a lane for driving"

    def __init__(self, facts: MapFacts) -> None:
        self._facts, self._road, self._rule, self._side = facts, "", "RHT", ""
        self._lanes = {"left": 0, "right": 0}
        self._junctions: set[str] = {_OPEN_ROAD}
        self._road_within: dict[str, str] = {}  # the first road of each junction that roads name

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        if tag == "road":
            self._road, self._rule = attributes.get("id", ""), attributes.get("rule", "RHT")
            self._facts.rules.add(self._rule)
            self._road_within.setdefault(attributes.get("junction", _OPEN_ROAD), self._road)
        elif tag == "junction":
            self._junctions.add(attributes.get("id", ""))
        elif tag in ("left", "center", "right"):
            self._side = tag
        elif tag == "laneSection":
            self._lanes = {"left": 0, "right": 0}
        elif tag == "lane" and attributes.get("type") in _DRIVING and self._side in self._lanes:
            self._facts.roads += not any(self._lanes.values())
            self._lanes[self._side] += 1
        for name in _NUMBERS.get(tag, ()):
            if name in attributes and not _is_number(attributes[name]):
                self._note_broken(self._road, f"{name} of its {tag} is {attributes[name]!r}, not a number")

    def end(self, tag: str) -> None:
        if tag == "laneSection" and self._rule == "LHT" and self._lanes["left"] != self._lanes["right"]:
            self._facts.uneven = self._facts.uneven or self._road
        elif tag == self.root:
            for junction, road in self._road_within.items():
                if junction not in self._junctions:
                    self._note_broken(road, f"it lies in junction {junction!r}, which the map does not have")

    def _note_broken(self, road: str, why: str) -> None:
        self._facts.broken = self._facts.broken or (f"road {road}", why)


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def _parts(path: Path) -> Iterator[bytes]:
    """The content of a plain file in parts, unpacked if its name ends with `.gz`. Raises UsageError."""
    try:
        check_file(path, MOST_BYTES)
        with path.open("rb") as file:
            yield from _limited(path, _unpacked(path, lambda: file.read(_CHUNK_BYTES)))
    except OSError as error:
        missing = isinstance(error, FileNotFoundError)
        message = "there is no such file" if missing else str(error.strerror)
        raise UsageError.of(path, "", message, "name another file" if missing else _CUT) from None


def _limited(path: Path, parts: Iterator[bytes]) -> Iterator[bytes]:
    size = 0
    for part in parts:
        size += len(part)
        if size > MOST_BYTES:
            raise UsageError.of(path, "", f"holds more than {MOST_BYTES / 1e6:,.0f} MB", _CUT)
        yield part


def _unpacked(path: Path, read: Callable[[], bytes]) -> Iterator[bytes]:
    if path.suffix.lower() != ".gz":
        yield from iter(read, b"")
        return
    unpacking, rest, pending = zlib.decompressobj(_GZIP), b"", False
    try:
        while rest or (rest := read()):
            pending = True
            yield unpacking.decompress(rest, _CHUNK_BYTES)
            rest = unpacking.unconsumed_tail
            if unpacking.eof:
                unpacking, rest, pending = zlib.decompressobj(_GZIP), unpacking.unused_data, False
    except zlib.error as error:
        raise UsageError.of(path, "", f"is not a gzip file: {error}", "compress it again, or remove .gz") from None
    if pending:
        raise UsageError.of(path, "", "is cut off: its gzip data has no end", "compress it again")
