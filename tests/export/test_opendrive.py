"""OpenDRIVE: the lanes of the net, and signals with numbers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from xml.etree import ElementTree

import pytest
import sumolib
import xmlschema

from harness.export.opendrive import road_file
from tests.support.repository import REPOSITORY


def net(name: str) -> Path:
    return REPOSITORY / "networks" / name / f"{name}.net.xml"


@pytest.mark.parametrize("name", ["merge", "crossing", "red_light"])
def test_road__has_the_widths_and_lengths_of_the_lanes(name: str) -> None:
    root = ElementTree.fromstring(road_file(net(name), name).xml)
    roads = Counter()
    for road in root.iter("road"):
        if road.get("junction") == "-1":
            widths = [round(float(width.get("a", "nan")), 2) for width in road.iter("width")]
            roads[round(float(road.get("length", "nan")), 1), tuple(sorted(widths))] += 1
    lanes = Counter(
        (round(edge.getLength(), 1), tuple(sorted(round(lane.getWidth(), 2) for lane in edge.getLanes())))
        for edge in sumolib.net.readNet(str(net(name))).getEdges(withInternal=False)
    )
    assert roads == lanes


def test_signals__have_numbers_and_a_controller() -> None:
    road = road_file(net("red_light"), "red light")
    root = ElementTree.fromstring(road.xml)
    names = {signal.get("id"): signal.get("name") for signal in root.iter("signal")}
    assert {
        f"{light}_{link}": str(number) for light, links in road.signals.items() for link, number in links.items()
    } == {name: number for number, name in names.items()}
    assert sorted(road.signals["crossing"]) == list(range(12))
    (controller,) = root.iter("controller")
    assert controller.get("id") == "crossing"
    assert {control.get("signalId") for control in controller} == set(names)


def test_road__has_the_same_bytes_each_time_and_no_path() -> None:
    first, second = (road_file(net("red_light"), "red light").xml for _ in range(2))
    assert first == second
    assert str(REPOSITORY).encode() not in first


def test_road__of_a_geographic_net_keeps_its_coordinates(build_net: Callable[..., Path]) -> None:
    nodes = '<node id="a" x="9.9950" y="52.0"/><node id="b" x="9.9990" y="52.0"/>'
    of_net = build_net(nodes, '<edge id="road" from="a" to="b"/>', "", "--proj.utm", "true")
    root = ElementTree.fromstring(road_file(of_net, "geographic").xml)
    header = root.find("header")
    assert header is not None
    kept = {each.get("code"): each.get("value") for each in header.iter("userData")}
    location = sumolib.net.readNet(str(of_net)).getLocationOffset()
    assert [float(each) for each in str(kept["offset"]).split()] == [-each for each in location]
    assert "+proj=utm" in str(kept["geoReference"])
    assert {child.tag for child in header} == {"userData"}
    assert mistakes_of(root) == []


@pytest.mark.parametrize("name", ["merge", "crossing", "red_light"])
def test_road__is_valid(name: str) -> None:
    if find_spec("qc_opendrive") is None:
        pytest.skip("asam-qc-opendrive is not installed: it needs NumPy 1 by its pins, so install it with --no-deps")
    assert mistakes_of(ElementTree.fromstring(road_file(net(name), name).xml)) == []


def mistakes_of(root: ElementTree.Element) -> list[str]:
    """What ASAM's schema says against a document, where it is installed: pip install --no-deps asam-qc-opendrive."""
    spec = find_spec("qc_opendrive")
    if spec is None:
        return []
    schema = xmlschema.XMLSchema(str(Path(str(spec.origin)).parent / "schema" / "1.4" / "OpenDRIVE_1.4H.xsd"))
    return [str(error) for error in schema.iter_errors(root)]
