"""Maps become nets that keep what the map says: lanes, heights, projection and the side of the road."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest
import sumo
from sumolib.net import Net

from harness.errors import UsageError
from harness.maps.import_map import import_map
from tests.support.repository import REPOSITORY

MAPS = REPOSITORY / "tests" / "data" / "maps"
TOWN, JUNCTION = MAPS / "town.osm", MAPS / "t_junction.xodr"
CROSS = REPOSITORY / "networks" / "priority_crossing" / "priority_crossing.net.xml"


@pytest.fixture(scope="module")
def town(tmp_path_factory: pytest.TempPathFactory) -> Net:
    return import_map(TOWN, tmp_path_factory.mktemp("town"), left_hand=False).net


def written(folder: Path, name: str, text: str) -> Path:
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


def test_import__of_openstreetmap_keeps_names_widths_and_limits(town: Net) -> None:
    main = next(edge for edge in town.getEdges() if edge.getName() == "Hauptstraße")
    driving = [lane for lane in main.getLanes() if lane.allows("passenger")]
    assert [lane.getWidth() for lane in driving] == [3.5]  # the file gives 7 m for both directions
    assert main.getSpeed() == pytest.approx(50.0 / 3.6, abs=0.01)
    assert len(town.getRoundabouts()) == 1
    assert any(edge.getFunction() == "crossing" for edge in town.getEdges())


RING = '<tag k="junction" v="roundabout"/>'


def ring_widths_m(folder: Path, before: str = RING, after: str = RING) -> set[float]:
    """The widths of the ring's lanes of the town, after a change of its text."""
    file = written(folder, "ring.osm", TOWN.read_text(encoding="utf-8").replace(before, after))
    net = import_map(file, folder, left_hand=False).net
    names = [name for each in net.getRoundabouts() for name in each.getEdges()]
    return {lane.getWidth() for name in names for lane in net.getEdge(name).getLanes()}


def test_import__a_roundabout_of_one_lane_gets_the_width_of_a_real_one(tmp_path: Path) -> None:
    assert ring_widths_m(tmp_path) == {6.0}
    assert ring_widths_m(tmp_path, '<way id="104" version="1">', "<way user='>' id='104'>") == {6.0}


@pytest.mark.parametrize(("tags", "width_m"), [('<tag k="width" v="4.5"/>', 4.5), ('<tag k="lanes" v="2"/>', 3.2)])
def test_import__a_roundabout_with_a_width_or_two_lanes_stays_as_it_is(
    tmp_path: Path, tags: str, width_m: float
) -> None:
    lanes = '<tag k="name" v="Am Kreisel"/><tag k="maxspeed" v="30"/><tag k="lanes" v="1"/>'
    assert ring_widths_m(tmp_path, RING + lanes, RING + tags) == {width_m}


def test_import__roads_that_the_edge_of_an_area_cuts_are_named(tmp_path: Path) -> None:
    assert import_map(TOWN, tmp_path, left_hand=False).notes == ()
    root = ElementTree.parse(TOWN).getroot()
    last = root.findall("way[@id='101']/nd")[-1].get("ref")  # way 102 begins there
    root.remove(next(each for each in root.findall("node") if each.get("id") == last))
    ElementTree.ElementTree(root).write(tmp_path / "cut.osm")
    (note,) = import_map(tmp_path / "cut.osm", tmp_path, left_hand=False).notes
    assert note.startswith(
        "roads with nodes that the map does not have are shorter: 2 of 11 (way 101, 102); export whole"
    )


def test_import__of_openstreetmap_keeps_the_projection(tmp_path: Path) -> None:
    file = import_map(TOWN, tmp_path, left_hand=False).net_file
    assert 'projParameter="+proj=utm +zone=32' in file.read_text(encoding="utf-8")


def test_import__of_opendrive_keeps_widths_and_heights(tmp_path: Path) -> None:
    net = import_map(JUNCTION, tmp_path, left_hand=False).net
    west = net.getEdge("-1").getLane(0)
    assert west.getWidth() == 3.25
    assert [round(point[2], 2) for point in west.getShape3D()] == [0.0, 3.0]  # 200 m with a slope of 1.5 %


