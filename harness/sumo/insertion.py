"""Insertion of vehicles into SUMO's traffic: departures of the route file, the vehicle that follows the ego, and
vehicles that stand for obstacles.

A vehicle of a warm-up is left out if it leaves a player or an obstacle of the game too little room. Where an obstacle
blocks lanes, one vehicle stands on each, so that the traffic stops behind it or drives round it. Contact is tested
against the obstacle itself.
"""

from __future__ import annotations

from collections.abc import Sequence

import libsumo
import numpy as np

from harness.game.arrays import BoolArray, FloatArray
from harness.game.follower import OrdinaryDriver
from harness.game.geometry import Box, box_distance
from harness.game.initial_state import InitialState
from harness.game.roles import EGO
from harness.road.demand.route_file import SHARE, Departure, Motion
from harness.road.demand.stops import Stop
from harness.road.scene.following import FOLLOWER_XML
from harness.road.scene.open_obstacles import blockages
from harness.road.scene.open_scene import OpenScene
from harness.road.xml.xml_file import number_of
from harness.sumo.simulation import TypeNames

CLEAR_M, CLEAR_S, CLEAR_AROUND_M = 10.0, 2.0, 2.0
"""Room at a player's start: no vehicle on its lane nearer than the first or than the way that the one behind drives in
the second, and none nearer than the third anywhere."""
OBSTACLE_TYPE = "harness_obstacle"
TYPES_XML = f'<vType id="{OBSTACLE_TYPE}" vClass="ignoring" minGap="0"/>{FOLLOWER_XML}'
"""The types of vehicles that stand for obstacles, which no lane's permissions exclude, and of the ego's follower."""

_PARKING = 1  # a flag of setStop: the vehicle leaves the lane while it stands
_LANE_M = 3.0
_WITHOUT_END = -1073741824.0  # SUMO's double for a value that is not given


class Insertion:
    """Adds vehicles to the traffic of one loaded simulation. Each route is declared once."""

    def __init__(self, types: TypeNames) -> None:
        self._types = types
        self._routes: set[str] = set()

    def add(
        self,
        prefix: str,
        name: str,
        *,
        edges: Sequence[str],
        vehicle_type: str,
        lane: str,
        position: str,
        speed: str,
        arrival: tuple[str, str, str] = Departure.arrival,
    ) -> None:
        """Add a vehicle that departs as soon as there is room. `prefix` is that of all names in its tile."""
        route = prefix + "route " + " ".join(edges)
        if route not in self._routes:
            libsumo.route.add(route, [prefix + edge for edge in edges])
            self._routes.add(route)
        arrival_lane, arrival_position, arrival_speed = arrival
        libsumo.vehicle.add(
            name,
            route,
            self._types.in_sumo(vehicle_type),
            depart="now",
            departLane=lane,
            departPos=position,
            departSpeed=speed,
            arrivalLane=arrival_lane,
            arrivalPos=arrival_position,
            arrivalSpeed=arrival_speed,
        )

    def depart(self, prefix: str, name: str, departure: Departure) -> None:
        """Add a background vehicle under a name, with its stops and its speed factor."""
        motion = departure.motion
        self.add(
            prefix,
            name,
            edges=departure.edges,
            vehicle_type=departure.vehicle_type,
            lane=departure.lane if motion is None else "first",
            position=departure.position if motion is None else "base",
            speed=departure.speed,
            arrival=departure.arrival,
        )
        if departure.speed_factor is not None:
            libsumo.vehicle.setSpeedFactor(name, departure.speed_factor)
        if motion is not None:  # at once: SUMO would wait for more room than cars leave one another
            libsumo.vehicle.moveTo(name, in_tile(prefix, departure.lane), float(departure.position))
            libsumo.vehicle.setPreviousSpeed(name, motion.speed_mps, 0.0)
        if departure.follower is not None:
            libsumo.vehicle.setTau(name, departure.follower.time_gap_s)
            libsumo.vehicle.setActionStepLength(name, departure.follower.reaction_s)
        for stop in departure.stops:
            _add_stop(prefix, name, stop, departure.depart_s)


def drive_as(name: str, driver: OrdinaryDriver) -> None:
    """Give a vehicle that has just been added the parameters of its driver."""
    libsumo.vehicle.setTau(name, driver.time_gap_s)
    libsumo.vehicle.setImpatience(name, driver.impatience)
    libsumo.vehicle.setParameter(name, "laneChangeModel.lcAssertive", str(driver.assertive))
    libsumo.vehicle.setSpeedFactor(name, driver.speed_factor)  # last: setTau gives the vehicle a type, with its factor


def in_tile(prefix: str, lane: str) -> str:
    """A lane's id in a tile. A lane inside a junction begins with a colon, and the prefix follows it."""
    return f":{prefix}{lane[1:]}" if lane.startswith(":") else prefix + lane


def put_beside(name: str, departure: Departure) -> None:
    """Move a vehicle that has just departed to its place across the lane."""
    lane_m = libsumo.lane.getWidth(libsumo.vehicle.getLaneID(name))
    room_m = 0.5 * max(lane_m - libsumo.vehicle.getWidth(name), 0.0)
    sides = {"left": room_m, "right": -room_m}
    share = departure.lateral.removesuffix(SHARE)
    written_m = room_m * float(share) if share != departure.lateral else number_of(departure.lateral)
    libsumo.vehicle.setLateralLanePosition(name, sides.get(departure.lateral, written_m))


