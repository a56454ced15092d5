"""The part of a large map that a scene's net has: the roads around the routes, unchanged."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from sumolib.net.connection import Connection

from harness.maps.open_map import write_part
from harness.road.net.net_file import check_net
from harness.road.net.network import KEPT_M, lane_line, read_net
from harness.road.net.right_of_way_table import foes_of

ROUTE = ("A0B0", "B0C0")
ROW = ("--grid", "--grid.x-number", "9", "--grid.y-number", "2", "--grid.length", "150", "--no-turnarounds")


def names(link: Connection) -> tuple[str, str]:
    return link.getFromLane().getID(), link.getToLane().getID()


def test_part__has_the_roads_near_the_routes_with_names_places_and_right_of_way(
    generate_net: Callable[..., Path], tmp_path: Path
) -> None:
    file, part_file = generate_net(*ROW), tmp_path / "part.net.xml"
    whole = read_net(file)
    assert write_part(whole, file, ROUTE, part_file)
    check_net(part_file)
    part = read_net(part_file)
    kept = {edge.getID() for edge in part.getEdges()}
    assert kept < {edge.getID() for edge in whole.getEdges()}
    assert {"C0D0", "D0E0", "E0E1"} < kept  # B0C0 ends at 300 m, and E0 is at 600 m
    assert "H0I0" not in kept
    for name in kept:
        assert lane_line(part.getEdge(name).getLane(0)).tolist() == lane_line(whole.getEdge(name).getLane(0)).tolist()
    for node in ("B0", "C0"):
        foes = [
            {names(link): sorted(map(names, foes_of(link))) for link in net.getNode(node).getConnections()}
            for net in (whole, part)
        ]
        assert foes[0] == foes[1]
    assert part.getBoundary()[2] < 300.0 + KEPT_M + 150.0 + 10.0 < whole.getBoundary()[2]


def test_part__of_a_small_map_is_the_map(generate_net: Callable[..., Path], tmp_path: Path) -> None:
    file, part_file = generate_net(*ROW[:2], "3", *ROW[3:]), tmp_path / "part.net.xml"
    assert not write_part(read_net(file), file, ROUTE, part_file)
    assert part_file.read_bytes() == file.read_bytes()