def test_import__a_net_stays_as_it_is(tmp_path: Path) -> None:
    file = import_map(CROSS, tmp_path, left_hand=False).net_file
    assert file.read_bytes() == CROSS.read_bytes()


def mirrored(text: str) -> str:
    """The town in a mirror: its roundabout runs clockwise."""
    return re.sub(r'lat="([\d.]+)"', lambda found: f'lat="{104.0 - float(found[1]):.7f}"', text)


def test_import__left_hand_traffic_of_openstreetmap_must_be_said(tmp_path: Path) -> None:
    left = written(tmp_path, "left.osm", mirrored(TOWN.read_text(encoding="utf-8")))
    file = import_map(left, tmp_path, left_hand=True).net_file
    assert 'lefthand="true"' in file.read_text(encoding="utf-8")
    with pytest.raises(UsageError, match=r"run clockwise: traffic keeps to the left \(give --left-hand\)"):
        import_map(left, tmp_path, left_hand=False)
    with pytest.raises(UsageError, match=r"run counter-clockwise.*\(leave out --left-hand\)"):
        import_map(TOWN, tmp_path, left_hand=True)


def test_import__left_hand_traffic_of_opendrive_is_kept_or_refused(tmp_path: Path) -> None:
    text = JUNCTION.read_text(encoding="utf-8")
    straight = text[: text.index('  <road name="" ')] + "</OpenDRIVE>"  # without the roads inside the junction
    two_way = written(tmp_path, "two_way.xodr", straight.replace("RHT", "LHT"))
    file, net, _ = import_map(two_way, tmp_path, left_hand=False)
    assert 'lefthand="true"' in file.read_text(encoding="utf-8")
    eastward, westward = (net.getEdge(name).getLane(0).getShape()[0][1] for name in ("-1", "1"))
    assert eastward > westward
    for text_of, message in (
        (text.replace("RHT", "LHT"), r"road 11: has left-hand traffic and different lanes in its two directions"),
        (text.replace("RHT", "LHT", 1), r"road\.rule: has roads with left-hand and roads with right-hand traffic"),
    ):
        with pytest.raises(UsageError, match=message):
            import_map(written(tmp_path, "bad.xodr", text_of), tmp_path, left_hand=False)
    with pytest.raises(UsageError, match="is a map with right-hand traffic"):
        import_map(JUNCTION, tmp_path, left_hand=True)


def test_import__what_netconvert_refuses_is_one_line(tmp_path: Path) -> None:
    text = JUNCTION.read_text(encoding="utf-8").replace(' connectingRoad="11"', "")
    with pytest.raises(UsageError, match=r"broken\.xodr: netconvert can't convert it: .*connectingRoad") as error:
        import_map(written(tmp_path, "broken.xodr", text), tmp_path, left_hand=False)
    assert len(str(error.value).splitlines()) == 1


def test_import__a_net_without_right_of_way_is_refused(tmp_path: Path) -> None:
    text = re.sub(r"<request .*/>", "", CROSS.read_text(encoding="utf-8"))
    with pytest.raises(UsageError, match=r"has no right of way.*build it again"):
        import_map(written(tmp_path, "bare.net.xml", text), tmp_path, left_hand=False)


def test_import__roads_that_forbid_cars_are_no_roads(tmp_path: Path) -> None:
    text = TOWN.read_text(encoding="utf-8").replace('k="maxspeed"', 'k="access" v="no"/><tag k="maxspeed"')
    with pytest.raises(UsageError, match="has no road that cars may use"):
        import_map(written(tmp_path, "quiet.osm", text), tmp_path, left_hand=False)


def test_import__a_map_of_a_country_is_refused_by_its_own_name(tmp_path: Path) -> None:
    text = JUNCTION.read_text(encoding="utf-8")
    road = re.search(r"<road .*?</road>", text, re.DOTALL)
    assert road is not None
    copy = re.sub(r"<link>.*?</link>", "", road[0], flags=re.DOTALL).replace(' id="1"', ' id="99"')
    far = text.replace("</OpenDRIVE>", copy.replace('x="-210"', 'x="-200000"') + "</OpenDRIVE>")
    with pytest.raises(UsageError, match=r"wide\.xodr: is too large for a scene: .* km \(cut out the part"):
        import_map(written(tmp_path, "wide.xodr", far), tmp_path, left_hand=False)


