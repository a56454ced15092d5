"""Opening a scene: its document, net and routes, checked against one another, as the game needs them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from pydantic import ConfigDict
from shapely.geometry.base import BaseGeometry
from sumolib.net import Net
from sumolib.net.edge import Edge
from sumolib.net.lane import Lane

from harness.config.scene import PlainFile, Player, Scene, scene_file
from harness.config.toml_reading import Document, nearest, read_document
from harness.errors import Problem, UsageError, collect
from harness.files import leads_out
from harness.game.arrays import FloatArray
from harness.game.attention import HumanFactors
from harness.game.bicycle import Actuators
from harness.game.initial_state import StartDistribution, StartRange
from harness.game.quantities import REACH_M, World
from harness.game.road import Road, Route, Routes
from harness.game.state import ROLES
from harness.traffic import network
from harness.traffic.departures import check_departures, edges_of
from harness.traffic.net_file import check_net
from harness.traffic.route_file import Departure, RouteFile, VehicleType, read_route_file
from harness.traffic.route_table import route_table

_LONGEST_ROUTE_M = 50_000.0


@dataclass(frozen=True)
class OpenScene:
    """A scene that was read whole and found in order."""

    folder: Path
    document: Scene
    world: World
    routes: RouteFile
    places: tuple[StartRange, ...]
    edges: tuple[tuple[str, ...], ...]  # each player's route from the edge it starts on
    rail_lines: tuple[FloatArray, ...]

    @property
    def net_file(self) -> Path:
        return self.folder / self.document.net

    @cached_property
    def has_background_traffic(self) -> bool:
        """Whether anyone but the players may depart."""
        players = {player.vehicle for player in self.document.players}
        return bool(self.routes.flows) or bool(set(self.routes.vehicles) - players)

    def vehicle(self, player: int) -> Departure:
        """The player's vehicle in the route file."""
        return self.routes.vehicles[self.document.players[player].vehicle]

    def departures(self, generator: np.random.Generator) -> list[Departure]:
        """Who else departs during a game; flows with a probability are drawn from the generator."""
        players = {player.vehicle for player in self.document.players}
        return self.routes.departures(players, self.document.time_limit_s, generator)

    def start_distribution(
        self,
        human_factors: Sequence[HumanFactors | Sequence[HumanFactors]],
        present_share: Sequence[float],
        shares: Sequence[Sequence[float]] | None = None,
    ) -> StartDistribution:
        """What is drawn at the start of each game, for players that attend and take part like this. A player with
        several drivers has the habits of each, and the `shares` [P][n] of the games that each has."""
        of_each = [[each] if isinstance(each, HumanFactors) else list(each) for each in human_factors]
        shares = shares or [[1.0] * len(each) for each in of_each]
        place = (self.places, self.world.length_m, of_each, shares, present_share)
        return StartDistribution(*place, self.world.steps, self.world.step_s)


class _NamedFiles(Document):
    """The files that a scene names: what is wrong with the rest of it keeps nobody from looking at them."""

    model_config = ConfigDict(extra="ignore")
    net: PlainFile
    routes: PlainFile


def open_scene(folder: Path, ego_type: str | None = None) -> OpenScene:
    """Read a scene's folder. Raises UsageError with every problem found in it.

    `ego_type`: a vehicle type of the route file that the ego's car is of, instead of the one it has there.
    """
    document_file = scene_file(folder)
    problems: list[Problem] = []
    collect(problems, lambda: _check_within(document_file, folder))
    if problems:
        raise UsageError(problems)
    document = collect(problems, lambda: read_document(document_file, Scene))
    named = document or collect([], lambda: read_document(document_file, _NamedFiles))
    if named is None:
        raise UsageError(problems)
    net_file, route_path = folder / named.net, folder / named.routes
    net = collect(problems, lambda: _checked_net(net_file, folder))
    routes = collect(problems, lambda: _checked_routes(route_path, folder, document, ego_type))
    if document is None or net is None or routes is None:
        raise UsageError(problems)
    area = network.drivable_area(net)
    opened = [
        collect(problems, lambda k=k: _open_player(document_file, document, ROLES[k], net, area, routes))  # type: ignore[misc]
        for k in range(len(ROLES))
    ]
    players = {player.vehicle for player in document.players}
    collect(problems, lambda: check_departures(players, net, routes))
    if problems or None in opened:
        raise UsageError(problems)
    places, tables, edges, types = zip(*opened, strict=True)
    lines = network.rail_lines(net, area)
    world = World(
        Road(network.rails(lines, REACH_M + 10.0), Routes.of(tables)),
        _actuators(document, types),
        np.array([each.length_m for each in types]),
        np.array([each.width_m for each in types]),
        document.step_length_s,
        document.time_limit_s,
    )
    return OpenScene(folder, document, world, routes, places, edges, tuple(lines))


