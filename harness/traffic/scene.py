"""Opening a scene: its document, net and routes, checked against one another, in the form that the game uses."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path

import numpy as np
import shapely
from sumolib.net import Net
from sumolib.net.edge import Edge

from harness.config.scene import Scene, scene_file
from harness.config.toml_reading import read_document
from harness.errors import Problem, UsageError, collect
from harness.game.arrays import FloatArray
from harness.game.attention import HumanFactors
from harness.game.bicycle import Actuators
from harness.game.initial_state import Conditions, StartDistribution
from harness.game.obstacles import NO_OBSTACLES, Obstacles
from harness.game.quantities import REACH_M
from harness.game.right_of_way import RightOfWay
from harness.game.road import Road, Routes
from harness.game.seeding import between
from harness.game.start_range import StartRange
from harness.game.world import World
from harness.shipped_documents import named_document
from harness.traffic import network
from harness.traffic.blocked_lanes import LaneStrip, strips_near
from harness.traffic.departures import background_departures, check_departures, edges_of
from harness.traffic.footway import open_walker, opened_ground, with_walkers
from harness.traffic.levels import check_one_level, heights_of_players_roads
from harness.traffic.obstacles import check_clear_starts, hiding_in, open_obstacles, with_types
from harness.traffic.player import OpenPlayer, open_player
from harness.traffic.right_of_way import right_of_way
from harness.traffic.route_file import Departure, RouteFile, VehicleType
from harness.traffic.scene_files import NamedFiles, check_within, checked_net, checked_routes
from harness.traffic.start_overlaps import check_starts, start_warnings
from harness.traffic.start_ranges import start_range
from harness.traffic.trips import with_routes
from harness.traffic.users_lanes import lanes_for
from harness.traffic.walker_conflicts import Way, ways_of, with_walkers_conflicts
from harness.traffic.warm_up import Snapshot, snapshots
from harness.traffic.zebra import stripes


@dataclass(frozen=True, kw_only=True)
class OpenScene:
    """A scene that was read completely and has no problems.

    >>> import harness
    >>> scene = harness.open_scene("merge")
    >>> scene.world.roles, scene.world.step_s
    (('ego', 'non_ego'), 0.1)
    """

    folder: Path
    document: Scene
    world: World
    routes: RouteFile
    places: tuple[StartRange, ...]
    edges: tuple[tuple[str, ...], ...]  # each player's route, from its start edge on
    rail_lines: tuple[FloatArray, ...]
    junctions: frozenset[str] | None = None  # those that games need; None: all of the net
    obstacles: Obstacles = NO_OBSTACLES
    lane_strips: tuple[LaneStrip, ...] = ()  # lanes that an obstacle may block
    stripes: tuple[FloatArray, ...] = ()  # [5, 2] each, of the marked crossings
    roads_m: FloatArray | None = None  # [n, 3] points of the players' roads; None: no other road passes over or under

    @property
    def net_file(self) -> Path:
        """The scene's net."""
        return self.folder / self.document.net

    @property
    def route_files(self) -> list[Path]:
        """The scene's route file and additional files."""
        return [self.folder / each for each in (self.document.routes, *self.document.additional)]

    @cached_property
    def has_background_traffic(self) -> bool:
        """Whether vehicles other than the players may depart."""
        players = set(self.document.vehicles)
        return bool(self.routes.flows) or bool(set(self.routes.vehicles) - players)

    @cached_property
    def warm_up(self) -> tuple[Snapshot, ...]:
        """The background traffic with which games begin. Raises SimulationError if SUMO fails."""
        return snapshots(self.document, self.routes, self.net_file)

    def vehicle(self, player: int) -> Departure:
        """A player's vehicle in the route file."""
        return self.routes.vehicles[self.document.vehicles[player]]

    def departures(self, generator: np.random.Generator) -> list[Departure]:
        """The background vehicles that depart during a game. What is random about them is drawn from the generator."""
        if not self.has_background_traffic:
            return []
        players = set(self.document.vehicles)
        begin_s, end_s = self.document.game_window_s
        varied = self.document.varies.traffic_density
        density = 1.0 if varied is None else between(varied, generator.random())
        on_road: tuple[Departure, ...] = ()
        if self.document.warm_up_s:
            snapshot = self.warm_up[generator.integers(len(self.warm_up))]
            density, on_road = snapshot.density, snapshot.vehicles
        return [*on_road, *self.routes.departures(players, end_s, generator, begin_s, density)]

    @property
    def usual_starts(self) -> StartDistribution:
        """The distribution of initial states of attentive players, who all take part."""
        players = len(self.places)
        return self.start_distribution([HumanFactors()] * players, [1.0] * players)

    @property
    def warnings(self) -> list[str]:
        """What is no mistake but makes games void: a sentence for each two players who may start in one another."""
        return start_warnings(self.usual_starts, self.world)

    def start_distribution(
        self,
        human_factors: Sequence[HumanFactors | Sequence[HumanFactors]],
        present_share: Sequence[float],
        shares: Sequence[Sequence[float]] | None = None,
        along_route_share: float = 0.0,
    ) -> StartDistribution:
        """The distribution of initial states for players with these human factors and probabilities of taking part.

        A player with several drivers has the human factors of each, and the `shares` [P][n] of the games of each. In
        `along_route_share` of the games, players start anywhere along their routes.
        """
        factors_of = [[each] if isinstance(each, HumanFactors) else list(each) for each in human_factors]
        return StartDistribution(
            places=self.places,
            length_m=self.world.length_m,
            max_speed_mps=self.world.actuators.max_speed_mps,
            human_factors=factors_of,
            shares=shares or [[1.0] * len(each) for each in factors_of],
            present_share=present_share,
            steps=self.world.steps,
            step_s=self.world.step_s,
            routes=self.world.road.routes,
            conditions=_conditions(self.document),
            along_route_share=along_route_share,
            obstacles=self.obstacles,
        )