def _add_stop(prefix: str, name: str, stop: Stop, depart_s: float) -> None:
    now = libsumo.simulation.getTime()
    libsumo.vehicle.setStop(
        name,
        prefix + stop.edge,
        pos=stop.end_m or 0.0,
        laneIndex=stop.lane or 0,
        duration=_WITHOUT_END if stop.duration_s is None else stop.duration_s,
        flags=_PARKING if stop.parking else 0,
        startPos=stop.start_m or 0.0,
        until=_WITHOUT_END if stop.until_s is None else max(now + stop.until_s - depart_s, 0.0),
    )


# --- obstacles -------------------------------------------------------------------------------------------------------


class StandingVehicles:
    """The vehicles of all games that stand for obstacles."""

    def __init__(self, scene: OpenScene, prefixes: Sequence[str], insertion: Insertion) -> None:
        self._scene, self._prefixes, self._insertion = scene, prefixes, insertion
        self._names: list[list[str]] = [[] for _ in prefixes]

    def reset(self, game: int, *parts: str | int) -> None:
        """Replace the vehicles of a game by those of the game whose seeds have these parts."""
        for name in self._names[game]:
            libsumo.vehicle.remove(name)
        obstacles, prefix = self._scene.obstacles, self._prefixes[game]
        self._names[game] = []
        for k, each in enumerate(blockages(self._scene.lane_strips, obstacles.poses(*parts), obstacles)):
            name, edges = f"{prefix}{obstacles.each[each.obstacle].name}.{k}", each.strip.edges
            self._insertion.add(
                prefix, name, edges=edges, vehicle_type=OBSTACLE_TYPE, lane="first", position="base", speed="0"
            )
            stand(name, in_tile(prefix, each.strip.name), each.front_m, each.length_m)
            self._names[game].append(name)


def stand(name: str, lane: str, front_m: float, length_m: float) -> None:
    """Let a vehicle of this length that was just added stand on a lane for good."""
    vehicle = libsumo.vehicle
    vehicle.setLength(name, length_m)
    vehicle.moveTo(name, lane, front_m)  # at once: SUMO would wait for room
    vehicle.setSpeedMode(name, 0)
    vehicle.setLaneChangeMode(name, 0)
    vehicle.setSpeed(name, 0.0)


# --- room for the vehicles of a warm-up ------------------------------------------------------------------------------


def clear_of_players(departures: Sequence[Departure], start: InitialState, length_m: FloatArray) -> list[Departure]:
    """The departures without vehicles of the warm-up that are too near to a player's start (`CLEAR_M` and the others).

    `length_m` [P] are the players' lengths. Players that take no part count too: arms have the same traffic.
    """
    return [each for each in departures if each.motion is None or not _near(each.motion, start, length_m).any()]


def with_follower(
    departures: Sequence[Departure], follower: Departure, start: InitialState, length_m: FloatArray
) -> list[Departure]:
    """The departures with the vehicle that follows the ego, and without vehicles of the warm-up in its place.

    Where a person starts in its place, nobody follows.
    """
    assert follower.motion is not None, "it drives already"
    if np.delete(_near(follower.motion, start, length_m), EGO).any():
        return list(departures)
    return [follower, *clear_of(departures, [_way(follower.motion)])]


def _near(motion: Motion, start: InitialState, length_m: FloatArray) -> BoolArray:
    """[P] the players that start near a vehicle that drives already."""
    dx = motion.x_m - 0.5 * motion.length_m * np.cos(motion.heading_rad) - start.x_m
    dy = motion.y_m - 0.5 * motion.length_m * np.sin(motion.heading_rad) - start.y_m
    cos, sin = np.cos(start.heading_rad), np.sin(start.heading_rad)
    ahead, beside = dx * cos + dy * sin, np.abs(dy * cos - dx * sin)
    bodies = 0.5 * (motion.length_m + length_m)
    behind_mps = np.where(ahead > 0.0, start.speed_mps, motion.speed_mps)
    on_lane = (beside < _LANE_M) & (np.abs(ahead) - bodies < np.maximum(CLEAR_M, CLEAR_S * behind_mps))
    near: BoolArray = on_lane | (np.hypot(dx, dy) - bodies < CLEAR_AROUND_M)
    return near


def clear_of(departures: Sequence[Departure], boxes: Sequence[Box]) -> list[Departure]:
    """The departures without vehicles of a warm-up that are on one of the boxes, or would brake hard before it."""
    return [
        each
        for each in departures
        if each.motion is None or all(box_distance(_way(each.motion), box) > 0.0 for box in boxes)
    ]


def _way(motion: Motion) -> Box:
    room_m = max(CLEAR_M, CLEAR_S * motion.speed_mps)
    ahead_m = 0.5 * (room_m - motion.length_m)  # a motion is that of the front bumper
    x_m, y_m = motion.x_m + ahead_m * np.cos(motion.heading_rad), motion.y_m + ahead_m * np.sin(motion.heading_rad)
    return Box(float(x_m), float(y_m), motion.heading_rad, motion.length_m + room_m, motion.width_m)
