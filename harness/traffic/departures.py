"""Checks of the background vehicles' departures: departures that SUMO would refuse during a game are found before."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from itertools import pairwise

from sumolib.net import Net
from sumolib.net.edge import Edge

from harness.config.toml_reading import nearest
from harness.errors import Problem, UsageError, collect
from harness.game.state import ROLES
from harness.traffic import network
from harness.traffic.route_file import Departure, RouteFile
from harness.traffic.xml_file import number_of

LANES = ("random", "free", "allowed", "best", "first")
POSITIONS = ("random", "free", "random_free", "base", "last")
SPEEDS = ("random", "max", "desired", "speedLimit", "last", "avg")


def edges_of(departure: Departure, net: Net, routes: RouteFile) -> list[Edge]:
    """The edges of a vehicle's route. Raises UsageError for edges that the net does not have."""
    key = f"vehicle {departure.name}"
    problems: list[Problem] = []
    edges = {
        name: collect(problems, partial(network.find_edge, net, routes.path, key, name))
        for name in dict.fromkeys(departure.edges)
    }
    if problems:
        raise UsageError(problems)
    return [edges[name] for name in departure.edges]


def background_departures(routes: RouteFile, players: Iterable[str]) -> list[Departure]:
    """The departures of all vehicles but the players. A flow is represented by one of its vehicles."""
    players = set(players)
    vehicles = [each for name, each in routes.vehicles.items() if name not in players]
    return [*vehicles, *(flow.departure for flow in routes.flows)]


def check_departures(players: set[str], net: Net, routes: RouteFile) -> None:
    """Raise UsageError for background vehicles that SUMO would refuse during a game."""
    problems: list[Problem] = []
    for departure in background_departures(routes, players):
        where = (str(routes.path), f"vehicle {departure.name}")
        if departure.name in ROLES and players <= routes.vehicles.keys():
            problems.append(Problem(*where, "has the name of a player, but is not the player's vehicle", "rename it"))
        edges = collect(problems, partial(edges_of, departure, net, routes))
        if edges:
            problems += [Problem(*where, *each) for each in _gaps(edges)]
            problems += _departure_problems(*where, departure, edge=edges[0], routes=routes)
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


def _departure_problems(file: str, key: str, departure: Departure, *, edge: Edge, routes: RouteFile) -> list[Problem]:
    """The problems of a departure's lane, position and speed on its first edge."""
    lanes, length = edge.getLaneNumber(), edge.getLength()
    kind = routes.types.get(departure.vehicle_type)
    fastest = min(edge.getSpeed(), kind.max_speed_mps if kind else edge.getSpeed())
    values = (
        ("departLane", departure.lane, LANES, lambda lane: lane in range(lanes), f"a lane from 0 to {lanes - 1}"),
        ("departPos", departure.position, POSITIONS, lambda m: abs(m) <= length, f"up to {length:g} m, the edge's end"),
        ("departSpeed", departure.speed, SPEEDS, lambda mps: 0.0 <= mps <= fastest, f"from 0 to {fastest:g} m/s"),
    )
    return [
        Problem(
            file, f"{key}.{name}", f"{value[:60]!r} is not possible here", f"give {valid}, or {nearest(value, words)}"
        )
        for name, value, words, fits, valid in values
        if not _possible(value, words, fits)
    ]


def _possible(value: str, words: Sequence[str], fits: Callable[[float], bool]) -> bool:
    return value in words or fits(number_of(value))
