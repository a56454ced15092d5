"""Reading of route files, and the errors of invalid ones."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from harness.errors import UsageError
from harness.traffic.route_file import Departure, RouteFile, VehicleType
from harness.traffic.route_reading import read_route_file

Write = Callable[[str], Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def to_file(content: str) -> Path:
        path = tmp_path / "a.rou.xml"
        path.write_text(f"<routes>{content}</routes>", encoding="utf-8")
        return path

    return to_file


TYPE_AND_ROUTE = '<vType id="car" length="4.2" width="1.7" maxSpeed="33"/><route id="through" edges="one two three"/>'


def flow(attributes: str) -> str:
    return f'{TYPE_AND_ROUTE}<flow id="f" type="car" route="through" {attributes}/>'


def departures(routes: RouteFile, until_s: float = 10.0, seed: int = 0) -> list[Departure]:
    return routes.departures(set(), until_s, np.random.default_rng(seed))


def times(routes: RouteFile, until_s: float = 10.0, seed: int = 0) -> list[float]:
    return [each.depart_s for each in departures(routes, until_s, seed)]


def problem(path: Path) -> str:
    with pytest.raises(UsageError) as raised:
        read_route_file(path)
    assert len(raised.value.problems) == 1
    assert raised.value.problems[0].file == str(path)
    assert raised.value.problems[0].remedy
    return str(raised.value).removeprefix(f"{path}: ")


def test_vehicle__is_read_with_its_type_and_route(write: Write) -> None:
    vehicle = (
        '<vehicle id="v" type="car" route="through" depart="2.5" departLane="1" departPos="20" departSpeed="max"/>'
    )
    routes = read_route_file(write(TYPE_AND_ROUTE + vehicle))
    assert routes.types["car"] == VehicleType(name="car", length_m=4.2, width_m=1.7, max_speed_mps=33.0)
    assert routes.vehicles["v"] == Departure(
        name="v",
        vehicle_type="car",
        edges=("one", "two", "three"),
        depart_s=2.5,
        lane="1",
        position="20",
        speed="max",
    )


def test_vehicle__has_the_defaults_of_sumo(write: Write) -> None:
    routes = read_route_file(write('<vehicle id="v"><route edges="one"/></vehicle>'))
    vehicle = routes.vehicles["v"]
    assert vehicle == Departure(
        name="v",
        vehicle_type="DEFAULT_VEHTYPE",
        edges=("one",),
        depart_s=0.0,
        lane="first",
        position="base",
        speed="0",
    )
    default = routes.types[vehicle.vehicle_type]
    assert default == VehicleType(name="DEFAULT_VEHTYPE", length_m=5.0, width_m=1.8, max_speed_mps=55.55)


def test_vehicle__may_precede_its_route(write: Write) -> None:
    routes = read_route_file(write('<vehicle id="v" route="r"/><route id="r" edges="one"/>'))
    assert routes.vehicles["v"].edges == ("one",)


def test_types__are_written_without_the_vehicles(write: Write) -> None:
    mix = '<vTypeDistribution id="mix"><vType id="van" width="2.1"/></vTypeDistribution>'
    routes = read_route_file(write(TYPE_AND_ROUTE + mix + '<flow id="f" type="mix" route="through" period="5"/>'))
    assert "vTypeDistribution" in routes.types_xml
    assert 'id="car"' in routes.types_xml
    assert "<flow" not in routes.types_xml
    assert "<route " not in routes.types_xml
    assert routes.types["van"].width_m == 2.1


@pytest.mark.parametrize(
    ("attributes", "expected"),
    [
        ('period="3"', [0.0, 3.0, 6.0, 9.0]),
        ('begin="1" end="8" period="3"', [1.0, 4.0, 7.0]),
        ('begin="1" end="7" period="3"', [1.0, 4.0]),  # without the end itself
        ('vehsPerHour="1800"', [0.0, 2.0, 4.0, 6.0, 8.0]),  # 3600 / 1800 = 2 s
        ('end="10" number="4"', [0.0, 2.5, 5.0, 7.5]),
        ('period="1" number="2"', [0.0, 1.0]),
        ('begin="2" end="4" probability="1"', [2.0, 3.0]),
        ('probability="0"', []),
        ('begin="20" period="1"', []),
    ],
)
def test_flow__departs_at_its_times(write: Write, attributes: str, expected: list[float]) -> None:
    assert times(read_route_file(write(flow(attributes)))) == pytest.approx(expected)


def test_flow__its_vehicles_are_numbered_as_in_sumo(write: Write) -> None:
    routes = read_route_file(write(flow('period="4" departSpeed="10"')))
    assert [(each.name, each.speed) for each in departures(routes)] == [("f.0", "10"), ("f.1", "10"), ("f.2", "10")]


def test_flow__random_departures_come_from_the_generator(write: Write) -> None:
    routes = read_route_file(write(flow('probability="0.3"')))
    assert times(routes, 300.0, seed=1) == times(routes, 300.0, seed=1)
    assert times(routes, 300.0, seed=1) != times(routes, 300.0, seed=2)
    # 2000 draws at 0.3: 600, standard deviation sqrt(2000 * 0.3 * 0.7) = 20.5
    assert abs(len(times(routes, 2000.0)) - 600) < 5 * 20.5


def test_departures__are_sorted_by_time_without_the_players(write: Write) -> None:
    more = '<vehicle id="late" route="through" depart="4"/><vehicle id="ego" route="through"/>'
    routes = read_route_file(write(flow('begin="1" period="5"') + more))
    background = routes.departures({"ego"}, 10.0, np.random.default_rng(0))
    assert [each.name for each in background] == ["f.0", "late", "f.1"]


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ('<vehicle id="v" type="cat" route="through"/>', "vehicle v: unknown vehicle type 'cat' (did you mean 'car'?)"),
        ('<vehicle id="v" route="trough"/>', "vehicle v: unknown route 'trough' (did you mean 'through'?)"),
        ('<vehicle route="through"/>', "vehicle: has no 'id' (give every vehicle its id)"),
        ('<vehicle id="v"/>', "vehicle: has no 'route' (give every vehicle its route)"),
        ('<vehicle id="v"><route edges=" "/></vehicle>', "vehicle v: its route has no edges"),
        ('<vehicle id="v" route="through" depart="soon"/>', "vehicle v.depart: 'soon' is not a number"),
        ('<vehicle id="v" route="through" depart="-1"/>', "vehicle v.depart: '-1' is not a number that is possible"),
        ('<vehicle id="v" route="through" depart="nan"/>', "vehicle v.depart: 'nan' is not a number"),
        ('<vehicle id="v" route="through" depart="inf"/>', "vehicle v.depart: 'inf' is not a number"),
        ('<vType id="t" length="0"/>', "vType t.length: '0' is not a number that is possible"),
        ('<vType id="t" maxSpeed="0"/>', "vType t.maxSpeed: '0' is not a number that is possible"),
        ('<flow id="f" route="through" period="0"/>', "flow f.period: '0' is not a number that is possible"),
        ('<flow id="f" route="through" probability="2"/>', "flow f.probability: '2' is not a number"),
        ('<flow id="f" route="through"/>', "flow f: has no rate (give one of period, vehsPerHour, probability)"),
        ('<flow id="f" route="through" number="3"/>', "flow f: has no rate"),
        ('<flow id="f" route="through" begin="5" end="4" number="3"/>', "flow f.end: does not lie after its begin"),
        ('<vehicle id="v" route="through"/><vehicle id="v" route="through"/>', "vehicle v: stands twice"),
        ('<trips id="t" from="a" to="b"/>', "trips: is not understood here (did you mean 'trip'?)"),
    ],
)
def test_mistake__is_named_with_its_place_and_remedy(write: Write, content: str, expected: str) -> None:
    assert problem(write(TYPE_AND_ROUTE + content)).startswith(expected)


def test_file__a_missing_one_is_an_error(write: Write) -> None:
    path = write("")
    assert "there is no such file (did you mean 'a.rou.xml'?)" in problem(path.with_name("b.rou.xml"))


def test_file__other_content_than_xml_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "a.rou.xml"
    path.write_text("<routes><vehicle", encoding="utf-8")
    assert problem(path).startswith("is not readable XML")
    path.write_bytes(b"\x89PNG\r\n\xff\xfe")
    assert problem(path).startswith("is not readable XML")


def test_file__an_entity_bomb_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.rou.xml"
    laughs = "".join(f'<!ENTITY l{k} "{f"&l{k - 1};" * 10}">' for k in range(1, 10))
    path.write_text(f'<!DOCTYPE r [<!ENTITY l0 "ha">{laughs}]><routes>&l9;</routes>', encoding="utf-8")
    assert problem(path).startswith("carries XML entities")


def test_file__an_external_entity_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.rou.xml"
    path.write_text('<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/hostname">]><routes>&x;</routes>', encoding="utf-8")
    assert problem(path).startswith("carries XML entities")
