"""Starts, speeds and goals of a game at a candidate, such that both players reach the place at about the same time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
import shapely
from sumolib.net import Net

from harness.game.arrays import FloatArray
from harness.game.road import SPACING_M
from harness.maps.candidates import Candidate, CandidateKind, LaneWay, Priority, candidates, following, ring_edges
from harness.maps.planned_routes import PlannedRoute, following_m, planned_route, sampled_to, way_over
from harness.road.net.route_table import meeting_of_lines

Range = tuple[float, float]

_SHARES = (0.65, 0.95)  # of the speed limit, at the start
_SLOWER = (1.0, 0.8, 0.65, 0.5)
_SLOWEST_MPS = 4.0
_SECONDS = (6.5, 5.5, 5.0, 4.5, 4.0)  # from the farthest start of the ego to the place, at its highest speed
_TRIES = tuple(product(_SLOWER, _SECONDS))  # the best first
_BEFORE_LIGHTS = (1.0, 8.5)  # tried first where a player comes to a traffic light: time to see it, and to stop
_START_RANGE_S = 1.5
_APART_S = 1.5  # between the arrivals, at most
_WALK_MPS, _WALK_APART_S = (1.0, 1.4), 2.0
_FIRST_START_M = 6.0  # the front of a car whose body is on its route
_BEFORE_S = 12.0  # of road before the place, at the highest speed of a start
_NARROWEST_M = 2.5
_NEAR_M = 25.0  # between the place of a candidate and that where the routes meet
_BESIDE_M = 8.0
_LEAST_FOLLOWING = 0.7
_EXAMPLE = ", such as "
_LESS_SHARP = {CandidateKind.LANE_END: 0.8, CandidateKind.ZEBRA: 0.7, CandidateKind.FOLLOWING: 0.4}  # than a crossing
_NO_PRIORITY, _SIGNALS = 0.7, 0.5  # who has to wait is less clear; a red light takes long to learn
_ALL_TURNS_DEG = 360.0  # of both routes, beside which the score is halved
_BRAKING_MPS2, _REACTION_S = 3.0, 1.0  # of a driver who sees a stop line at the start
_SPARE_S = 8.0
_TIME_LIMITS_S = (30.0, 300.0)
_CAR_MPS = 40.0  # highest speed of a car, or more where the limit is high
_SHOWN = 100  # conflicts from one line of progress to the next


@dataclass(frozen=True, kw_only=True, slots=True)
class Start:
    """A player's start: one of the three keys of a scene."""

    key: str  # route_m, arrival_after_ego_s, or lane with position_m or beside_ego_m
    range: Range
    speed_mps: Range
    first_m: float  # the farthest start, along the route
    lane: str = ""