def open_scene(folder: str | Path, ego_type: str | None = None) -> OpenScene:
    """Read a scene's folder. Raises UsageError with every problem found in it.

    A text may also be the name of a shipped scene. `ego_type` is a vehicle type of the route file that replaces the
    type of the ego's vehicle.

    >>> open_scene("merge").document.name
    'merge'
    """
    folder = named_document(folder, "networks") if isinstance(folder, str) else folder
    document_file = scene_file(folder)
    problems: list[Problem] = []
    collect(problems, lambda: check_within(document_file, folder))
    if problems:
        raise UsageError(problems)
    document = collect(problems, lambda: read_document(document_file, Scene))
    named = document or collect([], lambda: read_document(document_file, NamedFiles))
    if named is None:
        raise UsageError(problems)
    net_file, route_files = folder / named.net, [folder / each for each in (named.routes, *named.additional)]
    net = collect(problems, lambda: checked_net(net_file, folder))
    routes = collect(problems, lambda: checked_routes(route_files, folder, document, ego_type))
    if document is None or net is None or routes is None:
        raise UsageError(problems)
    routes = collect(problems, partial(_with_routes, routes, net_file, net, document))
    if routes is None:
        raise UsageError(problems)
    own = _edges_of_players(document, net, routes)
    collect(problems, lambda: check_one_level(document_file, own))
    area = network.drivable_area(net, own)
    ground = opened_ground(document, net, area)
    open_one = partial(open_player, file=document_file, document=document, net=net, routes=routes, area=area)
    on_foot = partial(open_walker, file=document_file, document=document, net=net, routes=routes, ground=ground)
    opened = [
        collect(problems, partial(on_foot if player.on_foot else open_one, role))
        for role, player in zip(document.roles, document.players, strict=True)
    ]
    vehicles = set(document.vehicles)
    collect(problems, lambda: check_departures(vehicles, net, routes, document.traffic_window_s, document.roles))
    players = [player for player in opened if player is not None]
    if problems or len(players) < len(opened):
        raise UsageError(problems)
    start_of = partial(start_range, file=document_file, document=document, net=net, ego_route=players[0].route)
    starts = [
        collect(problems, partial(start_of, role, route=player.route))
        for role, player in zip(document.roles, players, strict=True)
    ]
    places = tuple(start for start in starts if start is not None)
    if problems:
        raise UsageError(problems)
    ways = [player.route for player in players]
    obstacles = open_obstacles(file=document_file, document=document, net=net, area=area, routes=routes, ways=ways)
    background = _background_edges(vehicles, net, routes)
    lines = network.rail_lines(net, area, own)
    types = [player.vehicle_type for player in players]
    walking = tuple(player.on_foot for player in document.players)
    walks = ways_of(document, net)
    world = World(
        road=Road(
            network.rails(lines, REACH_M + 10.0),
            Routes.of(ways),
            None if ground is None else network.rails(ground.rail_lines, REACH_M + 10.0),
            None if ground is None else ground.raster,
        ),
        actuators=_actuators(document, types),
        length_m=np.array([each.length_m for each in types]),
        width_m=np.array([each.width_m for each in types]),
        step_s=document.step_length_s,
        time_limit_s=document.time_limit_s,
        right_of_way=_right_of_way(document, walks, net, players),
        on_foot=walking if any(walking) else (),
        hiding=hiding_in(obstacles, routes, document),
    )
    scene = OpenScene(
        folder=folder,
        document=document,
        world=world,
        routes=with_types(routes, obstacles),
        obstacles=obstacles,
        lane_strips=strips_near(net, [*own, *background], obstacles),
        places=places,
        edges=tuple(player.edges for player in players),
        rail_lines=tuple(lines),
        junctions=network.junctions_near(net, [*own, *background]),
        stripes=tuple(stripes([shapely.get_coordinates(way.line) for way in walks if way.marked], area)),
        roads_m=heights_of_players_roads(net, own),
    )
    factors, present = [HumanFactors()] * len(places), [1.0] * len(places)
    check_starts(document_file, scene.start_distribution(factors, present), world)
    check_clear_starts(document_file, scene.start_distribution(factors, present), world)
    return scene


