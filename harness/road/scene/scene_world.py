"""From the files of a scene to the world of its games: its players, their starts, and their rules."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from shapely.geometry.base import BaseGeometry
from sumolib.net.edge import Edge

from harness.errors import Problem, UsageError, collect
from harness.game.arrays import FloatArray
from harness.game.placed_obstacles import Obstacles
from harness.game.road import Road, Routes
from harness.game.start_range import StartRange
from harness.game.world import World
from harness.road.demand.departures import background_departures, check_departures, edges_of
from harness.road.net.lane_route import LaneRoute
from harness.road.net.levels import check_one_level
from harness.road.net.network import rails
from harness.road.net.right_of_way_table import right_of_way
from harness.road.net.walker_conflicts import with_walkers_conflicts
from harness.road.scene.footway import Ground, open_walker
from harness.road.scene.open_obstacles import hiding_in
from harness.road.scene.open_player import OpenPlayer, actuator_limits, lane_route, open_player
from harness.road.scene.scene_files import SceneFiles
from harness.road.scene.start_ranges import start_range


def edges_of_players(files: SceneFiles) -> list[Edge]:
    """The edges of the players' routes, each once; those of invalid routes are left out."""
    routes = files.routes
    vehicles = [routes.vehicles[name] for name in files.document.vehicles if name in routes.vehicles]
    found = [collect([], partial(edges_of, each, files.net, routes)) or [] for each in vehicles]
    return list(dict.fromkeys(edge for edges in found for edge in edges))


def edges_in_use(files: SceneFiles, own: Sequence[Edge]) -> list[Edge]:
    """The edges `own` of the players' routes, and the whole routes of the background traffic."""
    departures = background_departures(files.routes, files.document.vehicles)
    return [*own, *map(files.net.getEdge, sorted({name for each in departures for name in each.edges}))]


def opened_players(
    files: SceneFiles, own: Sequence[Edge], area: BaseGeometry, ground: Ground | None
) -> list[OpenPlayer]:
    """The players, checked together with the roads and the background traffic. Raises UsageError with every problem.

    `own` are the edges of the players' routes, `area` is the net's drivable area.
    """
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


def start_places(files: SceneFiles, players: Sequence[OpenPlayer]) -> tuple[StartRange, ...]:
    """The ranges of the players' starts. Raises UsageError with every problem found."""
    problems: list[Problem] = []
    start_of = partial(start_range, files=files, ego_route=players[0].route)
    starts = [
        collect(problems, partial(start_of, role, route=player.route))
        for role, player in zip(files.document.roles, players, strict=True)
    ]
    if problems:
        raise UsageError(problems)
    return tuple(start for start in starts if start is not None)


def world_of(
    files: SceneFiles,
    players: Sequence[OpenPlayer],
    *,
    rail_lines: Sequence[FloatArray],
    ground: Ground | None,
    obstacles: Obstacles,
) -> World:
    """The world of a scene's games; `rail_lines` are those of the roads."""
    document, net = files.document, files.net
    routes, types = [player.route for player in players], [player.vehicle_type for player in players]
    lanes = [
        LaneRoute([]) if each.on_foot else lane_route(net, each, [net.getEdge(name) for name in player.edges])
        for player, each in zip(players, document.players, strict=True)
    ]
    rules = right_of_way(net, lanes)
    radius_m = max(0.5 * float(np.hypot(each.length_m, each.width_m)) for each in types)
    return World(
        road=Road(
            rails(rail_lines, radius_m),
            Routes.of(routes),
            None if ground is None else rails(ground.rail_lines, radius_m),
            None if ground is None else ground.raster,
        ),
        actuators=actuator_limits(document, types),
        length_m=np.array([each.length_m for each in types]),
        width_m=np.array([each.width_m for each in types]),
        step_s=document.step_length_s,
        time_limit_s=document.time_limit_s,
        right_of_way=rules if ground is None else with_walkers_conflicts(rules, net, routes, ground.ways),
        walks=np.array([player.on_foot for player in document.players]),
        hiding=hiding_in(obstacles, files.routes, document),
    )
