"""Attributes that SUMO ignores: a warning names them, and the scene plays without them."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest

from harness.errors import UsageError
from harness.road.demand.route_reading import read_route_file
from harness.road.demand.route_schema import KINDS
from harness.road.scene.load_check import check_loads
from harness.road.scene.open_scene import open_scene
from harness.road.xml.element_kinds import drop_ignored
from harness.road.xml.sumo_schema import attributes_of
from tests.support.scenes import CARS, build_scene, run_sumo_program

VAN = '<vehicle id="van" type="van" depart="3" departPos="80" departSpeed="9"><route edges="road"/></vehicle>'
SLIPS = (
    ("n.rou.xml", 'departSpeed="9"', 'departSpeed="9" departSpd="2"'),
    ("n.rou.xml", 'id="van" length', 'id="van" maxSped="2" length'),
    ("n.net.xml", "<lane ", '<lane sped="2" '),
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A scene with background traffic and misspelt attributes."""
    build_scene(tmp_path, others=VAN, cars=CARS)
    return tmp_path


def misspell(folder: Path) -> None:
    for name, right, wrong in SLIPS:
        text = (folder / name).read_text(encoding="utf-8")
        assert right in text
        (folder / name).write_text(text.replace(right, wrong), encoding="utf-8")


def test_scene__with_attributes_that_sumo_ignores_warns_of_each_and_loads(folder: Path) -> None:
    before = open_scene(folder)
    misspell(folder)
    scene = open_scene(folder)
    net, routes = scene.net_file, scene.routes.path
    assert scene.warnings == [
        f"warning: {net}: lane road_0: SUMO ignores the attribute 'sped', 2 times (did you mean 'speed'?)",
        f"warning: {routes}: vType van: SUMO ignores the attribute 'maxSped' (did you mean 'maxSpeed'?)",
        f"warning: {routes}: vehicle van: SUMO ignores the attribute 'departSpd' (did you mean 'departSpeed'?)",
    ]
    assert (scene.routes.vehicles, scene.routes.types_xml) == (before.routes.vehicles, before.routes.types_xml)
    check_loads(scene)


def test_sumo__moves_vehicles_as_without_the_attributes_that_it_ignores(folder: Path) -> None:
    def trips() -> list[dict[str, str]]:
        options = ["--net-file", "n.net.xml", "--route-files", "n.rou.xml", "--xml-validation", "never"]
        run_sumo_program("sumo", [*options, "--no-step-log", "--tripinfo-output", "trips.xml"], folder)
        return [each.attrib for each in ElementTree.parse(folder / "trips.xml").iter("tripinfo")]

    before = trips()
    misspell(folder)
    assert len(before) == 3
    assert trips() == before


def test_net__a_value_that_sumo_refuses_is_refused_beside_an_attribute_that_it_ignores(folder: Path) -> None:
    misspell(folder)
    net = folder / "n.net.xml"
    net.write_text(net.read_text(encoding="utf-8").replace('type="dead_end"', 'type="roundabout"', 1), encoding="utf-8")
    with pytest.raises(UsageError, match=r"n\.net\.xml: SUMO can't load it: .*roundabout"):
        check_loads(open_scene(folder))


def test_warnings__are_few_however_many_attributes_there_are() -> None:
    root = ElementTree.fromstring("<routes " + " ".join(f'a{k}="1"' for k in range(100_000)) + "/>")
    *lines, last = drop_ignored(Path("a.rou.xml"), root, {"routes": ()})
    assert lines[0] == "warning: a.rou.xml: routes: SUMO ignores the attribute 'a0' (leave it out)"
    assert (len(lines), last) == (5, "warning: a.rou.xml: SUMO ignores 99,995 more attributes")
    assert root.attrib == {}


def test_route_file__an_attribute_that_sumo_reads_and_the_harness_does_not_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.rou.xml"
    path.write_text('<routes><vehicle id="v"><stop lane="b_0" duration="9" posLat="1"/></vehicle></routes>')
    with pytest.raises(UsageError, match=r"stop\.posLat: is not supported \(leave it out\)"):
        read_route_file(path)


def test_schema__has_no_attribute_that_was_not_looked_at() -> None:
    """Another version of SUMO may have new ones: they are read or refused, and then the counts follow."""
    known = {**attributes_of("additional_file"), **attributes_of("routes_file")}
    counts = {tag: len(known.get(tag, ())) for tag in KINDS}
    assert counts == {
        **dict.fromkeys(("routes", "additional", "flows", "trips"), 0),
        "vType": 189,
        "vTypeDistribution": 4,
        "route": 15,
        "routeDistribution": 4,
        "vehicle": 27,
        "trip": 34,
        "flow": 36,
        "interval": 2,
        "stop": 41,
        "busStop": 11,
        "access": 4,
        "person": 10,
        "personFlow": 17,
        "walk": 30,
    }
