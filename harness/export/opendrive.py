"""A scene's net as OpenDRIVE 1.4, by netconvert.

netconvert names the signals by light and link, such as `crossing_3`; programs such as esmini read numbers only. So
signals get numbers, and keep netconvert's name as their `name`. At the ends of the net netconvert links roads to
junctions that it does not write; these links are removed.

Of a geographic net netconvert writes an `<offset>`, which OpenDRIVE 1.4 does not have: programs that know it from later
versions move the roads, and others do not. The projection and the offset become `<userData>`, and coordinates stay
those of the net for every program.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from xml.etree import ElementTree

from harness.errors import HarnessError
from harness.replay.floating_car_data import xml_text
from harness.road.xml.sumo_program import run_program
from harness.road.xml.xml_file import parse_xml

ROAD_FILE = "scene.xodr"
NO_DATE = "1970-01-01T00:00:00"
"""The date of exported files: the same game gives the same bytes."""
_PATIENCE_S = 600.0
_REMEDY = "the net can be exported as far as netconvert --opendrive-output writes it"


@dataclass(frozen=True, kw_only=True)
class RoadFile:
    """An OpenDRIVE document, and the numbers of its signals."""

    xml: bytes
    signals: Mapping[str, Mapping[int, int]]
    """Of each light: the signals' numbers by the index of the link that they control."""


def road_file(net_file: Path, title: str) -> RoadFile:
    """A net as OpenDRIVE. Coordinates are those of the net. Raises HarnessError if netconvert fails."""
    with TemporaryDirectory(prefix="harness-export-") as scratch:
        options = ["--sumo-net-file", str(net_file.absolute()), "--opendrive-output", ROAD_FILE]
        done = run_program("netconvert", options, scratch, _PATIENCE_S)
        written = Path(scratch) / ROAD_FILE
        if done is None or done.returncode or not written.is_file():
            said = "it takes too long" if done is None else " ".join(done.stderr.split()) or "it says nothing"
            raise HarnessError(f"{net_file}: netconvert writes no OpenDRIVE: {said} ({_REMEDY})")
        root = parse_xml(written)
    header = root.find("header")
    if header is not None:
        header.set("name", title)
        header.set("date", NO_DATE)
        _keep_as_user_data(header)
    _remove_loose_links(root)
    lights = [light.get("id", "") for light in parse_xml(net_file).iter("tlLogic")]
    return RoadFile(signals=_numbered(root, lights), xml=xml_text(root))


def _keep_as_user_data(header: ElementTree.Element) -> None:
    """Replace the projection and the offset of a header by user data: SUMO's projection, and x and y (m) that lead from
    the net's coordinates to projected ones."""
    for name in ("geoReference", "offset"):
        found = header.find(name)
        if found is not None:
            header.remove(found)
            value = f"{found.get('x')} {found.get('y')}" if name == "offset" else " ".join((found.text or "").split())
            ElementTree.SubElement(header, "userData", code=name, value=value)


def _remove_loose_links(root: ElementTree.Element) -> None:
    """Remove the links of roads to junctions that the document does not have."""
    junctions = {junction.get("id") for junction in root.iter("junction")}
    for links in root.iterfind("road/link"):
        for link in list(links):
            if link.get("elementType") == "junction" and link.get("elementId") not in junctions:
                links.remove(link)


def _numbered(root: ElementTree.Element, lights: list[str]) -> dict[str, dict[int, int]]:
    """Number the signals of a document, also where its controllers name them; the numbers of each light."""
    numbers: dict[str, dict[int, int]] = {}
    number_of: dict[str, str] = {}
    for number, signal in enumerate(root.iter("signal"), start=1):
        name = signal.get("id", "")
        light, _, link = name.rpartition("_")  # an id may contain '_'
        signal.set("id", str(number))
        signal.set("name", name)
        number_of[name] = str(number)
        if light in lights and link.isdecimal():
            numbers.setdefault(light, {})[int(link)] = number
    for control in root.iter("control"):
        named = control.get("signalId", "")
        control.set("signalId", number_of.get(named, named))
    return numbers