def _of_type(routes: RouteFile, document: Scene | None, ego_type: str | None) -> RouteFile:
    if ego_type is None or document is None or document.ego.vehicle not in routes.vehicles:
        return routes
    if ego_type not in routes.types:
        message, remedy = f"has no vehicle type {ego_type!r} for the ego to be of", nearest(ego_type, routes.types)
        raise UsageError.of(routes.path, "vType", message, remedy)
    ego = replace(routes.vehicles[document.ego.vehicle], vehicle_type=ego_type)
    return replace(routes, vehicles={**routes.vehicles, document.ego.vehicle: ego})


def _check_within(path: Path, folder: Path) -> None:
    if leads_out(path, folder):
        raise UsageError.of(path, "", "is a link that leads out of the scene's folder", "copy there what it points to")


def _checked_net(path: Path, folder: Path) -> Net:
    _check_within(path, folder)
    check_net(path)
    return network.read_net(path)


def _checked_routes(path: Path, folder: Path, document: Scene | None, ego_type: str | None) -> RouteFile:
    _check_within(path, folder)
    return _of_type(read_route_file(path), document, ego_type)


def _open_player(
    file: Path, document: Scene, role: str, net: Net, area: BaseGeometry, routes: RouteFile
) -> tuple[StartRange, Route, tuple[str, ...], VehicleType]:
    player: Player = getattr(document, role)
    problems: list[Problem] = []
    lane = collect(problems, lambda: network.find_lane(net, file, f"{role}.lane", player.lane))
    goal = collect(problems, lambda: _goal(file, document, net))
    vehicle = collect(problems, lambda: _vehicle(file, role, player, routes))
    edges = collect(problems, lambda: edges_of(vehicle, net, routes)) if vehicle else None
    place = collect(problems, lambda: _place(file, document, role, player, lane, net)) if lane else None
    if lane is None or goal is None or vehicle is None or edges is None or place is None:
        raise UsageError(problems)
    if lane.getEdge() not in edges:
        raise UsageError.of(
            file,
            f"{role}.lane",
            f"{player.lane!r} is not on the route of vehicle {vehicle.name!r}",
            "choose a lane of one of its edges",
        )
    onward = edges[edges.index(lane.getEdge()) :]
    length_m = sum(each.getLength() for each in onward)
    if length_m > _LONGEST_ROUTE_M:
        message = f"its route is {length_m / 1e3:,.0f} km long, up to {_LONGEST_ROUTE_M / 1e3:g} km are possible"
        raise UsageError.of(routes.path, f"vehicle {vehicle.name}", message, "leave out edges")
    try:
        table = route_table(net, area, onward, goal, document.goal.position_m)
    except ValueError as error:
        raise UsageError.of(
            routes.path, f"vehicle {vehicle.name}", f"its route {error}", "mend the route's edges"
        ) from None
    kind = routes.types[vehicle.vehicle_type]
    _room_beyond_goal(file, document, table, kind)
    return place, table, tuple(edge.getID() for edge in onward), kind


def _room_beyond_goal(file: Path, document: Scene, table: Route, kind: VehicleType) -> None:
    """SUMO takes a vehicle it drives out of the traffic when its front bumper is at the end of its route: the goal,
    which the body's centre has to reach, must lie before that by half the car and the way of a step."""
    needed = 0.5 * kind.length_m + kind.max_speed_mps * document.step_length_s
    if table.length_m - table.goal_m < needed:
        nearest_end = document.goal.position_m - (needed - (table.length_m - table.goal_m))
        raise UsageError.of(
            file,
            "goal.position_m",
            f"leaves {table.length_m - table.goal_m:.1f} m of route behind the goal, {needed:.1f} m are needed",
            f"choose {max(nearest_end, 0.0):.1f} or less, or add an edge to the route",
        )


