"""Converting a map to a SUMO net with netconvert and the type maps of the installed SUMO."""

from __future__ import annotations

import errno
import re
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from signal import Signals
from typing import NamedTuple

import numpy as np
import sumo
from sumolib.net import Net
from sumolib.net.edge import Edge

from harness.errors import UsageError
from harness.files import check_file
from harness.maps.map_file import MOST_BYTES, MapFacts, MapKind, facts_of, kind_of
from harness.road.net.net_file import check_net
from harness.road.net.network import lane_line, read_net
from harness.road.xml.sumo_program import run_program
from harness.road.xml.xml_file import xml_bytes

_PATIENCE_S = 900.0
_LAYER_M = 6.0  # of height between a road and the one that it passes over
_RING_M = 6.0  # of a roundabout of one lane. Our own: from 6 to 7 m most entries can be driven, at 5.5 m fewer
_WAY = re.compile(rb"""<way\b(?:[^>"']|"[^"]*"|'[^']*')*?\sid=["']([^"']*)["'](?:[^>"']|"[^"]*"|'[^']*')*>""")
_NO_ROAD = ("has no road that cars may use and that meets another", "export an area with junctions of roads for cars")
_CUT_NET = "cut out a part: netconvert -s FILE --keep-edges.in-boundary XMIN,YMIN,XMAX,YMAX -o part.net.xml"
_OSM_TYPES = ("osmNetconvert", "osmNetconvertUrbanDe")
_LIGHTS = ("--tls.cycle.time", "40")  # maps do not time their lights: red is short, so that games are
_OSM_OPTIONS = (
    *("--geometry.remove", "--ramps.guess", "--junctions.join", "--no-turnarounds", "--remove-edges.isolated"),
    *("--tls.guess-signals", "--tls.discard-simple", "--tls.join", "--output.street-names"),
    *("--osm.turn-lanes", "--osm.sidewalks", "--osm.crossings", "--walkingareas"),
    *("--keep-edges.by-vclass", "passenger"),
)
_LEFT_OUT = {  # one after the other, if netconvert crashes
    "--osm.crossings": "pedestrian crossings",
    "--walkingareas": "pavements inside junctions",
    "--osm.sidewalks": "pavements",
    "--osm.turn-lanes": "marked turn lanes",
    "--tls.join": "joined traffic lights",
    "--junctions.join": "joined junctions",
}
_OPENDRIVE_OPTIONS = ("--no-turnarounds", "--geometry.max-grade.fix", "false")


class ImportedMap(NamedTuple):
    """The net of a map, its file, and what the conversion had to leave out, or SUMO ignores, in a line each."""

    net_file: Path
    net: Net
    notes: tuple[str, ...] = ()


def import_map(path: Path, folder: Path, *, left_hand: bool) -> ImportedMap:
    """The net of a map, in `folder`: a net as it is, another map converted.

    `left_hand`: traffic in an OpenStreetMap file keeps to the left; other maps say it themselves.

    Raises UsageError for a map that can't be used.
    """
    kind = kind_of(path)
    if kind is MapKind.NET:
        return _copied(path, folder, left_hand)
    facts = facts_of(path, kind)
    if kind is MapKind.OSM and facts.on_the_left and not left_hand:
        raise UsageError.of(path, "", f"{facts.on_the_left}: traffic keeps to the left", "give --left-hand")
    is_left = left_hand if kind is MapKind.OSM else _is_left(path, facts, left_hand)
    file = folder / "converted.net.xml"
    notes = _convert(path, kind, facts=facts, net_file=file, left_hand=is_left), _cut_roads(facts)
    try:
        check_net(file)
    except UsageError as error:  # about a file that the user does not know
        raise UsageError(replace(problem, file=str(path)) for problem in error.problems) from None
    try:
        net = read_net(file)
    except UsageError:
        raise UsageError.of(path, "", *_NO_ROAD) from None
    _check_rotation(path, net, is_left)
    return ImportedMap(file, net, tuple(filter(None, notes)))


def _copied(path: Path, folder: Path, left_hand: bool) -> ImportedMap:
    try:
        check_file(path, MOST_BYTES)
    except OSError as error:
        if error.errno == errno.EFBIG:
            raise UsageError.of(path, "", str(error.strerror), _CUT_NET) from None
    warnings = _check_own_net(path, left_hand)
    file = folder / "converted.net.xml"
    file.write_bytes(xml_bytes(path))
    return ImportedMap(file, read_net(path), warnings)


def _check_own_net(path: Path, left_hand: bool) -> tuple[str, ...]:
    """The warnings of a net. Raises UsageError for one that is invalid, without right of way, or with traffic on the
    other side."""
    root, warnings = check_net(path)
    says_left = root.get("lefthand") in ("true", "1")
    if left_hand and not says_left:
        message = "is a net with right-hand traffic"
        raise UsageError.of(path, "net.lefthand", message, "leave out --left-hand, or build it with --lefthand")
    if not root.findall("junction/request") and len(root.findall("connection")) > 1:
        message = "has no right of way: its junctions have no element request"
        raise UsageError.of(path, "junction", message, "build it again with netconvert or netedit")
    return warnings


