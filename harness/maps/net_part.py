"""The part of a map's net that a scene needs."""

from __future__ import annotations

import shutil
from collections.abc import Collection
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from sumolib.net import Net

from harness.road.net.network import junctions_near
from harness.road.net.tiles import write_tiles
from harness.road.xml.xml_file import parse_xml


def write_part(net: Net, net_file: Path, routes: Collection[str], file: Path) -> bool:
    """Write the part of a net, which was read from `net_file`, that the games of a scene use: the junctions near the
    edges `routes`, and their edges. Names and places stay. Returns whether anything was left out."""
    junctions = junctions_near(net, {net.getEdge(name) for name in routes})
    if junctions is None:
        shutil.copyfile(net_file, file)
        return False
    write_tiles(net_file, file, prefixes=[""], offset_m=0.0, junctions=junctions)
    root = parse_xml(file)
    location = root.find("location")
    if location is not None:
        location.set("convBoundary", ",".join(f"{each:.2f}" for each in _boundary(root)))
    ElementTree.ElementTree(root).write(file, encoding="utf-8", xml_declaration=True)
    return True


def _boundary(root: ElementTree.Element) -> list[float]:
    shapes = [each.get("shape", "") for tag in ("lane", "junction") for each in root.iter(tag)]
    points = np.array([point.split(",")[:2] for shape in shapes for point in shape.split()], dtype=float)
    return [float(each) for each in (*points.min(axis=0), *points.max(axis=0))]
