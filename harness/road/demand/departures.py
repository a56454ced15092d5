"""Checks of the background vehicles' departures: departures that SUMO would refuse during a game are found before."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from itertools import pairwise
from math import inf

from sumolib.net import Net
from sumolib.net.edge import Edge

from harness.config.toml_reading import nearest
from harness.errors import MOST_PROBLEMS, Problem, UsageError, collect
from harness.game.roles import ROLES
from harness.road.demand.route_file import Departure, RouteFile
from harness.road.demand.stops import stop_problems
from harness.road.demand.walks import unsafe_net, walk_problems
from harness.road.net import network
from harness.road.xml.xml_file import number_of

_WORDS = {
    "departLane": ("random", "free", "allowed", "best", "first"),
    "departPos": ("random", "free", "random_free", "base", "last"),
    "departSpeed": ("random", "max", "desired", "speedLimit", "last", "avg"),
    "arrivalLane": ("current", "random", "first"),
    "arrivalPos": ("random", "max", "center"),
    "arrivalSpeed": ("current",),
}
"""What an attribute may be beside a number."""
_ROUNDED = 1.001  # recorded speeds and speed factors are rounded; SUMO raises the factor
_ALL_THE_TIME_S = (0.0, inf)


def edges_of(departure: Departure, net: Net, routes: RouteFile) -> list[Edge]:
    """The edges of a vehicle's route. Raises UsageError for edges that the net does not have."""
    key = departure.key
    problems: list[Problem] = []
    edges = {
        name: collect(problems, partial(network.find_edge, net, routes.path, key, name))
        for name in dict.fromkeys(departure.edges)
    }
    if problems:
        raise UsageError(problems)
    return [edges[name] for name in departure.edges]


def background_departures(
    routes: RouteFile, players: Iterable[str], window_s: tuple[float, float] = _ALL_THE_TIME_S
) -> list[Departure]:
    """The departures of all vehicles but the players in a time of the file, with each type and route they may have.

    A flow is represented by one of its vehicles.
    """
    players = set(players)
    within = [each for each in routes.within(*window_s) if each.name not in players]
    return [variant for each in within for variant in routes.variants(each)]


def check_departures(
    players: set[str],
    net: Net,
    routes: RouteFile,
    *,
    window_s: tuple[float, float] = _ALL_THE_TIME_S,
    roles: Sequence[str] = ROLES,
) -> None:
    """Raise UsageError for background vehicles in a time of the file that SUMO would refuse during a game.

    `players` are the ids of the players' vehicles in the route file, `roles` their names in the game.
    """
    problems: list[Problem] = []
    background = background_departures(routes, players, window_s)
    unsafe = unsafe_net(net) if any(each.on_foot for each in background) else None
    if unsafe:
        raise UsageError([Problem(str(routes.path), "person", *unsafe)])
    for departure in background:
        where = (str(routes.path), departure.key)
        if departure.name in roles and players <= routes.vehicles.keys():
            problems.append(Problem(*where, "has the name of a player, but is not the player's vehicle", "rename it"))
        edges = collect(problems, partial(edges_of, departure, net, routes))
        if edges and departure.on_foot:
            problems += [Problem(*where, *each) for each in walk_problems(departure, edges)]
        elif edges:
            for edge, following in pairwise(edges):
                if not edge.getConnections(following):
                    message = f"its route has no connection from edge {edge.getID()!r} to {following.getID()!r}"
                    problems.append(Problem(*where, message, "correct the route's edges"))
            problems += _end_problems(*where, departure, first=edges[0], last=edges[-1], routes=routes)
            kind = routes.types[departure.vehicle_type].vehicle_class
            problems += stop_problems(*where, stops=departure.stops, edges=edges, vehicle_class=kind)
        if len(problems) >= MOST_PROBLEMS:
            break
    if problems:
        raise UsageError(problems)


def _end_problems(
    file: str, key: str, departure: Departure, *, first: Edge, last: Edge, routes: RouteFile
) -> Iterator[Problem]:
    most_mps = routes.types[departure.vehicle_type].max_speed_mps
    factor = max(departure.speed_factor * _ROUNDED, 1.0) if departure.speed_factor else 1.0
    fastest_mps = min(first.getSpeed() * factor, most_mps)
    written = (departure.lane, departure.position, departure.speed)
    for end, edge, highest_mps, (lane, position, speed) in (
        ("depart", first, fastest_mps, written),
        ("arrival", last, most_mps, departure.arrival),
    ):
        lanes, length_m = edge.getLaneNumber(), edge.getLength()
        for name, value, fits, valid in (
            (f"{end}Lane", lane, number_of(lane) in range(lanes), f"a lane from 0 to {lanes - 1}"),
            (f"{end}Pos", position, abs(number_of(position)) <= length_m, f"up to {length_m:g} m, the edge's end"),
            (f"{end}Speed", speed, 0.0 <= number_of(speed) <= highest_mps, f"from 0 to {highest_mps:g} m/s"),
        ):
            if not fits and value not in _WORDS[name]:
                remedy = f"give {valid}, or {nearest(value, _WORDS[name])}"
                yield Problem(file, f"{key}.{name}", f"{value[:60]!r} is not possible here", remedy)