def _right_of_way(document: Scene, ways: Sequence[Way], net: Net, players: Sequence[OpenPlayer]) -> RightOfWay:
    walkers = {way.player for way in ways}
    routes = [[] if k in walkers else [net.getEdge(name) for name in player.edges] for k, player in enumerate(players)]
    lanes_of = [lanes_for(player.kind) for player in document.players]
    table = right_of_way(net, routes, lanes_of)
    return with_walkers_conflicts(table, net, [player.route for player in players], ways)


def _edges_of_players(document: Scene, net: Net, routes: RouteFile) -> list[Edge]:
    """The edges of the players' routes, each once; those of invalid routes are left out."""
    vehicles = [routes.vehicles[name] for name in document.vehicles if name in routes.vehicles]
    found = [collect([], partial(edges_of, each, net, routes)) or [] for each in vehicles]
    return list(dict.fromkeys(edge for edges in found for edge in edges))


def _conditions(document: Scene) -> Conditions:
    varies = document.varies
    return Conditions(
        friction=varies.friction or (document.friction, document.friction),
        limit_share=varies.speed_limit_share or (1.0, 1.0),
    )


def _background_edges(players: Collection[str], net: Net, routes: RouteFile) -> list[Edge]:
    """The edges of all routes of background traffic, which games need whole."""
    names = {name for each in background_departures(routes, players) for name in each.edges}
    return [net.getEdge(name) for name in sorted(names)]


def _with_routes(routes: RouteFile, net_file: Path, net: Net, document: Scene) -> RouteFile:
    """The route file with routes for the trips of the players, and for those that may depart in a game."""
    routes = with_walkers(routes, document, net)
    players = [routes.vehicles[name] for name in document.vehicles if name in routes.vehicles]
    return with_routes(routes, net_file, net, [*players, *routes.within(*document.traffic_window_s)])


def _actuators(document: Scene, types: Sequence[VehicleType]) -> Actuators:
    limits = [player.actuators.with_defaults_of(player.kind) for player in document.players]
    return Actuators(
        max_acceleration_mps2=np.array([each.max_acceleration_mps2 for each in limits]),
        max_braking_mps2=np.array([each.max_braking_mps2 for each in limits]),
        max_speed_mps=np.array([each.max_speed_mps for each in types]),
        max_steering_rad=np.array([each.max_steering_rad for each in limits]),
        max_steering_rate_radps=np.array([each.max_steering_rate_radps for each in limits]),
        wheelbase_m=np.array([each.wheelbase_m for each in limits]),
        max_lateral_mps2=np.array([each.max_lateral_mps2 for each in limits]),
        friction=document.friction,
    )
