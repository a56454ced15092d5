"""A player of a scene: its route and its vehicle type, checked against net, routes and goal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from shapely.geometry.base import BaseGeometry
from sumolib.net import Net
from sumolib.net.edge import Edge
from sumolib.net.lane import Lane

from harness.config.road_user import CYCLING
from harness.config.scene import Player, Scene
from harness.config.toml_reading import nearest
from harness.errors import Problem, UsageError, collect
from harness.game.bicycle import ActuatorLimits
from harness.game.road import Route
from harness.road.demand.departures import edges_of
from harness.road.demand.route_file import Departure, RouteFile, VehicleType
from harness.road.net import network
from harness.road.net.lane_route import LaneRoute
from harness.road.net.own_lanes import bicycle_lanes, lanes_for
from harness.road.net.route_table import route_table
from harness.road.scene.scene_files import SceneFiles

_LONGEST_ROUTE_M = 50_000.0
_CYCLING_CLASSES = ("bicycle", "scooter")


@dataclass(frozen=True, kw_only=True)
class OpenPlayer:
    route: Route
    edges: tuple[str, ...]  # the route, from the start edge on
    vehicle_type: VehicleType


def open_player(role: str, files: SceneFiles, area: BaseGeometry) -> OpenPlayer:
    """The player of a name (`Scene.roles`) who is not on foot. Raises UsageError with every problem found.

    `area` is the net's drivable area.
    """
    file, document, net, routes = files.file, files.document, files.net, files.routes
    player: Player = document.player(role)
    problems: list[Problem] = []
    lane = player.lane and collect(problems, lambda: network.find_lane(net, file, f"{role}.lane", str(player.lane)))
    goal = collect(problems, lambda: _goal(file, document, player, net))
    vehicle = collect(problems, lambda: _vehicle(file, role, player, routes))
    edges = collect(problems, lambda: edges_of(vehicle, net, routes)) if vehicle else None
    if problems or goal is None or vehicle is None or edges is None:
        raise UsageError(problems)
    if isinstance(lane, Lane):
        if lane.getEdge() not in edges:
            message = f"{player.lane!r} is not on the route of vehicle {vehicle.name!r}"
            raise UsageError.of(file, f"{role}.lane", message, "choose a lane of one of its edges")
        edges = edges[edges.index(lane.getEdge()) :]
    if goal not in edges:
        key, each = document.goal_of(player)
        on_route = f"is not on the route of vehicle {vehicle.name!r} in {routes.path.name}, after its start"
        names = ", ".join(edge.getID() for edge in edges[-3:])
        remedy = f"choose one of its edges (it ends with {names}), or give {role} a goal"
        raise UsageError.of(file, f"{key}.edge", f"edge {each.edge!r} {on_route}", remedy)
    length_m = sum(each.getLength() for each in edges)
    key = vehicle.key
    if length_m > _LONGEST_ROUTE_M:
        message = f"its route is {length_m / 1e3:,.0f} km long, up to {_LONGEST_ROUTE_M / 1e3:g} km are possible"
        raise UsageError.of(routes.path, key, message, "remove edges from the route")
    _check_kind(routes, player, vehicle, edges)
    goal_position_m = document.goal_of(player)[1].position_m
    try:
        route = route_table(net, area, lane_route(net, player, edges), goal=goal, goal_position_m=goal_position_m)
    except ValueError as error:
        raise UsageError.of(routes.path, key, f"its route {error}", "correct the route's edges") from None
    vehicle_type = routes.types[vehicle.vehicle_type]
    _check_room_beyond_goal(file, document, player=player, route=route, vehicle_type=vehicle_type)
    return OpenPlayer(route=route, edges=tuple(edge.getID() for edge in edges), vehicle_type=vehicle_type)


def lane_route(net: Net, player: Player, edges: Sequence[Edge]) -> LaneRoute:
    """The lanes of a player's route along edges, from its start on."""
    start = net.getLane(player.lane) if player.lane else None
    return LaneRoute(edges, lanes_of=lanes_for(player.kind), start=start)