def _goal(file: Path, document: Scene, net: Net) -> Edge:
    goal = network.find_edge(net, file, "goal.edge", document.goal.edge)
    if document.goal.position_m > goal.getLength():
        raise UsageError.of(
            file,
            "goal.position_m",
            f"lies beyond the edge's end at {goal.getLength():g} m",
            "choose a smaller one",
        )
    return goal


def _vehicle(file: Path, role: str, player: Player, routes: RouteFile) -> Departure:
    if player.vehicle not in routes.vehicles:
        names = routes.vehicles or ["(the route file has no vehicle)"]
        raise UsageError.of(
            file,
            f"{role}.vehicle",
            f"{routes.path.name} has no vehicle {player.vehicle!r}",
            nearest(player.vehicle, names),
        )
    vehicle = routes.vehicles[player.vehicle]
    if vehicle.vehicle_type not in routes.types:
        raise UsageError.of(
            routes.path,
            f"vehicle {vehicle.name}.type",
            "a player's type can't be a distribution",
            "name one vType",
        )
    fastest = routes.types[vehicle.vehicle_type].max_speed_mps
    if player.speed_mps[1] > fastest:
        raise UsageError.of(
            file,
            f"{role}.speed_mps",
            f"reaches {player.speed_mps[1]:g} m/s, more than the vehicle's maxSpeed",
            f"keep it to {fastest:g} m/s",
        )
    return vehicle


def _place(file: Path, document: Scene, role: str, player: Player, lane: Lane, net: Net) -> StartRange:
    if player.beside_ego_m is None:
        reach, key = player.position_m, "position_m"
    else:
        reach, key = _beside_ego(file, document, role, player.beside_ego_m, lane, net), "beside_ego_m"
    assert reach is not None, "the document has one of the two"
    reaches = f"reaches from {reach[0]:g} to {reach[1]:g} m,"
    if reach[0] < 0.0 or reach[1] > lane.getLength():
        raise UsageError.of(
            file,
            f"{role}.{key}",
            f"{reaches} off lane {lane.getID()!r} of {lane.getLength():g} m",
            f"keep it between 0 and {lane.getLength():g} m",
        )
    goal = document.goal
    if lane.getEdge().getID() == goal.edge and reach[1] >= goal.position_m:
        raise UsageError.of(
            file, f"{role}.{key}", f"{reaches} and the goal is at {goal.position_m:g} m", "start before the goal"
        )
    line = network.lane_line(lane)
    scale = float(np.hypot(*np.diff(line, axis=0).T).sum()) / lane.getLength()
    return StartRange(line, player.beside_ego_m or reach, player.beside_ego_m is not None, player.speed_mps, scale)


def _beside_ego(
    file: Path, document: Scene, role: str, beside_m: tuple[float, float], lane: Lane, net: Net
) -> tuple[float, float]:
    """Where along its lane a player that starts beside the ego may come to start."""
    ego_lane = network.find_lane(net, file, "ego.lane", document.ego.lane)
    if ego_lane.getEdge() is not lane.getEdge():
        raise UsageError.of(
            file, f"{role}.beside_ego_m", "needs both to start on the same edge", "give position_m instead"
        )
    assert document.ego.position_m is not None, "the document says that the ego has one"
    return document.ego.position_m[0] + beside_m[0], document.ego.position_m[1] + beside_m[1]


def _actuators(document: Scene, types: Sequence[VehicleType]) -> Actuators:
    given = [player.actuators for player in document.players]
    return Actuators(
        np.array([each.max_acceleration_mps2 for each in given]),
        np.array([each.max_braking_mps2 for each in given]),
        np.array([each.max_speed_mps for each in types]),
        np.array([each.max_steering_rad for each in given]),
        np.array([each.max_steering_rate_radps for each in given]),
        np.array([each.wheelbase_m for each in given]),
        document.friction,
    )