@dataclass(frozen=True, kw_only=True, slots=True)
class GamePlan:
    """Routes and starts of both players of a game at a candidate."""

    candidate: Candidate
    ego_route: PlannedRoute
    ego: Start
    person: Start
    approach: float
    """Length of the way to the place, as a share of the longest that is tried."""
    person_route: PlannedRoute | None = None
    way: FloatArray | None = None  # [n, 2] of a person on foot
    number: int = 0

    @property
    def way_points(self) -> list[list[float]]:
        """The way of a person on foot, in centimetres' precision."""
        return [] if self.way is None else [[round(float(each), 2) for each in point] for point in self.way]

    @property
    def edges(self) -> set[str]:
        return {name for route in (self.ego_route, self.person_route) if route is not None for name in route.edges}

    @property
    def score(self) -> float:
        """0 to 100: how well the game asks its question. It is higher with a longer approach, straighter routes, a
        rule of priority, and no traffic light."""
        sharp = _LESS_SHARP.get(self.candidate.kind, 1.0)
        if self.candidate.with_signals:
            sharp *= _SIGNALS
        elif self.candidate.priority is not Priority.FIRST and self.candidate.second is not None:
            sharp *= _NO_PRIORITY
        turns_deg = sum(sum(route.turns_deg) for route in (self.ego_route, self.person_route) if route is not None)
        return 100.0 * sharp * self.approach / (1.0 + turns_deg / _ALL_TURNS_DEG)

    @property
    def car_speed_mps(self) -> float:
        """The highest speed of the players' cars: above that of any start."""
        return float(np.ceil(max(_CAR_MPS, self.ego.speed_mps[1], self.person.speed_mps[1])))

    def time_limit_s(self, reds_s: Mapping[str, float]) -> float:
        """Time enough for both from their farthest starts, at the speed of the slowest, and for the longest red of each
        traffic light on their ways, by its id."""
        longest_s = max(_seconds(route, start.first_m, reds_s) for route, start in self._driven)
        if self.way is not None:
            longest_s = max(longest_s, shapely.LineString(self.way).length / _WALK_MPS[0])
        return float(np.clip(5.0 * np.ceil((longest_s + _SPARE_S) / 5.0), *_TIME_LIMITS_S))

    def longest_red_s(self, reds_s: Mapping[str, float]) -> float:
        """The longest red of a traffic light on their ways, of `reds_s` by its id; 0 without one."""
        names = [name for route, start in self._driven for at_m, name in route.lights if at_m > start.first_m]
        return max((reds_s.get(name, 0.0) for name in names), default=0.0)

    @property
    def _driven(self) -> list[tuple[PlannedRoute, Start]]:
        person = [] if self.person_route is None else [(self.person_route, self.person)]
        return [(self.ego_route, self.ego), *person]


def _seconds(route: PlannedRoute, from_m: float, reds_s: Mapping[str, float]) -> float:
    """Time from a station to the goal, at the lowest share of the speed limit and through red lights."""
    way_m = route.goal_m - from_m
    return way_m / (_SHARES[0] * route.limit_mps) + sum(
        reds_s.get(name, 0.0) for at_m, name in route.lights if at_m > from_m
    )


