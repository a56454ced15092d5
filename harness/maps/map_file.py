"""A map file: its kind, and what is checked before SUMO's netconvert reads it.

A file that is too large, has no roads or names other files is refused before it is converted.
"""

from __future__ import annotations

import io
import math
from dataclasses import dataclass, field
from enum import Enum
from math import inf
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError

from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import iterparse

from harness.errors import UsageError
from harness.road.xml.xml_file import number_of, xml_bytes

MOST_BYTES = 100_000_000
"""Of a map to convert, unpacked."""
_CUT_MAP = "cut out the part around the junction, for instance with: osmium extract --bbox WEST,SOUTH,EAST,NORTH"
_FOR_CARS = {
    *("motorway", "trunk", "primary", "secondary", "tertiary", "unclassified", "residential", "living_street"),
    *("motorway_link", "trunk_link", "primary_link", "secondary_link", "tertiary_link", "service", "road"),
}
_OF_TWO_LANES = ("motorway", "trunk", "primary")  # in SUMO's type maps, where a one-way road has no tag lanes
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
_ISLES_DEG = (49.85, 50.0, 51.05)  # south ends of Great Britain and Ireland, up to 0, 1 and 1.78 degrees east
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
    lowest_deg: tuple[float, float] = (inf, inf)  # latitude and longitude of the nodes of an OpenStreetMap file
    highest_deg: tuple[float, float] = (-inf, -inf)
    says_left: bool = False  # it has a tag driving_side=left
    has_layers: bool = False  # some roads of an OpenStreetMap file pass over or under others
    narrow_rings: set[str] = field(default_factory=set)  # ways of roundabouts with one lane and without a width
    nodes: set[str] = field(default_factory=set)  # of an OpenStreetMap file
    cut_roads: list[str] = field(default_factory=list)  # ways with nodes that the file does not have before them
    rules: set[str] = field(default_factory=set)  # RHT and LHT, of the roads of an OpenDRIVE file
    broken: tuple[str, str] | None = None  # the first road of an OpenDRIVE file that is not sound, and why
    uneven: str = ""  # the first road with left-hand traffic whose two directions have different lanes
    junctions: set[str] = field(default_factory=lambda: {_OPEN_ROAD})  # of an OpenDRIVE file
    road_within: dict[str, str] = field(default_factory=dict)  # the first road of each junction that roads name

    @property
    def on_the_left(self) -> str:
        """Why traffic in an OpenStreetMap file keeps to the left; empty if nothing says so."""
        if self.says_left:
            return "has the tag driving_side=left"
        (south, west), (north, east) = self.lowest_deg, self.highest_deg
        if south > north:  # a file without nodes lies nowhere
            return ""
        ends = zip(_ISLES_DEG, (0.0, 1.0, 1.78), strict=True)
        inside = any(low <= south and north <= 61.0 and west >= -10.8 and east <= end for low, end in ends)
        return "lies in Great Britain or Ireland" if inside else ""


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
    if kind is MapKind.OSM:
        note, root, missing = _note_osm, "osm", "no way has the tag highway with a class of roads"
    else:
        note, root, missing = _note_opendrive, "OpenDRIVE", "it has no element road with a lane for driving"
    tag = ""
    try:
        for _, element in iterparse(io.BytesIO(xml_bytes(path, MOST_BYTES)), forbid_dtd=True):
            element.tag = tag = element.tag.rpartition("}")[2]  # without its namespace
            note(element, facts)
    except FileNotFoundError:
        raise UsageError.of(path, "", "there is no such file", "name another file") from None
    except OSError as error:
        raise UsageError.of(path, "", str(error.strerror), _CUT_MAP) from None
    except DefusedXmlException:
        raise UsageError.of(path, "", "carries XML entities or a document type", "remove them") from None
    except (ParseError, ValueError, LookupError, RecursionError) as error:
        raise UsageError.of(path, "", f"is not readable XML: {error}", "export it again") from None
    if tag != root:
        raise UsageError.of(path, tag, f"its root is not {root}", "name another file, or rename it")
    if facts.broken is not None:
        raise UsageError.of(path, *facts.broken, "repair the map, or export it again")
    if not facts.roads:
        raise UsageError.of(path, "", f"has no road for cars: {missing}", "export an area with roads")
    return facts


def _note_osm(element: Element, facts: MapFacts) -> None:
    if element.tag == "node":
        facts.nodes.add(element.get("id", ""))
        place = number_of(element.get("lat", "")), number_of(element.get("lon", ""))
        facts.lowest_deg = min(facts.lowest_deg[0], place[0]), min(facts.lowest_deg[1], place[1])
        facts.highest_deg = max(facts.highest_deg[0], place[0]), max(facts.highest_deg[1], place[1])
    if element.tag in ("way", "relation"):
        facts.says_left |= any(tag.attrib == {"k": "driving_side", "v": "left"} for tag in element.iter("tag"))
    if element.tag == "way":
        tags = {each.get("k", ""): each.get("v", "") for each in element.iter("tag")}
        is_road = tags.get("highway") in _FOR_CARS
        facts.roads += is_road
        if is_road and any(each.get("ref", "") not in facts.nodes for each in element.iter("nd")):
            facts.cut_roads.append(element.get("id", ""))
        facts.has_layers |= is_road and tags.get("layer", "").lstrip("+-").strip("0") != ""
        lanes = tags.get("lanes", "2" if tags.get("highway") in _OF_TWO_LANES else "1")
        if is_road and (tags.get("junction"), lanes) == ("roundabout", "1") and not any("width" in key for key in tags):
            facts.narrow_rings.add(element.get("id", ""))
    if element.tag in ("node", "way", "relation"):
        element.clear()


def _note_opendrive(element: Element, facts: MapFacts) -> None:
    """Count the roads of an OpenDRIVE file, and compare the lanes of the two directions of left-hand roads.

    Finds what netconvert takes for sound although it is not: numbers that are none, roads in a missing junction.
    """
    if element.tag == "junction":
        facts.junctions.add(element.get("id", ""))
        if element.get("type") == "direct":
            facts.broken = facts.broken or (f"junction {element.get('id')}", "is a direct junction, which is not read")
    elif element.tag == "road":
        name, rule = element.get("id", ""), element.get("rule", "RHT")
        facts.rules.add(rule)
        facts.road_within.setdefault(element.get("junction", _OPEN_ROAD), name)
        for section in element.iter("laneSection"):
            left, right = (
                sum(lane.get("type") in _DRIVING for lane in section.iterfind(f"{side}/lane"))
                for side in ("left", "right")
            )
            facts.roads += bool(left or right)
            if rule == "LHT" and left != right:
                facts.uneven = facts.uneven or name
        for part in element.iter():
            for key in _NUMBERS.get(part.tag, ()):
                value = part.get(key, "0")
                if math.isnan(number_of(value)):
                    why = f"{key} of its {part.tag} is {value!r}, not a number"
                    facts.broken = facts.broken or (f"road {name}", why)
        element.clear()
    elif element.tag == "OpenDRIVE":
        for junction, road in facts.road_within.items():
            if junction not in facts.junctions:
                why = f"it lies in junction {junction!r}, which the map does not have"
                facts.broken = facts.broken or (f"road {road}", why)
