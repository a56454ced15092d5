"""Checks of the background vehicles' departures: departures that SUMO would refuse during a game are found before."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from itertools import pairwise
from math import inf

from sumolib.net import Net
from sumolib.net.edge import Edge

from harness.config.toml_reading import nearest
from harness.errors import Problem, UsageError, collect
from harness.game.roles import ROLES
from harness.road.demand.route_file import Departure, RouteFile
from harness.road.demand.stops import stop_problems
from harness.road.demand.walks import unsafe_net, walk_problems
from harness.road.net import network
from harness.road.xml.xml_file import number_of

LANES = ("random", "free", "allowed", "best", "first")
POSITIONS = ("random", "free", "random_free", "base", "last")
SPEEDS = ("random", "max", "desired", "speedLimit", "last", "avg")
ARRIVAL_LANES = ("current", "random", "first")
ARRIVAL_POSITIONS = ("random", "max", "center")
ARRIVAL_SPEEDS = ("current",)
_MOST_PROBLEMS = 20
_ROUNDED = 1.001  # recorded speeds and speed factors are rounded; SUMO raises the factor
_ALL_THE_TIME_S = (0.0, inf)


def edges_of(departure: Departure, net: Net, routes: RouteFile) -> list[Edge]:
    """The edges of a vehicle's route. Raises UsageError for edges that the net does not have."""
    key = f"{'person' if departure.on_foot else 'vehicle'} {departure.name}"
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
        where = (str(routes.path), f"{'person' if departure.on_foot else 'vehicle'} {departure.name}")
        if departure.name in roles and players <= routes.vehicles.keys():
            problems.append(Problem(*where, "has the name of a player, but is not the player's vehicle", "rename it"))
        edges = collect(problems, partial(edges_of, departure, net, routes))
        if edges and departure.on_foot:
            problems += [Problem(*where, *each) for each in walk_problems(departure, edges)]
        elif edges:
            problems += [Problem(*where, *each) for each in _gaps(edges)]
            problems += _end_problems(*where, departure, first=edges[0], last=edges[-1], routes=routes)
            kind = routes.types[departure.vehicle_type].vehicle_class
            problems += stop_problems(*where, stops=departure.stops, edges=edges, vehicle_class=kind)
        if len(problems) >= _MOST_PROBLEMS:
            break
    if problems:
        raise UsageError(problems)


def _gaps(edges: Sequence[Edge]) -> list[tuple[str, str]]:
    """Message and remedy for each two consecutive edges without a connection."""
    return [
        (
            f"its route has no connection from edge {edge.getID()!r} to {following.getID()!r}",
            "correct the route's edges",
        )
        for edge, following in pairwise(edges)
        if not edge.getConnections(following)
    ]


def _end_problems(
    file: str, key: str, departure: Departure, *, first: Edge, last: Edge, routes: RouteFile
) -> list[Problem]:
    """The problems of a departure's lane, position and speed on its first edge, and on arrival on its last edge."""
    most_mps = routes.types[departure.vehicle_type].max_speed_mps
    factor = max(departure.speed_factor * _ROUNDED, 1.0) if departure.speed_factor else 1.0
    written = (departure.lane, departure.position, departure.speed)
    checks = [
        *_checks(
            "depart",
            first,
            fastest=min(first.getSpeed() * factor, most_mps),
            written=written,
            words=(LANES, POSITIONS, SPEEDS),
        ),
        *_checks(
            "arrival",
            last,
            fastest=most_mps,
            written=departure.arrival,
            words=(ARRIVAL_LANES, ARRIVAL_POSITIONS, ARRIVAL_SPEEDS),
        ),
    ]
    return [
        Problem(
            file, f"{key}.{name}", f"{value[:60]!r} is not possible here", f"give {valid}, or {nearest(value, words)}"
        )
        for name, value, words, fits, valid in checks
        if value not in words and not fits(number_of(value))
    ]


_Check = tuple[str, str, Sequence[str], Callable[[float], bool], str]


def _checks(
    prefix: str, edge: Edge, *, fastest: float, written: Sequence[str], words: Sequence[Sequence[str]]
) -> list[_Check]:
    """For lane, position and speed: attribute, value, words, whether a number is possible, and which ones are."""
    lanes, length = edge.getLaneNumber(), edge.getLength()
    possible: Sequence[tuple[str, Callable[[float], bool], str]] = (
        ("Lane", lambda lane: lane in range(lanes), f"a lane from 0 to {lanes - 1}"),
        ("Pos", lambda m: abs(m) <= length, f"up to {length:g} m, the edge's end"),
        ("Speed", lambda mps: 0.0 <= mps <= fastest, f"from 0 to {fastest:g} m/s"),
    )
    return [
        (prefix + name, value, several, fits, valid)
        for (name, fits, valid), value, several in zip(possible, written, words, strict=True)
    ]