class Plans:
    """The candidates of a net of which a scene can be made, numbered from 1, and why the others are left out."""

    def __init__(self, net: Net, show: Callable[[str], object] = str) -> None:
        """`show` gets a line on how far the search is."""
        self.net, self._show = net, show
        self.left_out: dict[str, int] = {}
        self._routes: dict[tuple[LaneWay, float], PlannedRoute | str] = {}
        self._rings = ring_edges(net)

    @cached_property
    def all(self) -> list[GamePlan]:
        """A plan of each candidate, the highest score first. A net on which no two ways meet has the longest roads
        instead."""
        found: list[GamePlan] = []
        reasons: dict[str, str] = {}  # the first of each with its example
        self._show("finding conflicts")
        for group in (candidates, following):
            listed = list(group(self.net)) if not found else []
            for k, candidate in enumerate(listed):
                if k % _SHOWN == 0:
                    self._show(f"planning games: {k:,} of {len(listed):,} conflicts")
                try:
                    plan = self._plan(candidate)
                except (ArithmeticError, LookupError, ValueError, shapely.errors.ShapelyError) as error:
                    plan = f"lanes that can't be used{_EXAMPLE}{candidate.first.start.getID()}: {error}"
                if isinstance(plan, GamePlan):
                    found.append(plan)
                else:
                    reason = reasons.setdefault(plan.partition(_EXAMPLE)[0], plan)
                    self.left_out[reason] = self.left_out.get(reason, 0) + 1
        best_first = sorted(found, key=lambda plan: -round(plan.score))  # of equal ones, the first candidate's
        return [replace(plan, number=number) for number, plan in enumerate(best_first, start=1)]

    def _plan(self, candidate: Candidate) -> GamePlan | str:
        ways = [way for way in (candidate.first, candidate.second) if way is not None]
        if narrow := _narrow(ways):
            return narrow
        ego_route = self._route(candidate.first)
        if isinstance(ego_route, str):
            return ego_route
        if candidate.second is None:
            return self._on_foot(candidate, ego_route)
        if candidate.kind is CandidateKind.FOLLOWING:
            return _one_behind_the_other(candidate, ego_route)
        route = self._route(candidate.second)
        if isinstance(route, str):
            return route
        if candidate.first.start.getEdge() is candidate.second.start.getEdge():
            return self._from_the_same_edge(candidate, ego_route, route) or "too little road before it"
        for before_m in (None, 80.0, 40.0):  # longer routes may meet before the place
            first, second = (self._route(way, before_m) for way in (candidate.first, candidate.second))
            if isinstance(first, PlannedRoute) and isinstance(second, PlannedRoute):
                plan = _timed(candidate, ego_route=first, route=second, within_m=_NEAR_M)
                if plan is not None:
                    return plan
        return "too little road before it"

    def _route(self, way: LaneWay, before_m: float | None = None) -> PlannedRoute | str:
        """The route over a way, with so much road before its junction that a game can start at speed; the reason if
        there is none."""
        wanted_m = before_m or _BEFORE_S * _SHARES[1] * float(way.start.getSpeed())
        key = (way, wanted_m)
        if key not in self._routes:
            self._routes[key] = planned_route(self.net, way, wanted_m, self._rings)
        return self._routes[key]

    def _from_the_same_edge(
        self, candidate: Candidate, ego_route: PlannedRoute, route: PlannedRoute
    ) -> GamePlan | None:
        """Both on one edge, on two lanes that become one: by time if they come from different roads, else abreast."""
        assert candidate.second is not None, "both are cars"
        if ego_route.edges[0] != route.edges[0]:
            length_m = candidate.first.start.getLength()
            plan = _timed(candidate, ego_route=ego_route, route=route, within_m=length_m + _NEAR_M)
            if plan is not None:
                return plan
        lanes, length_m = (candidate.first.start, candidate.second.start), candidate.first.start.getLength()
        for slower in _SLOWER:
            speed = _speeds(lanes[0].getSpeed(), slower)
            low_m, high_m = length_m - 6.0 * speed[1], length_m - 4.0 * speed[1]
            if low_m - _BESIDE_M >= 1.0:
                return GamePlan(
                    candidate=candidate,
                    approach=slower,
                    ego_route=ego_route,
                    person_route=route,
                    ego=Start(
                        key="position_m",
                        range=_rounded(low_m, high_m),
                        speed_mps=speed,
                        first_m=ego_route.junction_m - length_m + low_m,
                        lane=lanes[0].getID(),
                    ),
                    person=Start(
                        key="beside_ego_m",
                        range=(-_BESIDE_M, _BESIDE_M),
                        speed_mps=speed,
                        first_m=route.junction_m - length_m + low_m - _BESIDE_M,
                        lane=lanes[1].getID(),
                    ),
                )
        return None

    def _on_foot(self, candidate: Candidate, ego_route: PlannedRoute) -> GamePlan | str:
        for slower, seconds in _TRIES:
            speed = _speeds(ego_route.limit_mps, slower)
            most_s = seconds * speed[1] / speed[0] + _WALK_APART_S
            way = way_over(candidate, _WALK_MPS[1] * most_s + 2.0)
            if way is None:
                return "no pavement on a side of it"
            found = meeting_of_lines(ego_route.line, sampled_to(way, shapely.LineString(way).length))
            if found is None:
                continue
            start = _ego_start(found.ego_m, speed, seconds)
            if start.range[0] >= _FIRST_START_M and found.other_m >= _WALK_MPS[1] * most_s:
                person = _arriving(_WALK_APART_S, _WALK_MPS, found.other_m - _WALK_MPS[1] * most_s)
                approach = slower * seconds / _SECONDS[0]
                return GamePlan(
                    candidate=candidate, approach=approach, ego_route=ego_route, ego=start, person=person, way=way
                )
        return "too little road or pavement before it"


