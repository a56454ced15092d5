"""The content of a SUMO route file, and the departures that a game draws from it.

The harness inserts every vehicle itself, at its time after the start of a game. All games of an arena therefore have
the same traffic, independent of earlier resets. What SUMO would draw when it loads the file is drawn here from the
game's generator: types and routes of distributions, and the times of random flows.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import ceil, inf
from pathlib import Path

import numpy as np

from harness.game.arrays import FloatArray
from harness.game.follower import Follower
from harness.game.seeding import drawn_index
from harness.road.demand.route_schema import PEOPLE
from harness.road.demand.stops import Stop

SIZES_M = {
    "pedestrian": (0.215, 0.478),
    "wheelchair": (1.2, 0.72),
    "scooter": (1.2, 0.5),
    "bicycle": (1.6, 0.65),
    "moped": (2.1, 0.78),
    "motorcycle": (2.2, 0.9),
    "truck": (7.1, 2.4),
    "trailer": (16.5, 2.55),
    "bus": (12.0, 2.5),
    "coach": (14.0, 2.6),
    "delivery": (6.5, 2.16),
    "emergency": (6.5, 2.16),
    "tram": (22.0, 2.4),
}
"""Length and width of a vType without them, by its class: the defaults of SUMO 1.28."""
CAR_SIZE_M = (5.0, 1.8)
"""Those of all other classes."""
DESIRED_SPEEDS_MPS = {"bicycle": 20.0 / 3.6, "pedestrian": 5.0 / 3.6}
"""The desiredMaxSpeed of a vType without one, by its class. Other classes have none."""
DEFAULT_TYPE, DEFAULT_PERSONS_TYPE = "DEFAULT_VEHTYPE", "DEFAULT_PEDTYPE"
PLACES = ("base", "center", "max", "random")
"""Words for the places of persons along an edge."""
SHARE = " of the room"
"""The ending of a drawn place across the lane: a share, from -1 (right) to 1 (left), of the room beside the vehicle."""
EDGE_SHARE = " of the edge"
"""The ending of a drawn place of a person along an edge: a share of its length."""
STEADY = {
    "sigma": "0",
    "speedDev": "0",
    "lcStrategic": "-1",
    "lcCooperative": "0",
    "lcSpeedGain": "0",
    "lcKeepRight": "0",
}
"""A vType with these attributes stays in its lane and draws none of SUMO's random numbers."""
LEAST_PERIOD_S = 0.05
MOST_AT_ONCE = 1000  # vehicles of a flow that all depart at its begin
_LEAST_DENSITY = 1e-9


@dataclass(frozen=True, kw_only=True)
class VehicleType:
    """Size and top speed of a vType. The defaults are those of SUMO for passenger cars."""

    name: str
    length_m: float = 5.0
    width_m: float = 1.8
    max_speed_mps: float = 55.55
    desired_speed_mps: float = inf
    """The vType's desiredMaxSpeed. SUMO inserts no vehicle that is faster than this times its speed factor."""
    lane_changes: str = ""
    """The vType's laneChangeModel; empty: SUMO's default."""
    vehicle_class: str = "passenger"
    steady: bool = False
    """Whether its vehicles stay in their lane and draw none of SUMO's random numbers."""


