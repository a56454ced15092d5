"""Opening a scene: its document, net and routes, checked against one another, in the form that the game uses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from harness.config.scene import Scene
from harness.game.arrays import FloatArray
from harness.game.human_factors import HumanFactors
from harness.game.initial_state import StartDistribution, of_people
from harness.game.perception_errors import PerceptionErrors
from harness.game.placed_obstacles import Obstacles
from harness.game.seeding import between, generator_of
from harness.game.start_range import StartRange
from harness.game.world import World
from harness.road.demand.route_file import Departure, RouteFile
from harness.road.demand.warm_up import Snapshot, snapshots
from harness.road.net import levels, network
from harness.road.scene.cartesian_road import CartesianRoads, cartesian_roads
from harness.road.scene.following import NO_ROAD, RoadBehind, road_behind, with_follower_type
from harness.road.scene.footway import opened_ground
from harness.road.scene.open_obstacles import LaneStrip, open_obstacles, strips_near, with_types
from harness.road.scene.scene_files import read_scene
from harness.road.scene.scene_world import edges_in_use, edges_of_players, opened_players, start_places, world_of
from harness.road.scene.start_ranges import check_starts, start_warnings
from harness.shipped_documents import named_document


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
    net_warnings: tuple[str, ...]  # a line for each attribute of the net that SUMO ignores
    routes: RouteFile
    places: tuple[StartRange, ...]
    edges: tuple[tuple[str, ...], ...]  # each player's route, from its start edge on
    rail_lines: tuple[FloatArray, ...]
    junctions: frozenset[str] | None  # those that games need; None: all of the net
    obstacles: Obstacles
    lane_strips: tuple[LaneStrip, ...]  # lanes that an obstacle may block
    road_behind: RoadBehind  # on which somebody may follow the ego
    stripes: tuple[FloatArray, ...]  # [5, 2] each, of the marked crossings
    roads_m: FloatArray | None  # [n, 3] points of the players' roads; None: no other road passes over or under
    perception_errors: PerceptionErrors | None = None  # of the ego in games on this scene; None: it sees what is there

    @property
    def net_file(self) -> Path:
        return self.folder / self.document.net

    @cached_property
    def has_background_traffic(self) -> bool:
        """Whether vehicles other than the players may depart."""
        return bool(self.routes.names - {*self.document.vehicles})

    @cached_property
    def has_steady_traffic(self) -> bool:
        """Whether the background traffic, if any, draws none of SUMO's random numbers and stays in its lanes."""
        return self.routes.is_steady({*self.document.vehicles})

    @cached_property
    def warm_up(self) -> tuple[Snapshot, ...]:
        """The background traffic with which games begin. Raises SimulationError if SUMO fails."""
        return snapshots(self.document, self.routes, self.net_file)

    @cached_property
    def cartesian_roads(self) -> CartesianRoads:
        """The roads of the players as planners get them. They are read from the net."""
        return cartesian_roads(self.net_file, self.document, self.world, edges=self.edges, rail_lines=self.rail_lines)

    def vehicle(self, player: int) -> Departure:
        """A player's vehicle in the route file."""
        return self.routes.vehicles[self.document.vehicles[player]]

    def departures(self, *parts: str | int) -> list[Departure]:
        """The background vehicles that depart during a game, whose random numbers are named by these parts."""
        if not self.has_background_traffic:
            return []
        generator = generator_of(*parts, "others")
        players = set(self.document.vehicles)
        begin_s, end_s = self.document.game_window_s
        varied = self.document.varies.traffic_density
        density = 1.0 if varied is None else between(varied, generator.random())
        on_road: tuple[Departure, ...] = ()
        if self.document.warm_up_s:
            snapshot = self.warm_up[generator.integers(len(self.warm_up))]
            density, on_road = snapshot.density, snapshot.vehicles
        return [*on_road, *self.routes.departures(players, end_s, generator, begin_s=begin_s, density=density)]

    @cached_property
    def usual_starts(self) -> StartDistribution:
        """The distribution of initial states of attentive players, who all take part."""
        players = len(self.places)
        return self.start_distribution([HumanFactors()] * players, [1.0] * players)

    @property
    def warnings(self) -> list[str]:
        """What is no mistake but may be a slip: a line for each attribute that SUMO ignores, and for each two players
        who may start in one another."""
        return [*self.net_warnings, *self.routes.warnings, *start_warnings(self.usual_starts, self.world)]

    def start_distribution(
        self,
        human_factors: Sequence[HumanFactors | Sequence[HumanFactors]],
        present_share: Sequence[float],
        shares: Sequence[Sequence[float]] | None = None,
        along_route_share: float = 0.0,
    ) -> StartDistribution:
        """The distribution of initial states for players with these human factors and probabilities of taking part.

        A player with several drivers has the human factors of each, and the `shares` [P][n] of the games of each. The
        ego is a machine and has none. In `along_route_share` of the games of a player alone, it starts anywhere along
        its route.
        """
        varies = self.document.varies
        factors_of = [[each] if isinstance(each, HumanFactors) else list(each) for each in human_factors]
        return StartDistribution(
            world=self.world,
            places=self.places,
            human_factors=of_people(factors_of),
            shares=shares or [[1.0] * len(each) for each in factors_of],
            present_share=present_share,
            friction=varies.friction or (self.document.friction, self.document.friction),
            visibility_m=varies.visibility_m or (self.document.visibility_m, self.document.visibility_m),
            limit_share=varies.speed_limit_share or (1.0, 1.0),
            signal_place=varies.signal_place or (0.0, 1.0),
            along_route_share=along_route_share,
            followed_share=self.document.share_followed,
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
    files = read_scene(folder, ego_type)
    document, net = files.document, files.net
    own = edges_of_players(files)
    area = network.drivable_area(net, own)
    ground = opened_ground(document, net, area)
    players = opened_players(files, own, area, ground)
    places = start_places(files, players)
    obstacles = open_obstacles(files, area, [player.route for player in players])
    rail_lines = tuple(network.rail_lines(net, area, own))
    routes = with_types(files.routes, obstacles)
    used = edges_in_use(files, own)
    scene = OpenScene(
        folder=files.folder,
        document=document,
        world=world_of(files, players, rail_lines=rail_lines, ground=ground, obstacles=obstacles),
        net_warnings=files.net_warnings,
        routes=with_follower_type(routes) if document.share_followed else routes,
        obstacles=obstacles,
        lane_strips=strips_near(net, used, obstacles),
        places=places,
        road_behind=road_behind(files) if document.share_followed else NO_ROAD,
        edges=tuple(player.edges for player in players),
        rail_lines=rail_lines,
        junctions=network.junctions_near(net, used),
        stripes=() if ground is None else ground.stripes,
        roads_m=levels.heights_of_players_roads(net, own),
    )
    check_starts(files.file, scene.usual_starts, scene.world)
    return scene
