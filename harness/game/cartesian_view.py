"""What a planner gets beside its observation: the road, and what its player sees, in Cartesian coordinates.

All is in one frame: the net's own coordinates in metres, x to the east and y to the north. Headings are yaw angles of
ISO 8855, in radians: 0 east, counter-clockwise, from -π to π. Poses are those of the body's centre.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.game.arrays import FloatArray
from harness.game.junctions import Signal


@dataclass(frozen=True, kw_only=True)
class MapLane:
    """A lane of the road."""

    edge: str
    line: FloatArray
    """[n, 2] x and y of the points of its centre line, in the direction of travel."""
    length_m: float
    width_m: float
    speed_limit_mps: float
    """Of the net; `CartesianView.speed_limit_share` is a factor on it."""
    vehicle_classes: tuple[str, ...]
    """Those of passenger, bicycle and pedestrian that may use it (SUMO's classes)."""
    in_junction: bool
    left: str | None
    """The lane beside it with the same direction."""
    right: str | None
    successors: tuple[str, ...]
    """The lanes that go on at its end: those inside the junction, or, where the net has none, those after it."""


@dataclass(frozen=True, kw_only=True)
class MapSignal:
    """A signal that faces the player on its route."""

    station_m: float
    """Of its stop line, along the route's line."""
    lanes: tuple[str, ...]
    """The lanes at whose end it stands."""


@dataclass(frozen=True, kw_only=True)
class CartesianRoad:
    """The road around a player's route. It is the same in all games of a scene."""

    net_file: str
    """The path of SUMO's net."""
    lanes: Mapping[str, MapLane]
    """By id: the lanes within 300 m of the players' routes."""
    rails: tuple[FloatArray, ...]
    """Lines [n, 2] at the edge of the drivable area, which no part of the vehicle may touch; none for a player on
    foot."""
    route_edges: tuple[str, ...]
    """The edges of the route; none for a player on foot."""
    route_lanes: tuple[str, ...]
    """The lanes that the route's line follows. Each is a successor of the one before, or beside it."""
    route_line: FloatArray
    """[n, 2] points from the start of the route to its end, 0.5 m apart. It changes lanes gradually."""
    goal_m: float
    """Distance of the goal along this line."""
    goal_x_m: float
    goal_y_m: float
    signals: tuple[MapSignal, ...]
    """In the order of the route."""


@dataclass(frozen=True, kw_only=True)
class SeenObject:
    """A road user or obstacle that the player sees, where and as fast as the player takes it to be."""

    id: int
    """The same for one object in all steps of a game; objects are counted as they come into sight."""
    kind: str
    """Its vehicle class of SUMO, such as passenger, truck, bicycle or pedestrian; or obstacle."""
    x_m: float
    y_m: float
    heading_rad: float
    length_m: float
    width_m: float
    velocity_x_mps: float
    velocity_y_mps: float
    acceleration_x_mps2: float
    """Change of its velocity since the step before; 0 in the first step in which it is seen."""
    acceleration_y_mps2: float
    turn_signal: str
    """off, left, right or both. Vehicles that SUMO drives operate turn signals, and others do not."""


@dataclass(frozen=True, kw_only=True)
class SeenSignal:
    """The state of a signal."""

    state: str
    """green, green_yielding, yellow, red or off."""
    since_s: float
    """Time since it changed."""


SIGNAL_STATES = tuple(each.name.lower() for each in Signal)
"""The state of a signal in words, by its code."""


@dataclass(frozen=True, kw_only=True)
class CartesianView:
    """What a player knows of itself, and what it sees."""

    time_s: float
    """Since the start of the game."""
    x_m: float
    y_m: float
    heading_rad: float
    speed_mps: float
    acceleration_mps2: float
    """Along the heading."""
    steering_rad: float
    """Road wheel angle, left positive."""
    station_m: float
    """Distance along the route's line."""
    speed_limit_share: float
    """Factor on the speed limits of all lanes; 1 if the scene does not vary it."""
    objects: tuple[SeenObject, ...]
    signals: tuple[SeenSignal, ...]
    """The states of the road's `signals`, in their order."""
    road: CartesianRoad
    history: tuple[CartesianView, ...] = ()
    """The views of the steps before, the oldest first, for as long as the driver document asks."""

    @classmethod
    def at_start(cls, road: CartesianRoad) -> CartesianView:
        """The view of a player that stands alone at the start of its route, with signals that are off."""
        start, following = road.route_line[:2]
        off = SeenSignal(state=SIGNAL_STATES[Signal.OFF], since_s=0.0)
        return cls(
            time_s=0.0,
            speed_mps=0.0,
            acceleration_mps2=0.0,
            steering_rad=0.0,
            station_m=0.0,
            x_m=float(start[0]),
            y_m=float(start[1]),
            heading_rad=float(np.arctan2(*(following - start)[::-1])),
            speed_limit_share=1.0,
            objects=(),
            signals=(off,) * len(road.signals),
            road=road,
        )
