"""Variants of a road: the same net with other lengths, lane widths, limits, curvature and angles, built by netconvert.

The plane of the net is changed as a whole, so that any net can be varied: it is stretched, sheared and bent around a
point and a direction, those of the ego's start. A shear changes the angles at which roads cross.
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from math import radians, tan
from pathlib import Path
from tempfile import TemporaryDirectory
from xml.etree import ElementTree

import numpy as np

from harness.errors import UsageError
from harness.game.arrays import FloatArray
from harness.game.seeding import between, generator_of
from harness.road.xml.sumo_program import run_program
from harness.road.xml.xml_file import parse_xml

LENGTH_SHARE, WIDTH_SHARE, LIMIT_SHARE = (0.8, 1.25), (0.9, 1.15), (0.85, 1.15)
"""Ranges of the factors of all lengths, of the widths of car lanes, and of speed limits. 3.3 m become 3.0 to 3.8 m."""
BEND_MPS2 = (-1.5, 1.5)
"""Range of the lateral acceleration at the highest limit on a road that was straight, positive to the left."""
ANGLE_DEG = (-15.0, 15.0)
"""Range of the change of a right angle at which two roads cross."""
_PATIENCE_S = 300.0
_APART_M = 10.0  # of the points of a line that is bent
_MOST_TURN_RAD = np.pi / 2.0  # from one end of the net to the other
_SUMO_LANE_M = 3.2
_OF_POSITIONS = ("departPos", "arrivalPos", "startPos", "endPos")


@dataclass(frozen=True, kw_only=True)
class RoadVariation:
    """How a road differs from that of its scene."""

    length_share: float
    width_share: float
    limit_share: float
    bend_mps2: float
    angle_deg: float

    @classmethod
    def drawn(cls, *parts: str | int) -> RoadVariation:
        """A variation whose random numbers are named by parts, each number uniform in its range."""
        ranges = (LENGTH_SHARE, WIDTH_SHARE, LIMIT_SHARE, BEND_MPS2, ANGLE_DEG)
        shares = generator_of(*parts).random(len(ranges))
        length, width, limit, bend, angle = (between(*each) for each in zip(ranges, shares.tolist(), strict=True))
        return cls(length_share=length, width_share=width, limit_share=limit, bend_mps2=bend, angle_deg=angle)


@dataclass(frozen=True, kw_only=True)
class Warp:
    """The change of the plane: stretched, sheared and bent around a point, along a direction."""

    x_m: float
    y_m: float
    heading_rad: float
    length_share: float
    angle_deg: float
    curvature_per_m: float

    def __call__(self, points: FloatArray) -> FloatArray:
        """[n, 2] where points [n, 2] are afterwards."""
        cos, sin = np.cos(self.heading_rad), np.sin(self.heading_rad)
        forward = np.array([[cos, sin], [-sin, cos]])
        along, left = self.length_share * ((points - (self.x_m, self.y_m)) @ forward.T).T
        along = along + tan(radians(self.angle_deg)) * left
        turned = self.curvature_per_m * along
        chord = along * np.sinc(0.5 * turned / np.pi)  # of the arc from the point to the place on the bent line
        along, left = (
            chord * np.cos(0.5 * turned) - left * np.sin(turned),
            chord * np.sin(0.5 * turned) + left * np.cos(turned),
        )
        return np.stack((along, left), axis=1) @ forward + (self.x_m, self.y_m)

    def heading_of(self, x_m: float, y_m: float, heading_rad: float) -> float:
        """Where a direction at a point points afterwards, in radians."""
        ahead = np.array([[x_m, y_m], [x_m + 0.01 * np.cos(heading_rad), y_m + 0.01 * np.sin(heading_rad)]])
        (before_x, before_y), (x, y) = self(ahead)
        return float(np.arctan2(y - before_y, x - before_x))


def warp_of(variation: RoadVariation, route: FloatArray, points: FloatArray, fastest_mps: float) -> Warp:
    """The change of the plane for a variation, around the start of a route [n, 2] and along its direction there.

    `points` [n, 2] are those of the net. A net too long for its bend gets a wider one.
    """
    heading = float(np.arctan2(*(route[1] - route[0])[::-1]))
    reach_m = variation.length_share * float(np.hypot(*np.ptp(points, axis=0)))
    bend = variation.bend_mps2 / (variation.limit_share * fastest_mps) ** 2
    return Warp(
        x_m=float(route[0, 0]),
        y_m=float(route[0, 1]),
        heading_rad=heading,
        length_share=variation.length_share,
        angle_deg=variation.angle_deg,
        curvature_per_m=float(np.clip(bend, -_MOST_TURN_RAD / reach_m, _MOST_TURN_RAD / reach_m)),
    )


def vary_net(net_file: Path, varied_file: Path, warp: Warp, variation: RoadVariation) -> None:
    """Write a variant of a net. Edges, lanes, junctions and signals keep their ids.

    Raises UsageError if netconvert can't build it.
    """
    with TemporaryDirectory(prefix="harness-road-") as scratch:
        folder = Path(scratch)
        shutil.copyfile(net_file, folder / "road.net.xml")
        _netconvert(net_file, folder, ["--sumo-net-file", "road.net.xml", "--plain-output-prefix", "plain"])
        nodes, edges, links = (folder / f"plain.{kind}.xml" for kind in ("nod", "edg", "con"))
        _vary_edges(edges, nodes, warp, variation)
        for file in (nodes, links):
            tree = parse_xml(file)
            for element in tree.iter():
                _warp_element(element, warp)
            _write(tree, file)
        _netconvert(net_file, folder, ["--configuration-file", "plain.netccfg", "--output-file", "varied.net.xml"])
        shutil.copyfile(folder / "varied.net.xml", varied_file)


def vary_route_file(file: Path, varied: Path, variation: RoadVariation) -> None:
    """Write a route file or additional file whose positions along edges are stretched as the edges are."""
    tree = parse_xml(file)
    for element in tree.iter():
        for name in _OF_POSITIONS:
            try:
                position_m = float(element.get(name, ""))
            except ValueError:  # none, or a word such as "random"
                continue
            element.set(name, f"{variation.length_share * position_m:.2f}")
    _write(tree, varied)


def _netconvert(net_file: Path, folder: Path, options: Sequence[str]) -> None:
    finished = run_program("netconvert", ["--xml-validation", "never", *options], folder, _PATIENCE_S)
    if finished is None or finished.returncode:
        lines = ["it takes too long"] if finished is None else finished.stderr.strip().splitlines()
        reason = lines[-1] if lines else "it gives no reason"
        raise UsageError.of(net_file, "", f"netconvert can't vary it: {reason}", "vary another scene")


def _vary_edges(file: Path, nodes: Path, warp: Warp, variation: RoadVariation) -> None:
    tree = parse_xml(file)
    places = {each.get("id"): (each.get("x"), each.get("y")) for each in parse_xml(nodes).iter("node")}
    for edge in tree.iter("edge"):
        if edge.get("shape") is None:
            ends = (places[edge.get(end)] for end in ("from", "to"))
            edge.set("shape", " ".join(f"{x},{y}" for x, y in ends))
        lanes = edge.findall("lane")
        for element in (edge, *lanes):
            _scale(element, "speed", variation.limit_share)
            _scale(element, "length", variation.length_share)
        for element in lanes or [edge]:
            if _admits_cars(element if _has_permissions(element) else edge):
                width_m = element.get("width", edge.get("width", f"{_SUMO_LANE_M}"))
                element.set("width", f"{variation.width_share * float(width_m):.2f}")
    for element in tree.iter():
        _warp_element(element, warp)
    _write(tree, file)


def _scale(element: ElementTree.Element, name: str, factor: float) -> None:
    value = element.get(name)
    if value is not None:
        element.set(name, f"{factor * float(value):.2f}")


def _has_permissions(element: ElementTree.Element) -> bool:
    return "allow" in element.attrib or "disallow" in element.attrib


def _admits_cars(element: ElementTree.Element) -> bool:
    allowed, forbidden = element.get("allow"), element.get("disallow", "").split()
    if allowed is not None:
        return bool({"passenger", "all"} & set(allowed.split()))
    return not {"passenger", "all"} & set(forbidden)


def _warp_element(element: ElementTree.Element, warp: Warp) -> None:
    """Warp the place and the shape of an element, if it has them."""
    if element.tag == "node":
        x, y = warp(np.array([[float(element.get("x", "0")), float(element.get("y", "0"))]]))[0]
        element.set("x", f"{x:.2f}")
        element.set("y", f"{y:.2f}")
    shape = element.get("shape")
    if shape:
        # a third coordinate is the height
        points = np.array([[float(value) for value in point.split(",")] for point in shape.split()])
        dense = _dense(points)
        dense[:, :2] = warp(dense[:, :2])
        element.set("shape", " ".join(",".join(f"{value:.2f}" for value in point) for point in dense))


def _dense(points: FloatArray) -> FloatArray:
    """[m, k] points of a line [n, k], with more between those that are far apart."""
    lengths = np.hypot(*np.diff(points[:, :2], axis=0).T)
    pieces = [
        np.linspace(start, end, max(int(np.ceil(length / _APART_M)), 1), endpoint=False)
        for start, end, length in zip(points[:-1], points[1:], lengths, strict=True)
    ]
    return np.concatenate([*pieces, points[-1:]])


def _write(tree: ElementTree.Element, file: Path) -> None:
    ElementTree.indent(tree, "    ")
    ElementTree.ElementTree(tree).write(file, encoding="UTF-8", xml_declaration=True)
