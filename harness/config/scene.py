"""A road scene: `scene.toml` beside the net file and the route file of SUMO."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import AfterValidator, Field, model_validator

from harness.config.obstacle import Obstacle
from harness.config.road_user import CYCLING, WALKER_RUN_MPS, Actuators, Kind
from harness.config.toml_reading import Document, Interval, Mistakes, ordered
from harness.game.roles import MOST_PEOPLE, roles_of

_Lower = Annotated[float, Field(ge=0.0, le=10.0)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
_Upper = Annotated[float, Field(gt=0.0, le=10.0)]
Visibility = Annotated[float, Field(gt=0.0, le=120.0)]
Factors = Annotated[tuple[_Lower, _Upper], AfterValidator(ordered)]
PlainFile = Annotated[str, Field(min_length=1, max_length=100, pattern=r"^[A-Za-z0-9][A-Za-z0-9._ -]*$")]
Point = tuple[float, float]
Name = Annotated[str, Field(min_length=1, max_length=40, pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]


class Goal(Document):
    """The destination of a player."""

    edge: str
    """The edge of the goal, an edge of the net."""
    position_m: float = Field(ge=0.0)
    """Distance along that edge."""


class Player(Document):
    """A road user that the harness controls, its goal, and the ranges of its start in each episode."""

    kind: Kind = "car"
    """What it is. Size and top speed are those of the vehicle type; the limits of `actuators` depend on the kind."""
    vehicle: str = ""
    """The id of the vehicle in the route file. It gives the route and the vehicle type. A pedestrian has none."""
    way: Annotated[tuple[Point, ...], Field(min_length=2, max_length=200)] | None = None
    """The way of a pedestrian: points [x, y] in the net's coordinates, from its start to its goal. It may leave it.
    Where it follows a crossing of the net, vehicles must yield; elsewhere the pedestrian must."""
    lane: str | None = None
    """The lane of the start, with `position_m` or `beside_ego_m`."""
    position_m: Interval | None = None
    """Range of the start of its front bumper, along the lane."""
    beside_ego_m: Interval | None = None
    """Instead of `position_m`: range of the start relative to the start of the ego, ahead (+) or behind (-)."""
    route_m: Interval | None = None
    """Instead of a lane: range of the start of its front bumper, along the vehicle's route, over all of its edges."""
    arrival_after_ego_s: Interval | None = None
    """Instead of a lane: range of the time from the ego's arrival to its own at the place where their routes meet, if
    both keep the speed of their start; negative: it arrives before the ego."""
    speed_mps: Interval
    """Range of the speed at the start."""
    goal: Goal | None = None
    """Its destination; left out: the goal of the scene. A pedestrian's is the end of its way."""
    actuators: Actuators = Actuators()

    @model_validator(mode="after")
    def _is_one_kind(self) -> Player:
        if self.on_foot:
            if self.way is None:
                raise ValueError("a pedestrian needs a way: points [x, y] from its start to its goal")
            for name in ("vehicle", "lane", "goal"):
                if getattr(self, name):
                    raise ValueError(f"a pedestrian has no {name}: give its way only")
            if self.speed_mps[1] > WALKER_RUN_MPS:
                raise ValueError(f"a pedestrian's speed_mps is up to {WALKER_RUN_MPS:g}")
            return self
        if self.way is not None:
            raise ValueError('way is a pedestrian\'s: give kind = "pedestrian", or leave it out')
        if not self.vehicle:
            raise ValueError("give the vehicle: the id of one in the route file")
        return self

    @property
    def on_foot(self) -> bool:
        return self.kind == "pedestrian"

    @property
    def drives(self) -> bool:
        """Whether it is a driver: neither on foot nor on a bicycle or e-scooter."""
        return not self.on_foot and self.kind not in CYCLING

    @model_validator(mode="after")
    def _one_start(self) -> Player:
        on_lane = [name for name in ("position_m", "beside_ego_m") if getattr(self, name) is not None]
        on_route = [name for name in ("route_m", "arrival_after_ego_s") if getattr(self, name) is not None]
        if len(on_lane) + len(on_route) != 1:
            raise ValueError("give one of position_m, beside_ego_m, route_m and arrival_after_ego_s")
        if on_lane and self.lane is None:
            raise ValueError(f"{on_lane[0]} needs the lane of the start")
        if on_route and self.lane is not None:
            raise ValueError(f"{on_route[0]} is along the route: leave out lane")
        if self.speed_mps[0] < 0.0:
            raise ValueError("speed_mps must not be negative")
        if self.arrival_after_ego_s is not None and self.speed_mps[0] <= 0.0:
            raise ValueError("arrival_after_ego_s needs speeds above 0")
        return self


