"""The traffic of a map's route file in a part of its net: cut as by SUMO's cutRoutes.py, and more kinds of it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest
import sumo

from harness.errors import UsageError
from harness.maps.map_traffic import read_traffic, scene_traffic, traffic_within
from harness.maps.open_map import write_part
from harness.road.demand.route_file import Flow, RouteFile
from harness.road.net.network import read_net

CUT_ROUTES = Path(sumo.SUMO_HOME) / "tools" / "route" / "cutRoutes.py"
ROW = ("--grid", "--grid.x-number", "9", "--grid.y-number", "2", "--grid.length", "150", "--no-turnarounds")
Cut = Callable[[str], tuple[RouteFile, Path, Path]]
PLAYERS = ("A0B0", "B0C0")  # the part of the net ends at E0 and E1
THROUGH = "I0H0 H0G0 G0F0 F0E0 E0D0 D0C0"
BACK = "C0D0 D0E0 E0F0 F0F1 F1E1 E1D1"  # leaves the part, and returns to it


@pytest.fixture
def cut(generate_net: Callable[..., Path], tmp_path: Path) -> Cut:
    """The traffic of a route file's content in the part of a row of blocks, the file and the net of the part."""
    file, part_file = generate_net(*ROW), tmp_path / "part.net.xml"

    def traffic(content: str) -> tuple[RouteFile, Path, Path]:
        net, routes_file = read_net(file), tmp_path / "own.rou.xml"
        routes_file.write_text(f"<routes>{content}</routes>", encoding="utf-8")
        routes = read_traffic(routes_file, file, net, is_cut=True)
        junctions = write_part(net, file, PLAYERS, part_file)
        assert junctions is not None
        written = ElementTree.Element("routes")
        written.extend(scene_traffic(routes, net, junctions).elements)
        ElementTree.ElementTree(written).write(tmp_path / "elements.rou.xml", encoding="utf-8")
        return traffic_within(routes, net, junctions), file, part_file

    return traffic


def vehicle(name: str, edges: str, inside: str = "") -> str:
    return f'<vehicle id="{name}" depart="7"><route edges="{edges}"/>{inside}</vehicle>'


@pytest.mark.skipif(not CUT_ROUTES.is_file(), reason="SUMO's wheel does not ship this tool")
def test_cut__has_the_routes_and_the_departures_of_sumos_tool(cut: Cut, tmp_path: Path) -> None:
    stop = '<stop lane="G0F0_0" until="90"/>'
    content = vehicle("in", THROUGH) + vehicle("out", "C0D0 D0E0 E0F0 F0G0") + vehicle("late", THROUGH, stop)
    found, file, part_file = cut(content + vehicle("beyond", "G0H0 H0I0"))
    out = tmp_path / "tool.rou.xml"
    options = [str(part_file), str(tmp_path / "own.rou.xml"), "--orig-net", str(file), "--routes-output", str(out)]
    environment = {**os.environ, "SUMO_HOME": sumo.SUMO_HOME}
    subprocess.run([sys.executable, str(CUT_ROUTES), *options], env=environment, check=True, capture_output=True)
    tool = {each.get("id"): each for each in ElementTree.parse(out).iter("vehicle")}
    assert set(found.vehicles) == set(tool) == {"in", "out", "late"}
    for name, element in tool.items():
        route = element.find("route")
        assert route is not None
        assert found.vehicles[str(name)].edges == tuple(route.get("edges", "").split())
        assert found.vehicles[str(name)].depart_s == pytest.approx(float(element.get("depart", "")), abs=0.01)
    assert (found.vehicles["in"].lane, found.vehicles["in"].speed) == ("best", "max")
    assert (found.vehicles["out"].lane, found.vehicles["out"].depart_s) == ("first", 7.0)
    assert found.vehicles["late"].depart_s == 90.0


def test_cut__a_route_that_returns_is_two_vehicles(cut: Cut) -> None:
    found = cut(vehicle("back", BACK))[0].vehicles
    assert {name: each.edges for name, each in found.items()} == {
        "back_part0": ("C0D0", "D0E0", "E0F0"),
        "back_part1": ("F1E1", "E1D1"),
    }
    assert found["back_part0"].depart_s == 7.0 < found["back_part1"].depart_s


def test_cut__trips_flows_and_persons_are_cut_too(cut: Cut, tmp_path: Path) -> None:
    trip = '<trip id="t" depart="0" from="I0H0" to="D0C0"/>'
    flow = '<flow id="f" begin="5" end="65" period="exp(0.5)" from="I0H0" to="D0C0"/>'
    person = '<personFlow id="p" begin="0" number="4" end="8"><walk edges="C0D0 B0C0 A0B0"/></personFlow>'
    walk = '<person id="w" depart="0"><walk edges="D0E0 E0F0 F0G0"/></person>'
    found, file, part_file = cut(trip + flow + person + walk)
    assert found.vehicles["t"].edges == ("F0E0", "E0D0", "D0C0")
    flows = {each.departure.name: each for each in found.flows}
    assert flows["f"].end_s - flows["f"].departure.depart_s == pytest.approx(60.0)
    assert (flows["p"].departure.edges, flows["p"].departure.depart_s) == (("C0D0", "B0C0", "A0B0"), 0.0)
    walker = found.vehicles["w"]
    assert (walker.edges, float(walker.arrival[1])) == (
        ("D0E0", "E0F0"),
        pytest.approx(read_net(file).getEdge("E0F0").getLength(), abs=0.01),
    )
    written = read_traffic(tmp_path / "elements.rou.xml", part_file, read_net(part_file), is_cut=True)
    assert [each.rate for each in written.flows] == [each.rate for each in sorted(found.flows, key=_begin_s)]
    assert {name: each.edges for name, each in written.vehicles.items()} == {
        name: each.edges for name, each in found.vehicles.items()
    }


def _begin_s(flow: Flow) -> float:
    return flow.departure.depart_s


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (vehicle("a", "A0B0 nope no") + vehicle("b", "nope"), r"own\.rou\.xml: a: .*no edge 'nope', and 1 more edges"),
        ('<vType id="car"/>', r"own\.rou\.xml: has no vehicle, person or flow"),
        (vehicle("a", "G0H0 H0I0"), r"no route of .*own\.rou\.xml leads through its part of the net.*--whole-net"),
        (
            '<flow id="f" period="2"><routeDistribution><route edges="A0B0"/><route edges="B0C0"/></routeDistribution>'
            "</flow>",
            r"own\.rou\.xml: f: draws its route.*\(give it one route, or --whole-net\)",
        ),
        (vehicle("ego", "A0B0"), r"own\.rou\.xml: vehicle ego: has the name of a player"),
    ],
)
def test_cut__what_can_not_be_kept_is_one_line(content: str, message: str, cut: Cut) -> None:
    with pytest.raises(UsageError, match=message) as error:
        cut(content)
    assert len(str(error.value).splitlines()) == 1