def _convert(path: Path, kind: MapKind, *, facts: MapFacts, net_file: Path, left_hand: bool) -> str:
    """Write the net of a map. Returns a line on the options that had to be left out; empty if there are none."""
    source = net_file.with_name("map.xml")  # netconvert splits names at commas and blanks
    source.write_bytes(_with_wide_rings(xml_bytes(path, MOST_BYTES), facts.narrow_rings))
    options = ["--xml-validation", "never", "--output-file", net_file.name, "--aggregate-warnings", "1", *_LIGHTS]
    if kind is MapKind.OSM:
        types = Path(sumo.SUMO_HOME) / "data" / "typemap"
        files = ",".join(str(types / f"{name}.typ.xml") for name in _OSM_TYPES)
        options += ["--osm-files", source.name, "--type-files", files, *_OSM_OPTIONS]
        options += ["--osm.layer-elevation", f"{_LAYER_M:g}"] if facts.has_layers else []
    else:
        options += ["--opendrive-files", source.name, *_OPENDRIVE_OPTIONS]
    options += ["--lefthand"] if left_hand else []
    optional, crash, left_out = [each for each in _LEFT_OUT if each in options], "", list[str]()
    while True:
        finished = run_program("netconvert", options, net_file.parent, _PATIENCE_S)
        if finished is None or finished.returncode >= 0 or not optional:
            break
        crash = crash or f"netconvert ended by signal {Signals(-finished.returncode).name} with {optional[0]}"
        left_out.append(_LEFT_OUT[optional[0]])
        options.remove(optional.pop(0))
    source.unlink()
    if finished is None:
        raise UsageError.of(path, "", f"netconvert takes longer than {_PATIENCE_S:g} s", "cut out a smaller part")
    if "No edges loaded" in finished.stderr:
        raise UsageError.of(path, "", *_NO_ROAD)
    if finished.returncode < 0:
        name = Signals(-finished.returncode).name
        raise UsageError.of(path, "", f"netconvert ended by signal {name}", "export the map again, or a smaller part")
    if finished.returncode or not net_file.is_file():
        errors = re.findall(r"^Error: (.*)$", finished.stderr, re.MULTILINE) or ["it gives no reason"]
        message = f"netconvert can't convert it: {errors[0].replace(source.name, path.name)}"
        raise UsageError.of(path, "", message, "repair the map, or export it again")
    return f"{crash}; converted without {', '.join(left_out)}" if left_out else ""


def _cut_roads(facts: MapFacts) -> str:
    """A line on the roads that netconvert makes shorter; empty if there are none."""
    ways = facts.cut_roads
    if not ways:
        return ""
    few, rest = ", ".join(ways[:3]), ", ..." if len(ways) > 3 else ""
    return (
        f"roads with nodes that the map does not have are shorter: {len(ways)} of {facts.roads} (way {few}{rest}); "
        "export whole ways, for instance with osmium extract --strategy complete_ways"
    )


def _with_wide_rings(content: bytes, ways: Collection[str]) -> bytes:
    """An OpenStreetMap file with a tag `width` for these ways. On a lane of SUMO's width, a car that turns into the
    ring touches its island."""
    names, width = {each.encode() for each in ways}, b'<tag k="width" v="%g"/>' % _RING_M
    return _WAY.sub(lambda way: way[0] + width * (way[1] in names), content) if ways else content


def _is_left(path: Path, facts: MapFacts, left_hand: bool) -> bool:
    """Whether traffic of an OpenDRIVE file keeps to the left. Raises UsageError if netconvert can't keep that."""
    if len(facts.rules) > 1:
        message = "has roads with left-hand and roads with right-hand traffic"
        raise UsageError.of(path, "road.rule", message, "use maps with one of them")
    is_left = facts.rules == {"LHT"}
    if left_hand and not is_left:
        message = "is a map with right-hand traffic"
        raise UsageError.of(path, "road.rule", message, 'leave out --left-hand, or give its roads rule="LHT"')
    if is_left and facts.uneven:
        message = "has left-hand traffic and different lanes in its two directions, which netconvert swaps"
        raise UsageError.of(path, f"road {facts.uneven}", message, "convert the map to a .net.xml by other means")
    return is_left


def _check_rotation(path: Path, net: Net, left_hand: bool) -> None:
    """Raise UsageError if traffic in most roundabouts runs the other way round than on the stated side of the road."""
    rings = [[net.getEdge(name) for name in each.getEdges()] for each in net.getRoundabouts()]
    turns = [turn for turn in map(_turn, rings) if turn]
    if turns and (np.mean(turns) > 0.0) == left_hand and np.mean(turns):
        sense, side = ("counter-clockwise", "right") if left_hand else ("clockwise", "left")
        remedy = "leave out --left-hand" if left_hand else "give --left-hand"
        message = f"its roundabouts run {sense}: traffic keeps to the {side}"
        raise UsageError.of(path, "junction=roundabout", message, remedy)


def _turn(ring: list[Edge]) -> float:
    """1 for a counter-clockwise ring, -1 for a clockwise one, 0 without a turn."""
    lines = [lane_line(edge.getLane(0)) for edge in ring]
    centre = np.concatenate(lines).mean(axis=0)
    first, last = (np.array([line[k] for line in lines]) - centre for k in (0, -1))
    return float(np.sign((first[:, 0] * last[:, 1] - first[:, 1] * last[:, 0]).sum()))
