"""SUMO's files as they are found: compressed, and with the schema addresses of older versions."""

from __future__ import annotations

import gzip
from pathlib import Path

import platformdirs
import pytest
from sumolib.net import readNet

from harness.errors import UsageError
from harness.replay.floating_car_data import Lanes
from harness.road.net import tiles
from harness.road.net.net_file import check_net
from harness.road.net.network import read_net
from harness.road.scene.open_scene import OpenScene
from harness.road.xml.xml_file import parse_xml, xml_bytes


def packed(folder: Path, content: bytes) -> Path:
    file = folder / "small.net.xml.gz"
    file.write_bytes(content)
    return file


def test_gzip__is_unpacked_by_the_files_name(tmp_path: Path) -> None:
    assert parse_xml(packed(tmp_path, gzip.compress(b"<net/>"))).tag == "net"


def test_gzip__of_several_members_as_sumo_writes_them(tmp_path: Path) -> None:
    assert parse_xml(packed(tmp_path, gzip.compress(b"<net>") + gzip.compress(b"</net>"))).tag == "net"


def test_xml__is_read_without_the_children_that_are_not_kept(tmp_path: Path) -> None:
    (tmp_path / "a.xml").write_text('<net><edge id="a"><lane/></edge><edge id="b"/><junction id="c"/></net>')
    root = parse_xml(tmp_path / "a.xml", lambda element: element.get("id") in ("a", "c"))
    assert [(each.tag, len(each)) for each in root] == [("edge", 1), ("junction", 0)]


@pytest.mark.parametrize(
    ("content", "message"),
    [(b"<net/>", "is not a gzip file"), (gzip.compress(b"<net/>" * 99)[:-9], "is cut off: its gzip data has no end")],
    ids=["plain", "cut off"],
)
def test_gzip__that_is_damaged_is_refused(tmp_path: Path, content: bytes, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        parse_xml(packed(tmp_path, content))


def test_gzip__that_unpacks_to_too_much_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="holds more than 1 MB"):
        xml_bytes(packed(tmp_path, gzip.compress(b"<net>" + b" " * 1_000_000 + b"</net>")), 1_000_000)


def test_gzip__a_net_is_checked_read_tiled_and_replayed(
    tmp_path: Path, merge: OpenScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(platformdirs, "user_cache_dir", lambda name: str(tmp_path / name))
    net = packed(tmp_path, gzip.compress(merge.net_file.read_bytes()))
    check_net(net)
    assert [edge.getID() for edge in read_net(net).getEdges(withInternal=False)] == ["approach", "exit"]
    assert Lanes.read(net).ids == Lanes.read(merge.net_file).ids
    [of_net], [of_merge] = (tiles.tiles_of([tiles.Copies(each, 2)]) for each in (net, merge.net_file))
    assert [tile.offset_m for tile in of_net] == [tile.offset_m for tile in of_merge]
    assert readNet(str(tiles.tiled_net(of_net))).hasEdge("g1_approach")


def test_schema__addresses_that_were_sumos_are_accepted(tmp_path: Path) -> None:
    file = tmp_path / "small.net.xml"
    for server in ("http://sumo.dlr.de", "https://sumo-sim.org", "https://sumo.sf.net", "http://sumo.sourceforge.net"):
        address = f'xsi:noNamespaceSchemaLocation="{server}/xsd/net_file.xsd"'
        file.write_text(f'<net xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" {address}/>', encoding="utf-8")
        assert parse_xml(file).tag == "net"
