"""A map that was read: its net, its traffic, the games that can be made on it, and the part that a game needs."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from html import unescape
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from sumolib.net import Net

from harness.errors import UsageError
from harness.game.junctions import SIGNALS, Signal
from harness.maps.game_plans import GamePlan, Plans
from harness.maps.import_map import import_map
from harness.maps.map_traffic import read_traffic
from harness.road.demand.route_file import RouteFile
from harness.road.net.net_listing import edges_within
from harness.road.net.network import junctions_near, nodes_of
from harness.road.net.tiles import Tile, write_tiles
from harness.road.xml.xml_file import number_of, parse_xml

_STOPS = {letter for letter, signal in SIGNALS.items() if signal in (Signal.YELLOW, Signal.RED)}


@dataclass(frozen=True, kw_only=True)
class OpenMap:
    """A map and the games on it, numbered from 1."""

    source: Path
    net_file: Path
    plans: Sequence[GamePlan]
    left_out: dict[str, int]  # reason and number of conflicts of which no scene can be made
    notes: tuple[str, ...]  # what the conversion had to leave out, and what SUMO ignores
    net: Net = field(repr=False)
    whole_net: bool = False  # scenes get all of the net
    traffic: RouteFile | None = field(default=None, repr=False)

    @cached_property
    def reds_s(self) -> dict[str, float]:
        """The longest time for which a link of each traffic light is yellow or red, by the light's id."""
        reds: dict[str, float] = {}
        for logic in parse_xml(self.net_file, lambda element: element.tag == "tlLogic"):
            name = logic.get("id", "")
            reds[name] = max(reds.get(name, 0.0), _longest_s(logic))
        return reds

    def near(self, edge: str | None, within_m: float) -> list[GamePlan]:
        """The plans at junctions near an edge; None: all. Raises UsageError if there is no such edge."""
        edges = edges_within(self.net, self.source, edge, within_m)
        junctions = {node.getID() for node in nodes_of(edges)}
        return [plan for plan in self.plans if plan.candidate.junction in junctions]

    def place_of(self, plan: GamePlan) -> str:
        """Where a conflict is: the names of its streets, or its junction, and its coordinates in the net."""
        candidate = plan.candidate
        ways = [way for way in (candidate.first, candidate.second) if way is not None]
        # netconvert escapes names twice
        names = [unescape(self.net.getEdge(name).getName() or "") for way in ways for name in way.edges]
        streets = " / ".join(dict.fromkeys(name for name in names if name)) or f"junction {candidate.junction}"
        return f"{streets} ({candidate.place[0]:.0f}, {candidate.place[1]:.0f})"


def open_map(
    source: Path,
    folder: Path,
    *,
    left_hand: bool,
    routes: Path | None = None,
    whole_net: bool = False,
    show: Callable[[str], object] = str,
) -> OpenMap:
    """Read a map, converted into `folder`, with the traffic of a route file; `show` gets a line on how far this is.

    Raises UsageError for a map on which no game can be made, and for a route file that does not fit it.
    """
    net_file, net, notes = import_map(source, folder, left_hand=left_hand)
    traffic = None if routes is None else read_traffic(routes, net_file, net, is_cut=not whole_net)
    plans = Plans(net, show)
    if not plans.all:
        reasons = "; ".join(f"{reason}: {count}" for reason, count in sorted(plans.left_out.items()))
        message = "has no conflict of which a scene can be made" + (f" ({reasons})" if reasons else "")
        raise UsageError.of(source, "", message, "choose an area with junctions and longer roads before them")
    return OpenMap(
        source=source,
        net_file=net_file,
        net=net,
        plans=plans.all,
        left_out=plans.left_out,
        notes=notes if traffic is None else (*notes, *traffic.warnings),
        whole_net=whole_net,
        traffic=traffic,
    )


def _longest_s(logic: ElementTree.Element) -> float:
    phases = [(number_of(each.get("duration", "")), each.get("state", "")) for each in logic.findall("phase")]
    longest_s = 0.0
    for link in range(min(len(state) for _, state in phases)):
        stops = [(duration_s, state[link] in _STOPS) for duration_s, state in phases]
        if all(stop for _, stop in stops):
            continue  # of a direction that is closed
        since_s = 0.0
        for duration_s, stop in stops * 2:  # red may go on from the last phase to the first
            since_s = since_s + duration_s if stop else 0.0
            longest_s = max(longest_s, since_s)
    return longest_s


def write_part(
    net: Net, net_file: Path, routes: Collection[str], file: Path, *, whole_net: bool = False
) -> frozenset[str] | None:
    """Write the part of a net, which was read from `net_file`, that the games of a scene use: the junctions near the
    edges `routes`, and their edges. Names and places stay. Returns the junctions; None if all of the net is written."""
    junctions = None if whole_net else junctions_near(net, {net.getEdge(name) for name in routes})
    if junctions is None:
        shutil.copyfile(net_file, file)
        return None
    write_tiles([Tile(net_file=net_file, junctions=junctions)], file)
    root = parse_xml(file)
    location = root.find("location")
    if location is not None:
        location.set("convBoundary", ",".join(f"{each:.2f}" for each in _boundary(root)))
    ElementTree.ElementTree(root).write(file, encoding="utf-8", xml_declaration=True)
    return junctions


def _boundary(root: ElementTree.Element) -> list[float]:
    shapes = [each.get("shape", "") for tag in ("lane", "junction") for each in root.iter(tag)]
    points = np.array([point.split(",")[:2] for shape in shapes for point in shape.split()], dtype=float)
    return [float(each) for each in (*points.min(axis=0), *points.max(axis=0))]