def _one_to_four(people: tuple[Player, ...]) -> tuple[Player, ...]:
    if not 1 <= len(people) <= MOST_PEOPLE:
        message = f"{len(people)} people; a scene has one to {MOST_PEOPLE}"
        raise Mistakes([("", message, "leave some out" if people else "add [[non_ego]]")])
    return people


_FOLLOWED_SHARE = 0.5
_COUNTS = Field(json_schema_extra={"minItems": 1, "maxItems": MOST_PEOPLE})  # `_one_to_four` words the mistake


class Varies(Document):
    """What differs from game to game: ranges from which each game draws by its seed."""

    traffic_density: Factors | None = None
    """Range of a factor on the background traffic: on the rates of flows, and on the number of single vehicles."""
    friction: Factors | None = None
    """Range of the coefficient of friction, instead of the scene's `friction`."""
    visibility_m: Annotated[tuple[Visibility, Visibility], AfterValidator(ordered)] | None = None
    """Range of the visibility, instead of the scene's `visibility_m`."""
    speed_limit_share: Factors | None = None
    """Range of a factor on all speed limits of the net."""
    signal_place: Annotated[tuple[Share, Share], AfterValidator(ordered)] | None = None
    """Range of the place in the cycles of traffic lights at which the game starts, from 0 to 1. Left out: anywhere."""