def _timed(candidate: Candidate, *, ego_route: PlannedRoute, route: PlannedRoute, within_m: float) -> GamePlan | None:
    """The plan in which both arrive within `_APART_S` of each other; None if the routes leave no room for it."""
    line = ego_route.line
    found = meeting_of_lines(line, route.line)
    if found is None:
        return None
    point = line[min(round(found.ego_m / SPACING_M), len(line) - 1)]
    if float(np.hypot(*(point - candidate.place))) > within_m:
        return None
    has_lights = any(at_m <= each.junction_m for each in (ego_route, route) for at_m, _ in each.lights)
    tries = (_BEFORE_LIGHTS, *_TRIES) if has_lights else _TRIES
    for slower, seconds in tries:
        speed, other = _speeds(ego_route.limit_mps, slower), _speeds(route.limit_mps, slower)
        start = _ego_start(found.ego_m, speed, seconds)
        most_s = seconds * speed[1] / speed[0] + _APART_S
        first_m = found.other_m - other[1] * most_s
        least_s = max(seconds - _START_RANGE_S - _APART_S, 0.0)
        clear = _clear(ego_route, start.range, speed[1]) and all(
            _clear(route, (found.other_m - mps * most_s, found.other_m - mps * least_s), mps) for mps in other
        )
        if clear and min(start.first_m, first_m) >= _FIRST_START_M:
            return GamePlan(
                candidate=candidate,
                approach=min(slower * seconds / _SECONDS[0], 1.0),
                ego_route=ego_route,
                person_route=route,
                ego=start,
                person=_arriving(_APART_S, other, first_m),
            )
    return None


def _one_behind_the_other(candidate: Candidate, route: PlannedRoute) -> GamePlan | str:
    speed = _speeds(route.limit_mps, 1.0)
    length_m, needed_m = route.goal_m, _LEAST_FOLLOWING * following_m(route.limit_mps)
    if length_m < needed_m:
        return f"too short a road: {length_m:.0f} m of {needed_m:.0f} m"
    return GamePlan(
        candidate=candidate,
        approach=1.0,
        ego_route=route,
        person_route=route,
        ego=Start(key="route_m", range=(10.0, 30.0), speed_mps=speed, first_m=10.0),
        person=Start(key="route_m", range=(55.0, 75.0), speed_mps=speed, first_m=55.0),
    )


def _ego_start(meeting_m: float, speed: Range, seconds: float) -> Start:
    farthest, nearest = (meeting_m - speed[1] * each for each in (seconds, seconds - _START_RANGE_S))
    return Start(key="route_m", range=_rounded(farthest, nearest), speed_mps=speed, first_m=farthest)


def _clear(route: PlannedRoute, starts_m: Range, speed_mps: float) -> bool:
    """Whether a car that starts at these stations (m) of its front can stop at each traffic light before it."""
    stopping_m = _REACTION_S * speed_mps + speed_mps**2 / (2.0 * _BRAKING_MPS2)
    return not any(starts_m[0] < at_m and at_m - stopping_m < starts_m[1] for at_m, _ in route.lights)


def _arriving(apart_s: float, speed: Range, first_m: float) -> Start:
    return Start(key="arrival_after_ego_s", range=(-apart_s, apart_s), speed_mps=speed, first_m=first_m)


def _speeds(limit_mps: float, slower: float) -> Range:
    low, high = (max(share * slower * limit_mps, _SLOWEST_MPS) for share in _SHARES)
    return _rounded(low, max(high, low + 1.0))


def _narrow(ways: list[LaneWay]) -> str:
    """The reason against a way on a lane that is too narrow for a car; empty if there is none."""
    for lane in (lane for way in ways for lane in (way.start, way.end)):
        if lane.getWidth() < _NARROWEST_M:
            return f"lanes narrower than {_NARROWEST_M:g} m{_EXAMPLE}{lane.getID()} of {lane.getWidth():.2f} m"
    return ""


def _rounded(low: float, high: float) -> Range:
    return round(low, 1), round(high, 1)
