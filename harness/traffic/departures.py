"""Whether those whom SUMO drives can depart: what SUMO would refuse in the middle of a game is found before."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from typing import TypeVar

from sumolib.net import Net
from sumolib.net.edge import Edge

from harness.config.toml_reading import nearest
from harness.errors import Problem, UsageError, collect
from harness.game.state import ROLES
from harness.traffic import network
from harness.traffic.route_file import Departure, RouteFile
from harness.traffic.xml_file import number_of

T = TypeVar("T")

LANES = ("random", "free", "allowed", "best", "first")
POSITIONS = ("random", "free", "random_free", "base", "last")
SPEEDS = ("random", "max", "desired", "speedLimit", "last", "avg")


def edges_of(departure: Departure, net: Net, routes: RouteFile) -> list[Edge]:
    """The edges of a vehicle's route. Raises UsageError for those that the net has not."""
    key = f"vehicle {departure.name}"
    problems: list[Problem] = []
    found = [
        collect(problems, lambda name=name: network.find_edge(net, routes.path, key, name))  # type: ignore[misc]
        for name in dict.fromkeys(departure.edges)
    ]
    if problems:
        raise UsageError(problems)
    by_name = {edge.getID(): edge for edge in found if edge is not None}
    return [by_name[name] for name in departure.edges]


def others_of(routes: RouteFile, players: Iterable[str]) -> list[Departure]:
    """Those whom SUMO drives: a flow as one of its vehicles."""
    players = set(players)
    vehicles = [each for name, each in routes.vehicles.items() if name not in players]
    return [*vehicles, *(flow.departure for flow in routes.flows)]


def check_departures(players: set[str], net: Net, routes: RouteFile) -> None:
    """Raise UsageError for what SUMO would refuse of the others in the middle of a game."""
    problems: list[Problem] = []
    for other in others_of(routes, players):
        where = (str(routes.path), f"vehicle {other.name}")
        if other.name in ROLES and players <= routes.vehicles.keys():
            problems.append(Problem(*where, "has a player's name without being it", "call it something else"))
        edges = collect(problems, lambda other=other: edges_of(other, net, routes))  # type: ignore[misc]
        if edges:
            problems += [Problem(*where, *each) for each in _not_connected(edges)]
            problems += _of_start(*where, other, edges[0], routes)
    if problems:
        raise UsageError(problems)


def _not_connected(edges: Sequence[Edge]) -> list[tuple[str, str]]:
    return [
        (
            f"its route has no connection from edge {edge.getID()!r} to {following.getID()!r}",
            "mend the route's edges",
        )
        for edge, following in pairwise(edges)
        if not edge.getConnections(following)
    ]


def _of_start(file: str, key: str, other: Departure, edge: Edge, routes: RouteFile) -> list[Problem]:
    lanes, length = edge.getLaneNumber(), edge.getLength()
    kind = routes.types.get(other.vehicle_type)
    fastest = min(edge.getSpeed(), kind.max_speed_mps if kind else edge.getSpeed())
    found = (
        ("departLane", other.lane, LANES, lambda lane: lane in range(lanes), f"a lane from 0 to {lanes - 1}"),
        ("departPos", other.position, POSITIONS, lambda m: abs(m) <= length, f"up to {length:g} m, the edge's end"),
        ("departSpeed", other.speed, SPEEDS, lambda mps: 0.0 <= mps <= fastest, f"from 0 to {fastest:g} m/s"),
    )
    return [
        Problem(
            file, f"{key}.{name}", f"{given[:60]!r} is not possible here", f"give {what}, or {nearest(given, words)}"
        )
        for name, given, words, fits, what in found
        if not _possible(given, words, fits)
    ]


def _possible(given: str, words: Sequence[str], fits: Callable[[float], bool]) -> bool:
    return given in words or fits(number_of(given))
