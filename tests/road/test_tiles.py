"""Tiled nets and their cache: copies that are exact, and cut down to the junctions that a scene needs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from math import inf
from pathlib import Path

import libsumo
import platformdirs
import pytest
from sumolib.net import Net, readNet

from benchmarks.nets import shipped_nets
from harness.road.net import network, tiles
from harness.road.net.net_file import check_net
from harness.road.net.tiles import Tile, write_tiles
from harness.road.scene.open_scene import OpenScene
from tests.support.repository import REPOSITORY


@pytest.fixture
def written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The games of each net that is written, with a cache in a temporary folder."""
    games: list[int] = []

    def counted(tiles: Sequence[Tile], file: Path) -> None:
        games.append(len(tiles))
        write_tiles(tiles, file)

    monkeypatch.setattr(platformdirs, "user_cache_dir", lambda name: str(tmp_path / name))
    monkeypatch.setattr(tiles, "write_tiles", counted)
    return games


def tiled(scene: OpenScene, games: int, junctions: frozenset[str] | None = None) -> Path:
    [own] = tiles.tiles_of([tiles.Copies(scene.net_file, games, junctions)])
    return tiles.tiled_net(own)


def test_tiles__of_one_game_are_the_net_itself(merge: OpenScene, written: list[int]) -> None:
    assert tiled(merge, 1) == merge.net_file
    assert written == []


def test_tiles__are_side_by_side_with_prefixed_names(merge: OpenScene, written: list[int]) -> None:
    [both] = tiles.tiles_of([tiles.Copies(merge.net_file, 2)])
    net = readNet(str(tiles.tiled_net(both)))
    lanes = [net.getLane(f"{tile.prefix}approach_0") for tile in both]
    assert lanes[1].getShape()[0][0] == pytest.approx(lanes[0].getShape()[0][0])
    assert lanes[1].getShape()[0][1] - lanes[0].getShape()[0][1] == pytest.approx(both[1].offset_m)


def test_tiles__of_several_nets_have_room_between_them(merge: OpenScene, written: list[int]) -> None:
    other = REPOSITORY / "networks" / "roundabout" / "roundabout.net.xml"  # it reaches far below y = 0
    of_nets = tiles.tiles_of([tiles.Copies(merge.net_file, 2), tiles.Copies(other, 2), tiles.Copies(merge.net_file, 1)])
    net = readNet(str(tiles.tiled_net([tile for own in of_nets for tile in own])))
    assert [tile.prefix for own in of_nets for tile in own] == ["g0_", "g1_", "g2_", "g3_", "g4_"]
    ends = {}
    for lane in (lane for edge in net.getEdges() for lane in edge.getLanes()):
        prefix = lane.getID().split("_")[0]
        y_m = [y for _, y in lane.getShape()]
        low, high = ends.get(prefix, (inf, -inf))
        ends[prefix] = min(low, *y_m), max(high, *y_m)
    in_order = [ends[f"g{k}"] for k in range(5)]
    assert all(above[0] - below[1] > 190.0 for below, above in pairwise(in_order))  # lanes overhang by their width


def test_cache__has_a_net_for_each_number_of_games_and_each_choice_of_junctions(
    merge: OpenScene, written: list[int]
) -> None:
    files = [tiled(merge, games) for games in (2, 3, 2)]
    assert files[0] == files[2] != files[1]
    assert written == [2, 3]
    files = [tiled(merge, 1, frozenset({each})) for each in ("start", "finish", "start")]
    assert files[0] == files[2] != files[1]
    assert merge.net_file not in files


# --- what is in the file ----------------------------------------------------------------------------------------------

FOUND = [path for path in shipped_nets() if path.stat().st_size < 70_000]
"""Nets of many versions of SUMO."""


def in_copy(name: str, prefix: str) -> str:
    return f":{prefix}{name[1:]}" if name.startswith(":") else prefix + name


def lanes_of(net: Net) -> dict[str, tuple[object, ...]]:
    """What SUMO's traffic sees of each lane: its line, length, limit, permissions, and where it leads."""
    return {
        lane.getID(): (
            [(x, y) for x, y in lane.getShape()],
            lane.getLength(),
            lane.getSpeed(),
            lane.getWidth(),
            tuple(sorted(lane.getPermissions())),
            [
                (link.getToLane().getID(), link.getViaLaneID(), link.getTLSID(), link.getTLLinkIndex(), link.getState())
                for link in lane.getOutgoing()
            ],
        )
        for edge in net.getEdges()
        for lane in edge.getLanes()
    }


@pytest.mark.parametrize("path", FOUND, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_tiles__have_the_lanes_of_the_net_exactly(path: Path, tmp_path: Path) -> None:
    both = [Tile(net_file=path, prefix=f"g{k}_", offset_m=5000.0 * k) for k in range(2)]
    write_tiles(both, tmp_path / "two.net.xml")
    original = lanes_of(readNet(str(path), withInternal=True))
    copies = lanes_of(readNet(str(tmp_path / "two.net.xml"), withInternal=True))
    assert len(copies) == 2 * len(original)
    for name, (line, *rest, links) in original.items():
        copied_line, *copied_rest, copied_links = copies[in_copy(name, "g1_")]
        assert [(x, y - 5000.0) for x, y in copied_line] == [pytest.approx(point) for point in line]
        assert copied_rest == rest
        assert copied_links == [
            (in_copy(to, "g1_"), via and in_copy(via, "g1_"), tls and in_copy(tls, "g1_"), index, state)
            for to, via, tls, index, state in links
        ]


def test_cut__keeps_junctions_with_their_edges_connections_and_signals(
    generate_net: Callable[..., Path], tmp_path: Path
) -> None:
    options = ("--grid", "--grid.number", "6", "--grid.length", "200", "--tls.guess", "--default-junction-type")
    path, cut = generate_net(*options, "traffic_light"), tmp_path / "cut.net.xml"
    net = network.read_net(path)
    kept = network.junctions_near(net, [net.getEdge("A0A1"), net.getEdge("A1B1")])
    assert kept is not None
    assert {"A0", "A1", "B1", "A2"} <= kept
    assert "F5" not in kept
    write_tiles([Tile(net_file=path, junctions=kept)], cut)
    check_net(cut)
    whole, part = lanes_of(readNet(str(path), withInternal=True)), lanes_of(readNet(str(cut), withInternal=True))
    assert len(part) < 0.6 * len(whole)
    ends = {lane.getID() for edge in net.getEdges(withInternal=False) if edge.getToNode().getID() not in kept
            for lane in edge.getLanes()}  # fmt: skip
    for name, properties in part.items():
        assert properties[:-1] == whole[name][:-1]
        assert properties[-1] == ([] if name in ends else whole[name][-1])
    assert requests_of(cut) == {name: rows for name, rows in requests_of(path).items() if name in kept}


def requests_of(path: Path) -> dict[str, int]:
    """The number of links of each traffic light that SUMO itself finds in a net."""
    libsumo.start(["sumo", "--net-file", str(path), "--no-step-log", "--xml-validation", "never"])
    try:
        libsumo.simulationStep()
        return {name: len(libsumo.trafficlight.getControlledLinks(name)) for name in libsumo.trafficlight.getIDList()}
    finally:
        libsumo.close()


def test_cut__a_scene_of_one_place_needs_no_cut(merge: OpenScene) -> None:
    assert merge.junctions is None
