"""From the files of a scene to the world of its games: roads, players, their starts and what stands beside them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from shapely.geometry.base import BaseGeometry
from sumolib.net.edge import Edge

from harness.errors import Problem, UsageError, collect
from harness.game.arrays import FloatArray
from harness.game.junctions import RightOfWay
from harness.game.placed_obstacles import Obstacles
from harness.game.quantities import REACH_M
from harness.game.road import Road, Routes
from harness.game.start_range import StartRange
from harness.game.world import World
from harness.road.demand.departures import check_departures, edges_of
from harness.road.net import network
from harness.road.net.levels import check_one_level
from harness.road.net.own_lanes import lanes_for
from harness.road.net.right_of_way_table import right_of_way
from harness.road.net.walker_conflicts import WalkersWay, ways_of, with_walkers_conflicts
from harness.road.scene.footway import Ground, open_walker, opened_ground
from harness.road.scene.open_obstacles import hiding_in, open_obstacles
from harness.road.scene.open_player import OpenPlayer, actuator_limits, open_player
from harness.road.scene.scene_files import SceneFiles
from harness.road.scene.start_ranges import start_range


@dataclass(frozen=True, kw_only=True)
class SceneWorld:
    """What a scene's files amount to."""

    own: Sequence[Edge]
    """The edges of the players' routes, each once."""
    area: BaseGeometry
    """The drivable area."""
    rail_lines: tuple[FloatArray, ...]
    players: Sequence[OpenPlayer]
    places: tuple[StartRange, ...]
    obstacles: Obstacles
    ways: Sequence[WalkersWay]
    """Those of the players on foot."""
    world: World


def world_of(files: SceneFiles) -> SceneWorld:
    """The world of a scene. Raises UsageError with every problem found."""
    net = files.net
    own = _edges_of_players(files)
    area = network.drivable_area(net, own)
    ground = opened_ground(files.document, net, area)
    players = _players(files, own, area, ground)
    places = _places(files, players)
    routes = [player.route for player in players]
    obstacles = open_obstacles(files, area, routes)
    lines = tuple(network.rail_lines(net, area, own))
    road = Road(
        network.rails(lines, REACH_M + 10.0),
        Routes.of(routes),
        None if ground is None else network.rails(ground.rail_lines, REACH_M + 10.0),
        None if ground is None else ground.raster,
    )
    ways = ways_of(files.document, net)
    return SceneWorld(
        own=own,
        area=area,
        rail_lines=lines,
        players=players,
        places=places,
        obstacles=obstacles,
        ways=ways,
        world=_world(files, players, road=road, rules=_right_of_way(files, ways, players), obstacles=obstacles),
    )


def _edges_of_players(files: SceneFiles) -> list[Edge]:
    """The edges of the players' routes, each once; those of invalid routes are left out."""
    routes = files.routes
    vehicles = [routes.vehicles[name] for name in files.document.vehicles if name in routes.vehicles]
    found = [collect([], partial(edges_of, each, files.net, routes)) or [] for each in vehicles]
    return list(dict.fromkeys(edge for edges in found for edge in edges))


def _players(files: SceneFiles, own: Sequence[Edge], area: BaseGeometry, ground: Ground | None) -> Sequence[OpenPlayer]:
    """The players, checked together with the roads and the background traffic."""
    problems: list[Problem] = []
    document = files.document
    collect(problems, partial(check_one_level, files.file, own))
    opened = [
        collect(problems, partial(open_walker, role, files, ground))
        if player.on_foot
        else collect(problems, partial(open_player, role, files, area))
        for role, player in zip(document.roles, document.players, strict=True)
    ]
    vehicles, window_s = set(document.vehicles), document.traffic_window_s
    collect(
        problems, partial(check_departures, vehicles, files.net, files.routes, window_s=window_s, roles=document.roles)
    )
    if problems:
        raise UsageError(problems)
    return [player for player in opened if player is not None]


def _places(files: SceneFiles, players: Sequence[OpenPlayer]) -> tuple[StartRange, ...]:
    """The ranges of the players' starts."""
    problems: list[Problem] = []
    start_of = partial(start_range, files=files, ego_route=players[0].route)
    starts = [
        collect(problems, partial(start_of, role, route=player.route))
        for role, player in zip(files.document.roles, players, strict=True)
    ]
    if problems:
        raise UsageError(problems)
    return tuple(start for start in starts if start is not None)


def _right_of_way(files: SceneFiles, ways: Sequence[WalkersWay], players: Sequence[OpenPlayer]) -> RightOfWay:
    net, walkers = files.net, {way.player for way in ways}
    routes = [[] if k in walkers else [net.getEdge(name) for name in player.edges] for k, player in enumerate(players)]
    table = right_of_way(net, routes, [lanes_for(player.kind) for player in files.document.players])
    return with_walkers_conflicts(table, net, [player.route for player in players], ways)


def _world(
    files: SceneFiles, players: Sequence[OpenPlayer], *, road: Road, rules: RightOfWay, obstacles: Obstacles
) -> World:
    document = files.document
    types = [player.vehicle_type for player in players]
    walking = tuple(player.on_foot for player in document.players)
    return World(
        road=road,
        actuators=actuator_limits(document, types),
        length_m=np.array([each.length_m for each in types]),
        width_m=np.array([each.width_m for each in types]),
        step_s=document.step_length_s,
        time_limit_s=document.time_limit_s,
        right_of_way=rules,
        on_foot=walking if any(walking) else (),
        hiding=hiding_in(obstacles, files.routes, document),
    )
