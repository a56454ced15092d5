"""What a map file says of itself, and the files that are refused before anything converts them."""

from __future__ import annotations

import gzip
from pathlib import Path

import pytest

from harness.errors import UsageError
from harness.maps.map_file import MapKind, facts_of, kind_of
from tests.support.repository import REPOSITORY

MAPS = REPOSITORY / "tests" / "data" / "maps"
ROAD = '<way id="1"><nd ref="1"/><nd ref="2"/><tag k="highway" v="residential"/>{}</way>'


def osm(inside: str) -> str:
    return f'<?xml version="1.0"?><osm version="0.6">{inside}</osm>'


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("a.net.xml", MapKind.NET),
        ("a.net.xml.gz", MapKind.NET),
        ("a.osm", MapKind.OSM),
        ("A.OSM.XML.GZ", MapKind.OSM),
        ("a.xodr", MapKind.OPENDRIVE),
    ],
)
def test_kind__is_told_by_the_end_of_the_name(name: str, kind: MapKind) -> None:
    assert kind_of(Path(name)) is kind


@pytest.mark.parametrize(("name", "remedy"), [("a.osm.pbf", "osmium cat"), ("a.txt", "ends with .net.xml")])
def test_kind__of_another_file_is_refused_with_a_remedy(name: str, remedy: str) -> None:
    with pytest.raises(UsageError, match=remedy):
        kind_of(Path(name))


def test_facts__count_the_roads_for_cars_and_see_layers(tmp_path: Path) -> None:
    file = tmp_path / "a.osm"
    path = '<way id="2"><tag k="highway" v="footway"/><tag k="layer" v="1"/></way>'
    file.write_text(osm(ROAD.format("") + path))
    facts = facts_of(file, MapKind.OSM)
    assert (facts.roads, facts.has_layers) == (1, False)
    file.write_text(osm(ROAD.format('<tag k="layer" v="-1"/>')))
    assert facts_of(file, MapKind.OSM).has_layers


@pytest.mark.parametrize(
    ("tags", "is_narrow"),
    [
        ({"highway": "residential"}, True),
        ({"highway": "primary"}, False),  # two lanes, as netconvert has it
        ({"highway": "primary", "lanes": "1"}, True),
        ({"highway": "tertiary", "lanes": "2"}, False),
        ({"highway": "tertiary", "width": "5"}, False),
        ({"highway": "tertiary", "width:lanes": "5"}, False),
        ({"highway": "footway"}, False),
    ],
)
def test_facts__name_the_roundabouts_of_one_lane_without_a_width(
    tmp_path: Path, tags: dict[str, str], is_narrow: bool
) -> None:
    ring = "".join(f'<tag k="{key}" v="{value}"/>' for key, value in {"junction": "roundabout", **tags}.items())
    (tmp_path / "a.osm").write_text(osm(ROAD.format("") + f'<way id="2">{ring}</way>'))
    assert facts_of(tmp_path / "a.osm", MapKind.OSM).narrow_rings == ({"2"} if is_narrow else set())


def test_facts__are_those_of_the_file_when_it_is_compressed(tmp_path: Path) -> None:
    packed, content = tmp_path / "town.osm.gz", (MAPS / "town.osm").read_bytes()
    packed.write_bytes(gzip.compress(content[:999]) + gzip.compress(content[999:]))  # of two members
    assert facts_of(packed, MapKind.OSM) == facts_of(MAPS / "town.osm", MapKind.OSM)


@pytest.mark.parametrize(
    ("nodes", "reason"),
    [
        ("", ""),
        ('<node id="1" lat="52.0" lon="-1.0"/>', "lies in Great Britain or Ireland"),
        ('<node id="1" lat="52.0" lon="13.0"/>', ""),
    ],
)
def test_facts__a_file_lies_where_its_nodes_are_and_without_any_nowhere(
    nodes: str, reason: str, tmp_path: Path
) -> None:
    (tmp_path / "a.osm").write_text(osm(nodes + ROAD.format("")))
    assert facts_of(tmp_path / "a.osm", MapKind.OSM).on_the_left == reason


@pytest.mark.parametrize("encoding", ["foo", "utf-16", "idna", "zlib", "undefined", "", "x" * 3000])
@pytest.mark.parametrize(("name", "kind"), [("town.osm", MapKind.OSM), ("t_junction.xodr", MapKind.OPENDRIVE)])
def test_facts__of_a_file_in_another_encoding_are_refused(
    name: str, kind: MapKind, encoding: str, tmp_path: Path
) -> None:
    body = (MAPS / name).read_text(encoding="utf-8").partition("?>")[2]
    (tmp_path / name).write_text(f'<?xml version="1.0" encoding="{encoding}"?>{body}', encoding="utf-8")
    with pytest.raises(UsageError, match="is not readable XML"):
        facts_of(tmp_path / name, kind)


def test_facts__of_opendrive_name_the_side_of_the_road(tmp_path: Path) -> None:
    text = (MAPS / "t_junction.xodr").read_text()
    assert facts_of(MAPS / "t_junction.xodr", MapKind.OPENDRIVE).rules == {"RHT"}
    file = tmp_path / "left.xodr"
    file.write_text(text.replace("RHT", "LHT"))
    facts = facts_of(file, MapKind.OPENDRIVE)
    assert (facts.rules, facts.uneven) == ({"LHT"}, "11")  # the first road with a lane in one direction only


@pytest.mark.parametrize(
    ("sound", "broken", "message"),
    [
        ('length="200"', 'length="nan"', r"road 1: length of its road is 'nan', not a number"),
        (' a="3.25"', ' a="wide"', r"road 1: a of its width is 'wide', not a number"),
        ('<junction id="100"', '<junction id="9"', r"road 11: it lies in junction '100', which the map does not have"),
    ],
)
def test_facts__what_netconvert_would_take_for_sound_is_refused(
    sound: str, broken: str, message: str, tmp_path: Path
) -> None:
    text = (MAPS / "t_junction.xodr").read_text()
    assert sound in text
    file = tmp_path / "broken.xodr"
    file.write_text(text.replace(sound, broken))
    with pytest.raises(UsageError, match=message):
        facts_of(file, MapKind.OPENDRIVE)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (osm('<way id="1"><tag k="waterway" v="river"/></way>'), "has no road for cars"),
        (osm(ROAD.format(""))[:-9], "is not readable XML"),
        ('<!DOCTYPE osm [<!ENTITY x SYSTEM "file:///etc/hostname">]>' + osm(ROAD.format("")), "document type"),
        ("<net/>", "its root is not osm"),
        ("", "is not readable XML"),
    ],
)
def test_facts__of_a_file_that_is_no_map_of_roads(content: str, message: str, tmp_path: Path) -> None:
    file = tmp_path / "bad.osm"
    file.write_text(content)
    with pytest.raises(UsageError, match=message):
        facts_of(file, MapKind.OSM)


def test_facts__of_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="there is no such file"):
        facts_of(tmp_path / "no.osm", MapKind.OSM)