@dataclass(frozen=True, kw_only=True)
class RouteChoice:
    """One route of a distribution, with its share."""

    share: float
    edges: tuple[str, ...]
    stops: tuple[Stop, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Motion:
    """The motion of a vehicle of the warm-up: its front bumper, heading and speed, in the net's coordinates."""

    x_m: float
    y_m: float
    heading_rad: float
    speed_mps: float
    length_m: float
    width_m: float


@dataclass(frozen=True, kw_only=True)
class Departure:
    """The departure of one vehicle. Lane, position and speed are SUMO's departLane, departPos and departSpeed."""

    name: str
    vehicle_type: str
    edges: tuple[str, ...]
    depart_s: float
    lane: str = "first"
    position: str = "base"
    speed: str = "0"
    arrival: tuple[str, str, str] = ("current", "max", "current")
    """SUMO's arrivalLane, arrivalPos and arrivalSpeed."""
    lateral: str = ""
    """SUMO's departPosLat; empty: the middle of the lane."""
    speed_factor: float | None = None
    """None: drawn by SUMO from the type."""
    stops: tuple[Stop, ...] = ()
    trip: tuple[str, ...] = ()
    """The edges of a trip, from first to last, that a route has to be found for."""
    choices: tuple[RouteChoice, ...] = ()
    """The routes of a distribution. A departure of a game has one route and no choices."""
    motion: Motion | None = None
    """Of a vehicle that drives already when the game begins. `lane` is then the whole id of its lane."""
    follower: Follower | None = None
    """The driver of the vehicle that follows the ego."""
    element: str = "vehicle"
    """The element of the route file that describes it, such as a flow."""

    @property
    def on_foot(self) -> bool:
        """Whether it is a person, whose edges are those of its walk. The speed may be empty: as its type desires."""
        return self.element in PEOPLE

    @property
    def key(self) -> str:
        """What messages call it: its element and its name."""
        return f"{self.element} {self.name}"


@dataclass(frozen=True, kw_only=True)
class FlowRate:
    """The rate of a flow: one of a period, a mean period of random departures, and a probability per second."""

    period_s: float | None = None
    mean_period_s: float | None = None
    probability_per_s: float | None = None
    number: int | None = None
    """The number of vehicles after which the flow ends."""
    spread: bool = False
    """Whether the period follows from the number: with a density of 2, twice as many vehicles depart."""


@dataclass(frozen=True, kw_only=True)
class Flow:
    """A flow of vehicles."""

    departure: Departure
    end_s: float
    rate: FlowRate


@dataclass(frozen=True, kw_only=True)
class Mix:
    """A distribution of vehicle types."""

    types: tuple[str, ...]
    shares: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class RouteFile:
    path: Path
    types: Mapping[str, VehicleType]
    vehicles: Mapping[str, Departure]
    flows: tuple[Flow, ...]
    types_xml: str  # a route file with the vehicle types only, for SUMO
    mixes: Mapping[str, Mix] = field(default_factory=dict)
    found: Mapping[tuple[str, tuple[str, ...]], tuple[str, ...]] = field(default_factory=dict)
    """The routes of trips: the edges for each vehicle type and trip."""
    warnings: tuple[str, ...] = ()
    """A line for each attribute that SUMO ignores."""

    @property
    def names(self) -> set[str]:
        """Those of all vehicles, persons and flows."""
        return {*self.vehicles, *(flow.departure.name for flow in self.flows)}

    def is_steady(self, excluded: set[str]) -> bool:
        """Whether the traffic without the `excluded` vehicles draws none of SUMO's random numbers and stays in its
        lanes: no person walks, and all vehicles have steady types and departures."""
        others = [*self.vehicles.values(), *(flow.departure for flow in self.flows)]
        return all(self._steady(each) for each in others if each.name not in excluded)

    def _steady(self, departure: Departure) -> bool:
        if departure.on_foot or any("random" in each for each in (departure.lane, departure.position, departure.speed)):
            return False
        mix = self.mixes.get(departure.vehicle_type)
        return all(self.types[name].steady for name in (mix.types if mix else (departure.vehicle_type,)))

    def departures(
        self,
        excluded: set[str],
        until_s: float,
        generator: np.random.Generator,
        *,
        begin_s: float = 0.0,
        density: float = 1.0,
    ) -> list[Departure]:
        """The departures from `begin_s` to `until_s` of the file, by time, without the `excluded` vehicles.

        Their times count from `begin_s`. `density` is a factor on the rates of flows; a single vehicle departs that
        many times on average, as with SUMO's option --scale.
        """
        due = [each for each in self._listed(begin_s, until_s) if each.name not in excluded]
        if density != 1.0:
            due = self._repeated(due, density, generator)
        for flow in self.flows:
            times = times_of(
                flow.rate,
                first_s=flow.departure.depart_s,
                end_s=min(flow.end_s, until_s),
                begin_s=begin_s,
                density=density,
                generator=generator,
            )
            due += [replace(flow.departure, name=f"{flow.departure.name}.{k}", depart_s=time) for k, time in times]
        drawn = [self._drawn(each, generator, begin_s) for each in due]
        return sorted(drawn, key=lambda each: (each.depart_s, each.name))

    def within(self, begin_s: float, until_s: float) -> list[Departure]:
        """The vehicles of this time, as they are written. A flow is represented by one of its vehicles."""
        flows = [each.departure for each in self.flows if each.departure.depart_s < until_s and each.end_s > begin_s]
        return [*self._listed(begin_s, until_s), *flows]

    def variants(self, departure: Departure) -> list[Departure]:
        """A departure with each type and each route that it may have."""
        mix = self.mixes.get(departure.vehicle_type)
        typed = [replace(departure, vehicle_type=each) for each in mix.types] if mix else [departure]
        return [
            variant
            for each in typed
            for variant in ([_on(each, choice) for choice in each.choices] or [self.routed(each)])
        ]

    @cached_property
    def _by_time(self) -> tuple[list[float], list[Departure]]:
        vehicles = sorted(self.vehicles.values(), key=lambda each: each.depart_s)
        return [each.depart_s for each in vehicles], vehicles

    def _listed(self, begin_s: float, until_s: float) -> list[Departure]:
        times, vehicles = self._by_time
        return vehicles[bisect_left(times, begin_s) : bisect_left(times, until_s)]

    def _repeated(self, due: Sequence[Departure], density: float, generator: np.random.Generator) -> list[Departure]:
        counts = np.floor(density + generator.random(len(due))).astype(int).tolist()
        return [
            each if copy == 0 else replace(each, name=f"{each.name}.copy{copy}")
            for each, count in zip(due, counts, strict=True)
            for copy in range(count)
        ]

    def _drawn(self, departure: Departure, generator: np.random.Generator, begin_s: float) -> Departure:
        """A departure of a game, with one type and one route, and with times from `begin_s`."""
        mix = self.mixes.get(departure.vehicle_type)
        if mix is not None:
            departure = replace(departure, vehicle_type=mix.types[drawn_index(mix.shares, generator)])
        if departure.choices:
            place = drawn_index([each.share for each in departure.choices], generator)
            departure = _on(departure, departure.choices[place])
        if begin_s:
            stops = tuple(stop.later(-begin_s) for stop in departure.stops)
            departure = replace(departure, depart_s=departure.depart_s - begin_s, stops=stops)
        if departure.lateral == "random":
            departure = replace(departure, lateral=f"{generator.uniform(-1.0, 1.0):.3f}{SHARE}")
        if departure.on_foot:
            departure = _placed(departure, generator)
        return self.routed(departure)

    def routed(self, departure: Departure) -> Departure:
        """A departure with the route that was found for its trip, if it has one."""
        if not departure.trip or departure.edges:
            return departure
        return replace(departure, edges=self.found.get((departure.vehicle_type, departure.trip), ()))


def _on(departure: Departure, choice: RouteChoice) -> Departure:
    return replace(departure, edges=choice.edges, stops=choice.stops + departure.stops, choices=())


def _placed(person: Departure, generator: np.random.Generator) -> Departure:
    """A person with drawn places at random along the first and the last edge of its walk."""
    first, last = (
        f"{generator.random():.6f}{EDGE_SHARE}" if place == "random" else place
        for place in (person.position, person.arrival[1])
    )
    return replace(person, position=first, arrival=("", last, ""))


def times_of(
    rate: FlowRate, *, first_s: float, end_s: float, begin_s: float, density: float, generator: np.random.Generator
) -> list[tuple[int, float]]:
    """The number and the time of each departure of a flow, which runs from `first_s` to `end_s`, from `begin_s` on.

    `density` is a factor on the rate. Vehicles with a fixed period are numbered from the flow's begin, the others from
    `begin_s`.
    """
    if density < _LEAST_DENSITY:
        return []
    number = rate.number
    if number is not None and rate.spread:
        number = round(number * density)
    if rate.period_s == 0.0:
        return [(k, first_s) for k in range(number or 0) if begin_s <= first_s]
    if rate.period_s is not None:
        skipped, times = _regular_times(first_s, end_s, begin_s, rate.period_s / density)
    elif rate.mean_period_s is not None:
        skipped, times = 0, _random_times(max(first_s, begin_s), end_s, rate.mean_period_s / density, generator)
    else:  # in each second a vehicle departs with a probability; above 1: one for certain, and more
        seconds = np.arange(first_s + max(ceil(begin_s - first_s), 0), end_s, 1.0)
        expected = (rate.probability_per_s or 0.0) * density
        skipped, times = 0, np.repeat(seconds, np.ceil(expected - generator.random(len(seconds))).astype(int))
    numbered = [(skipped + k, time) for k, time in enumerate(times.tolist())]
    return numbered if number is None else [each for each in numbered if each[0] < number]


def _regular_times(first_s: float, end_s: float, begin_s: float, period_s: float) -> tuple[int, FloatArray]:
    """The number of the first time from `begin_s` on, and the times."""
    before = max(ceil((begin_s - first_s) / period_s) - 2, 0)  # rounding may move a time by one period
    after = max(ceil((end_s - first_s) / period_s) + 2, before)
    times: FloatArray = first_s + period_s * np.arange(before, after)
    skipped = int(np.searchsorted(times, begin_s))
    return before + skipped, times[skipped : np.searchsorted(times, end_s)]


def _random_times(begin_s: float, end_s: float, mean_period_s: float, generator: np.random.Generator) -> FloatArray:
    """The times of a Poisson process. It has no memory, and so may begin at any time of the flow."""
    expected = max(end_s - begin_s, 0.0) / mean_period_s
    times: FloatArray = begin_s + np.cumsum(generator.exponential(mean_period_s, int(expected + 5 * expected**0.5) + 5))
    while times[-1] < end_s:
        times = np.append(times, times[-1] + np.cumsum(generator.exponential(mean_period_s, 20)))
    return times[times < end_s]