def test_import__a_name_with_commas_and_blanks_is_one_name(tmp_path: Path) -> None:
    odd = written(tmp_path, "a, b=<c>.xodr", JUNCTION.read_text(encoding="utf-8"))
    assert import_map(odd, tmp_path, left_hand=False).net.hasEdge("-1")


@pytest.fixture
def crashing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Makes netconvert crash whenever its options have a text."""

    def install(text: str) -> None:
        home, real = tmp_path / "sumo", Path(sumo.SUMO_HOME)
        (home / "bin").mkdir(parents=True)
        (home / "data").symlink_to(real / "data")
        program = home / "bin" / "netconvert"
        netconvert = shlex.quote(str(real / "bin" / "netconvert"))
        program.write_text(f'#!/bin/sh\ncase "$*" in *{text}*) kill -SEGV $$;; esac\nexec {netconvert} "$@"\n')
        program.chmod(0o755)
        monkeypatch.setattr(sumo, "SUMO_HOME", str(home))

    return install


def test_import__a_crash_of_netconvert_leaves_out_the_option_that_it_comes_from(
    tmp_path: Path, crashing: Callable[[str], None]
) -> None:
    crashing("--osm.crossings")
    _, net, (note,) = import_map(TOWN, tmp_path, left_hand=False)
    assert note == "netconvert ended by signal SIGSEGV with --osm.crossings; converted without pedestrian crossings"
    assert not any(edge.getFunction() == "crossing" for edge in net.getEdges())
    lanes = [lane for edge in net.getEdges() for lane in edge.getLanes()]
    assert any(lane.allows("pedestrian") and not lane.allows("passenger") for lane in lanes)


@pytest.mark.parametrize("path", [TOWN, JUNCTION], ids=["OpenStreetMap", "OpenDRIVE"])
def test_import__a_crash_of_netconvert_whatever_its_options_is_named(
    path: Path, tmp_path: Path, crashing: Callable[[str], None]
) -> None:
    crashing("--output-file")
    with pytest.raises(UsageError, match=r"netconvert ended by signal SIGSEGV \(export the map again"):
        import_map(path, tmp_path, left_hand=False)


def moved_west(text: str, west_deg: float) -> str:
    return re.sub(r'lon="([\d.]+)"', lambda found: f'lon="{float(found[1]) - west_deg:.7f}"', text)


@pytest.mark.parametrize(
    ("tag", "west_deg", "message"),
    [
        ("", 11.0, r"lies in Great Britain or Ireland: traffic keeps to the left \(give --left-hand\)"),
        ('<tag k="driving_side" v="left"/>', 0.0, "has the tag driving_side=left: traffic keeps to the left"),
    ],
)
def test_import__left_hand_traffic_is_known_without_a_roundabout(
    tag: str, west_deg: float, message: str, tmp_path: Path
) -> None:
    text = TOWN.read_text(encoding="utf-8").replace('<tag k="junction" v="roundabout"/>', "")
    left = moved_west(text.replace("</way>", f"{tag}</way>"), west_deg)
    file = written(tmp_path, "left.osm", left)
    with pytest.raises(UsageError, match=message):
        import_map(file, tmp_path, left_hand=False)
    assert 'lefthand="true"' in import_map(file, tmp_path, left_hand=True).net_file.read_text(encoding="utf-8")


def test_import__a_direct_junction_of_opendrive_is_refused_by_its_name(tmp_path: Path) -> None:
    text = re.sub(r"<junction ", '<junction type="direct" ', JUNCTION.read_text(encoding="utf-8"), count=1)
    with pytest.raises(UsageError, match=r"junction \d+: is a direct junction, which is not read"):
        import_map(written(tmp_path, "direct.xodr", text), tmp_path, left_hand=False)


@pytest.mark.parametrize(
    ("name", "remedy"), [("country.net.xml", r"keep-edges\.in-boundary"), ("country.osm", "100 MB.*osmium extract")]
)
def test_import__500_mb_are_refused_by_their_size(name: str, remedy: str, tmp_path: Path) -> None:
    with (tmp_path / name).open("wb") as sparse:
        sparse.truncate(500_000_000)
    with pytest.raises(UsageError, match=rf"too large: 500 MB.*{remedy}"):
        import_map(tmp_path / name, tmp_path, left_hand=False)
