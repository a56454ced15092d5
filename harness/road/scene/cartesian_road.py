"""The road around each player's route, as a planner gets it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias

import numpy as np

from harness.config.scene import Scene
from harness.game.arrays import FloatArray, IntArray
from harness.game.cartesian_view import CartesianRoad
from harness.game.road import SPACING_M
from harness.game.world import World
from harness.road.net.lane_map import lane_map, lanes_on_route, signals_on_route
from harness.road.net.network import read_net
from harness.road.net.route_table import without_extensions
from harness.road.scene.open_player import lane_route

CartesianRoads: TypeAlias = tuple[CartesianRoad, ...]
"""[P] the road of each player."""


def cartesian_roads(
    net_file: Path, document: Scene, world: World, *, edges: Sequence[Sequence[str]], rail_lines: Sequence[FloatArray]
) -> CartesianRoads:
    """The roads of the players of an open scene, whose routes have these edges [P]."""
    net = read_net(net_file)
    routes = [[net.getEdge(name) for name in names] for names in edges]
    lanes = lane_map(net, list(dict.fromkeys(edge for route in routes for edge in route)))
    lines, links = world.right_of_way.stop_lines, world.right_of_way.signal_links
    roads = []
    for player, route in enumerate(routes):
        on_foot, rows = document.players[player].on_foot, signal_lines(world, player)
        line, goal_m = route_line_of(world, player), float(world.road.routes.goal_m[player])
        along_m = SPACING_M * np.arange(len(line))
        roads.append(
            CartesianRoad(
                net_file=str(net_file.resolve()),
                lanes=lanes,
                rails=() if on_foot else tuple(rail_lines),
                route_edges=() if on_foot else tuple(edges[player]),
                route_lanes=() if on_foot else lanes_on_route(net, lane_route(net, document.players[player], route)),
                route_line=line,
                goal_m=goal_m,
                goal_x_m=float(np.interp(goal_m, along_m, line[:, 0])),
                goal_y_m=float(np.interp(goal_m, along_m, line[:, 1])),
                signals=signals_on_route(net, [links[k] for k in lines.link[rows]], lines.station_m[rows].tolist()),
            )
        )
    return tuple(roads)


def route_line_of(world: World, player: int) -> FloatArray:
    """[n, 2] the points of a player's route in its table, without the straight extensions before and after it."""
    table = world.road.routes
    rows = slice(table.first_row[player], table.last_row[player] + 1)
    return without_extensions(table.x_m[rows], table.y_m[rows])


def signal_lines(world: World, player: int) -> IntArray:
    """[n] the rows of a player's stop lines that have a signal."""
    lines = world.right_of_way.stop_lines
    return np.flatnonzero((lines.player == player) & (lines.link >= 0))
