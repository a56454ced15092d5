"""Reading of route files, and the errors of invalid ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.errors import UsageError
from harness.road.demand.route_file import Departure, Flow, FlowRate, RouteFile, VehicleType, times_of
from harness.road.demand.route_reading import read_route_file

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


def test_vehicle__is_read_with_its_type_and_route(write: Write) -> None:
    vehicle = (
        '<vehicle id="v" type="car" route="through" depart="2.5" departLane="1" departPos="20" departSpeed="max"/>'
    )
    routes = read_route_file(write(TYPE_AND_ROUTE + vehicle))
    assert routes.types["car"] == VehicleType(name="car", length_m=4.2, width_m=1.7, max_speed_mps=33.0)
    read = routes.vehicles["v"]
    assert (read.vehicle_type, read.edges, read.depart_s) == ("car", ("one", "two", "three"), 2.5)
    assert (read.lane, read.position, read.speed) == ("1", "20", "max")


def test_vehicle__has_the_defaults_of_sumo(write: Write) -> None:
    routes = read_route_file(write('<vehicle id="v"><route edges="one"/></vehicle>'))
    vehicle = routes.vehicles["v"]
    assert (vehicle.edges, vehicle.depart_s) == (("one",), 0.0)
    assert (vehicle.lane, vehicle.position, vehicle.speed) == ("first", "base", "0")
    default = routes.types["DEFAULT_VEHTYPE"]
    assert default == VehicleType(name="DEFAULT_VEHTYPE", length_m=5.0, width_m=1.8, max_speed_mps=55.55)


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
        ('number="0" end="0"', []),
        ('number="3" end="0"', [0.0, 0.0, 0.0]),
    ],
)
def test_flow__departs_at_its_times(write: Write, attributes: str, expected: list[float]) -> None:
    assert times(read_route_file(write(flow(attributes)))) == pytest.approx(expected)


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
    assert [each.name for each in background] == ["f.0", "late", "f.1"]  # numbered as in SUMO


def test_trip__is_kept_until_its_route_is_found(write: Write) -> None:
    routes = read_route_file(write('<trip id="t" from="a" to="d" via="b c" depart="0:01:30"/>'))
    assert routes.vehicles["t"].trip == ("a", "b", "c", "d")
    assert routes.vehicles["t"].depart_s == 90.0


def test_trip__of_stops_alone_leads_from_the_first_to_the_last(write: Write) -> None:
    stops = '<stop lane="a_0" duration="5"/><stop lane="b_1" endPos="20" duration="0:0:7" parking="true"/>'
    trip = read_route_file(write(f'<trip id="t">{stops}</trip>')).vehicles["t"]
    assert trip.trip == ("a", "b")
    assert [(stop.edge, stop.lane, stop.end_m, stop.duration_s, stop.parking) for stop in trip.stops] == [
        ("a", 0, None, 5.0, False),
        ("b", 1, 20.0, 7.0, True),
    ]


def test_stop__may_be_at_a_bus_stop_of_the_file(write: Write) -> None:
    bus_stop = '<busStop id="market" lane="b_0" startPos="10" endPos="25" name="Market"/>'
    vehicle = '<vehicle id="v"><route edges="a b"/><stop busStop="market" until="30"/></vehicle>'
    (stop,) = read_route_file(write(bus_stop + vehicle)).vehicles["v"].stops
    assert (stop.edge, stop.lane, stop.start_m, stop.end_m, stop.until_s) == ("b", 0, 10.0, 25.0, 30.0)


def test_distributions__are_drawn_by_their_shares(write: Write) -> None:
    mix = '<vTypeDistribution id="mix"><vType id="a" probability="3"/><vType id="b"/></vTypeDistribution>'
    ways = '<route id="r" edges="one"/><route id="s" edges="two"/>'
    choice = '<routeDistribution id="d" routes="r s" probabilities="1 4"/>'
    routes = read_route_file(write(mix + ways + choice + '<flow id="f" type="mix" route="d" period="1"/>'))
    drawn = departures(routes, until_s=4000.0)
    assert {(each.vehicle_type, each.edges) for each in drawn} == {(t, e) for t in "ab" for e in (("one",), ("two",))}
    # standard deviations of shares of 4000 draws: below 0.007
    assert np.mean([each.vehicle_type == "a" for each in drawn]) == pytest.approx(0.75, abs=0.03)
    assert np.mean([each.edges == ("two",) for each in drawn]) == pytest.approx(0.8, abs=0.03)


def test_distribution__may_replace_the_default_type(write: Write) -> None:
    mix = '<vTypeDistribution id="DEFAULT_VEHTYPE"><vType id="a"/><vType id="b"/></vTypeDistribution>'
    routes = read_route_file(write(mix + '<flow id="f" period="1"><route edges="one"/></flow>'))
    assert {each.vehicle_type for each in departures(routes)} == {"a", "b"}


def test_route__repeats_as_in_sumo(write: Write) -> None:
    # SUMO 1.28 drives a route of repeat="2" three times
    route = '<vehicle id="v"><route edges="one two" repeat="2"><stop lane="one_0" until="5"/></route></vehicle>'
    vehicle = read_route_file(write(route.replace('repeat="2"', 'repeat="2" cycleTime="60"'))).vehicles["v"]
    assert vehicle.edges == ("one", "two") * 3
    assert [stop.until_s for stop in vehicle.stops] == [5.0, 65.0, 125.0]


def test_vehicle__departs_and_arrives_within_its_route(write: Write) -> None:
    vehicle = '<vehicle id="v" departEdge="1" arrivalEdge="2"><route edges="a b c d"/></vehicle>'
    assert read_route_file(write(vehicle)).vehicles["v"].edges == ("b", "c")


@pytest.mark.parametrize(
    ("rate", "remedy"),
    [
        ('vehsPerHour="-4"', "above 0, up to 72000"),
        ('probability="2"', "of at least 0, up to 1"),
        ('period="0"', "of at least 0.05, up to 1e\\+07"),
    ],
)
def test_flow__one_with_an_impossible_rate_is_told_the_possible_ones(rate: str, remedy: str, write: Write) -> None:
    with pytest.raises(UsageError, match=rf"is not a number that is possible here \(give a number {remedy}\)"):
        read_route_file(write(flow(rate)))


def test_route__one_that_a_file_without_routes_names_has_no_valid_name(write: Write) -> None:
    with pytest.raises(UsageError, match=r"vehicle v: unknown route 'r' \(there are none\)"):
        read_route_file(write('<vehicle id="v" route="r"/>'))


def test_flow__takes_its_times_from_the_interval(write: Write) -> None:
    interval = '<interval begin="2" end="7"><flow id="f" period="2"><route edges="a"/></flow></interval>'
    assert times(read_route_file(write(interval))) == [2.0, 4.0, 6.0]


def test_flow__random_periods_have_the_rate(write: Write) -> None:
    drawn = times(read_route_file(write(flow('begin="10" end="5010" period="exp(0.4)"'))), 1e4)
    # 2000 expected, standard deviation sqrt(2000) = 45
    assert abs(len(drawn) - 2000) < 5 * 45
    assert 10.0 <= min(drawn) < max(drawn) < 5010.0
    assert np.std(np.diff(drawn)) == pytest.approx(2.5, rel=0.15)


def test_file__what_only_draws_or_records_is_left_out(write: Write) -> None:
    car = '<vType id="car" imgFile="/etc/passwd" osgFile="b" emissionClass="PHEMlight/../c" sigma="0.3">'
    params = '<param key="has.battery.device" value="true"/><param key="device.battery.capacity" value="9"/>'
    routes = read_route_file(write(f'{car}{params}<param key="note" value="x"/></vType>'))
    assert routes.types_xml == '<routes><vType id="car" sigma="0.3"><param key="note" value="x" /></vType></routes>'


def test_file__each_kind_of_refused_element_is_one_problem(write: Write) -> None:
    boxes = '<container id="p" depart="0"/><container id="q" depart="0"/>'
    with pytest.raises(UsageError, match=r"^\S+: container: containers are not supported \(2 times\) \(remove [^\n]*$"):
        read_route_file(write(boxes))


@given(
    begin_s=st.floats(0.0, 50.0),
    period_s=st.floats(0.1, 20.0),
    split_s=st.floats(0.0, 100.0),
    number=st.none() | st.integers(0, 30),
)
def test_flow__a_window_and_the_rest_make_up_the_whole(
    begin_s: float, period_s: float, split_s: float, number: int | None
) -> None:
    rate = FlowRate(period_s=period_s, number=number)
    draw = partial(times_of, rate, first_s=begin_s, density=1.0, generator=np.random.default_rng(0))
    whole = draw(end_s=100.0, begin_s=0.0)
    assert draw(end_s=min(split_s, 100.0), begin_s=0.0) + draw(end_s=100.0, begin_s=split_s) == whole


@given(st.floats(0.0, 5.0), st.floats(0.0, 60.0), st.integers(0, 1000))
def test_departures__lie_within_the_game_and_have_names_of_their_own(density: float, begin_s: float, seed: int) -> None:
    drawn = MANY.departures(set(), begin_s + 20.0, np.random.default_rng(seed), begin_s=begin_s, density=density)
    assert all(0.0 <= each.depart_s < 20.0 for each in drawn)
    assert [each.depart_s for each in drawn] == sorted(each.depart_s for each in drawn)
    assert len({each.name for each in drawn}) == len(drawn)


def test_density__is_a_factor_on_all_traffic() -> None:
    counts = [len(MANY.departures(set(), 60.0, np.random.default_rng(k), begin_s=0.0, density=2.0)) for k in range(100)]
    # at a density of 1: 20 + 30 vehicles of flows, 12 + 12 on average of random flows, and 6 single vehicles
    assert np.mean(counts) == pytest.approx(2 * 80, rel=0.03)


def _many() -> RouteFile:
    departure = Departure(name="", vehicle_type="t", edges=("a",), depart_s=0.0)
    rates = (FlowRate(period_s=3.0), FlowRate(period_s=2.0, number=30, spread=True))
    rates += (FlowRate(probability_per_s=0.2), FlowRate(mean_period_s=5.0))
    flows = (Flow(departure=replace(departure, name=f"f{k}"), end_s=60.0, rate=rate) for k, rate in enumerate(rates))
    vehicles = {f"v{k}": replace(departure, name=f"v{k}", depart_s=9.0 * k) for k in range(6)}
    return RouteFile(path=Path("a.rou.xml"), types={}, vehicles=vehicles, flows=tuple(flows), types_xml="")


MANY = _many()


def test_additional_file__gives_types_and_bus_stops(write: Write, tmp_path: Path) -> None:
    more = tmp_path / "more.add.xml"
    more.write_text('<additional><vType id="bus"/><busStop id="s" lane="b_0"/></additional>', encoding="utf-8")
    path = write('<trip id="t" type="bus" from="a" to="c"><stop busStop="s" duration="9"/></trip>')
    assert read_route_file(path, more).vehicles["t"].trip == ("a", "b", "c")
    more.write_text("<additional><tlLogic/></additional>", encoding="utf-8")
    with pytest.raises(UsageError, match=r"more.add.xml: tlLogic: is not understood here"):
        read_route_file(path, more)


STEADY = 'sigma="0" speedDev="0" lcStrategic="-1" lcCooperative="0" lcSpeedGain="0" lcKeepRight="0" maxSpeed="9"'
WALKER = '<person id="p" depart="0"><walk edges="one"/></person>'


@pytest.mark.parametrize(
    ("of_type", "of_vehicle", "more", "steady"),
    [
        (STEADY, "", "", True),
        (STEADY.replace('sigma="0"', 'sigma="0.5"'), "", "", False),
        (STEADY.replace('speedDev="0"', ""), "", "", False),
        (f'{STEADY} speedFactor="normc(1,0.1)"', "", "", False),
        (f'{STEADY} carFollowModel="EIDM"', "", "", False),
        (STEADY, 'departPos="random"', "", False),
        (STEADY, "", WALKER, False),
    ],
)
def test_traffic__is_steady_if_nothing_about_it_is_random(
    of_type: str, of_vehicle: str, more: str, steady: bool, write: Write
) -> None:
    vehicle = f'<vehicle id="v" type="slow" depart="0" {of_vehicle}><route edges="one"/></vehicle>{more}'
    routes = read_route_file(write(f'<vType id="slow" {of_type}/>{vehicle}'))
    assert routes.is_steady(set()) == steady
    assert routes.is_steady({"v", "p"})