def _check_kind(routes: RouteFile, player: Player, vehicle: Departure, edges: Sequence[Edge]) -> None:
    if player.kind not in CYCLING:
        return
    key, type_name = vehicle.key, vehicle.vehicle_type
    vehicle_class = routes.types[type_name].vehicle_class
    if vehicle_class not in _CYCLING_CLASSES:
        message = f"has vClass {vehicle_class!r}, and the scene's player is a {player.kind}"
        raise UsageError.of(routes.path, f"vType {type_name}", message, 'give it vClass="bicycle"')
    for edge in edges:
        if not bicycle_lanes(edge):
            message = f"its route passes edge {edge.getID()!r}, which forbids bicycles"
            raise UsageError.of(routes.path, key, message, "choose another route, or allow them on a lane of it")


def _check_room_beyond_goal(
    file: Path, document: Scene, *, player: Player, route: Route, vehicle_type: VehicleType
) -> None:
    """Raise UsageError if the goal is too near to the end of the route.

    SUMO removes a vehicle when its front bumper reaches the end of its route. The body's centre reaches the goal
    before that only if the goal is at least half a car and the distance of one step before the end.
    """
    needed_m = 0.5 * vehicle_type.length_m + vehicle_type.max_speed_mps * document.step_length_s
    room_m = route.length_m - route.goal_m
    if room_m < needed_m:
        key, goal = document.goal_of(player)
        latest_m = max(goal.position_m - (needed_m - room_m), 0.0)
        message = f"leaves {room_m:.1f} m of route behind the goal, {needed_m:.1f} m are needed"
        raise UsageError.of(
            file, f"{key}.position_m", message, f"choose {latest_m:.1f} or less, or add an edge to the route"
        )


def _goal(file: Path, document: Scene, player: Player, net: Net) -> Edge:
    key, goal = document.goal_of(player)
    edge = network.find_edge(net, file, f"{key}.edge", goal.edge)
    if goal.position_m > edge.getLength():
        message = f"lies beyond the edge's end at {edge.getLength():g} m"
        raise UsageError.of(file, f"{key}.position_m", message, "choose a smaller one")
    return edge


def _vehicle(file: Path, role: str, player: Player, routes: RouteFile) -> Departure:
    if player.vehicle not in routes.vehicles:
        names = routes.vehicles or ["(the route file has no vehicle)"]
        message = f"{routes.path.name} has no vehicle {player.vehicle!r}"
        raise UsageError.of(file, f"{role}.vehicle", message, nearest(player.vehicle, names))
    vehicle = routes.vehicles[player.vehicle]
    if vehicle.on_foot:
        message = f"{player.vehicle!r} is a person"
        raise UsageError.of(file, f"{role}.vehicle", message, 'give kind = "pedestrian" and its way, or a vehicle')
    if vehicle.vehicle_type not in routes.types:
        message = "a player's type can't be a distribution"
        raise UsageError.of(routes.path, f"{vehicle.key}.type", message, "name one vType")
    if vehicle.choices:
        message = "a player's route can't be drawn from a distribution"
        raise UsageError.of(routes.path, vehicle.key, message, "give it one route")
    fastest_mps = routes.types[vehicle.vehicle_type].max_speed_mps
    if player.speed_mps[1] > fastest_mps:
        message = f"reaches {player.speed_mps[1]:g} m/s, more than the vehicle's maxSpeed"
        raise UsageError.of(file, f"{role}.speed_mps", message, f"keep it to {fastest_mps:g} m/s")
    return vehicle


def actuator_limits(document: Scene, types: Sequence[VehicleType]) -> ActuatorLimits:
    """What the players' bodies can do, [P]; `types` are those of their vehicles."""
    limits = [player.actuators.with_defaults_of(player.kind) for player in document.players]
    columns = {name: np.array([getattr(each, name) for each in limits]) for name in type(limits[0]).model_fields}
    max_speed_mps = np.array([each.max_speed_mps for each in types])
    return ActuatorLimits(**columns, max_speed_mps=max_speed_mps, friction=document.friction)