class Scene(Document):
    """The road, the players on it, and how a game starts and ends."""

    name: Name
    """The name of the scene."""
    net: PlainFile
    """The SUMO net file in the folder of the scene."""
    routes: PlainFile
    """The SUMO file of routes, vehicle types and vehicles in the folder of the scene."""
    additional: tuple[PlainFile, ...] = ()
    """More SUMO files in that folder: route files, or additional files of vehicle types, routes and bus stops."""
    step_length_s: float = Field(0.1, ge=0.01, le=0.2)
    """Length of a step. Contact is tested once per step; in a longer step one car could pass through another."""
    time_limit_s: float = Field(gt=0.0, le=600.0)
    """Longest duration of a game. A player that has not reached its goal by then has failed."""
    friction: float = Field(0.8, gt=0.0, le=1.5)
    """Coefficient of friction between tyre and road, as a share of g."""
    visibility_m: Visibility = 120.0
    """Distance up to which players see road users and obstacles, from centre to centre, as in fog; an observation has
    none beyond 120 m. SUMO's own drivers see as usual."""
    traffic_begin_s: float = Field(0.0, ge=0.0, le=1e7)
    """Time of the route file at which its traffic begins, as SUMO's option --begin."""
    warm_up_s: float = Field(0.0, ge=0.0, le=3600.0)
    """Time for which background traffic has been on the road when a game starts. The game starts at `traffic_begin_s`
    plus this time of the route file."""
    followed_share: float | None = Field(None, ge=0.0, le=1.0)
    """Share of the games in which a car that SUMO drives follows the ego. Left out: 0.5, or 0 if the ego does not drive
    or a pedestrian takes part. With a pedestrian only 0 is allowed, because SUMO's driver may run into it."""
    varies: Varies = Varies()
    goal: Goal | None = None
    """The destination of every player that has none of its own."""
    ego: Player
    non_ego: Annotated[tuple[Player, ...], AfterValidator(_one_to_four), _COUNTS]
    """The people that the ego meets, one to four: `[[non_ego]]` for each. They are called `non_ego`, `non_ego_2`,
    `non_ego_3` and `non_ego_4`, in the order of the document."""
    obstacle: tuple[Obstacle, ...] = Field((), max_length=50)
    """What stands on the road or beside it: `[[obstacle]]` for each, named `obstacle_1`, `obstacle_2` and so on."""

    @model_validator(mode="after")
    def _players_fit(self) -> Scene:
        for name in ("beside_ego_m", "arrival_after_ego_s"):
            if getattr(self.ego, name) is not None:
                raise ValueError(f"ego.{name}: the ego can't start relative to itself; give ego.position_m")
        for role, player in zip(self.roles, self.players, strict=True):
            if player.beside_ego_m is not None and self.ego.position_m is None:
                raise ValueError(f"{role}.beside_ego_m needs ego.position_m, along the ego's lane")
            if player.arrival_after_ego_s is not None and self.ego.speed_mps[0] <= 0.0:
                message = f"{role} arrives so long after an ego of this speed (arrival_after_ego_s), and it may stand"
                raise Mistakes([("ego.speed_mps", message, f"give speeds above 0, or give {role} route_m instead")])
            if self.goal is None and player.goal is None and not player.on_foot:
                raise ValueError(f"{role} has no goal: give [goal] for all players, or give {role} a goal")
        if self.goal is not None and all(player.goal is not None or player.on_foot for player in self.players):
            raise ValueError("every player has a goal of its own: leave out [goal]")
        return self

    @model_validator(mode="after")
    def _followed_without_pedestrians(self) -> Scene:
        walking = [role for role, player in zip(self.roles, self.players, strict=True) if player.on_foot]
        if self.followed_share and walking:
            message = f"{walking[0]} is a pedestrian, and the car that follows the ego does not see it"
            raise Mistakes([("followed_share", message, "give 0, or leave it out")])
        return self

    @classmethod
    def named_location(cls, location: list[Any]) -> list[Any]:
        """Places among people and obstacles are their names."""
        match location:
            case ["non_ego", int(place), *rest] if place < MOST_PEOPLE:
                return [roles_of(1 + MOST_PEOPLE)[1 + place], *rest]
            case ["obstacle", int(place), *rest]:
                return [f"obstacle_{place + 1}", *rest]
            case _:
                return location

    @property
    def share_followed(self) -> float:
        """Share of the games in which somebody follows the ego."""
        if self.followed_share is not None:
            return self.followed_share
        return _FOLLOWED_SHARE if self.ego.drives and not any(player.on_foot for player in self.players) else 0.0

    @property
    def players(self) -> tuple[Player, ...]:
        """Ego and non-egos, in the order of the player axis of arrays."""
        return self.ego, *self.non_ego

    @property
    def roles(self) -> tuple[str, ...]:
        """The players' names, in that order."""
        return roles_of(len(self.players))

    @property
    def vehicles(self) -> tuple[str, ...]:
        """The ids of the players' vehicles in the route file. Those of pedestrians are made by the harness."""
        pairs = zip(self.roles, self.players, strict=True)
        return tuple(f"{role} on foot" if player.on_foot else player.vehicle for role, player in pairs)

    def player(self, role: str) -> Player:
        return self.players[self.roles.index(role)]

    @property
    def files(self) -> tuple[str, ...]:
        """The files of the scene in its folder, the document first."""
        return SCENE_FILE, self.net, self.routes, *self.additional

    @property
    def game_window_s(self) -> tuple[float, float]:
        """Begin and end of a game, as times of the route file."""
        begin_s = self.traffic_begin_s + self.warm_up_s
        return begin_s, begin_s + self.time_limit_s

    @property
    def traffic_window_s(self) -> tuple[float, float]:
        """Begin of the warm-up and end of a game, as times of the route file."""
        return self.traffic_begin_s, self.game_window_s[1]

    def goal_of(self, player: Player) -> tuple[str, Goal]:
        """A player's goal, and the key of the document that gives it."""
        if player.goal is None:
            assert self.goal is not None, "each player has a goal"
            return "goal", self.goal
        roles = (role for role, each in zip(self.roles, self.players, strict=True) if each is player)
        return f"{next(roles)}.goal", player.goal


SCENE_FILE = "scene.toml"
