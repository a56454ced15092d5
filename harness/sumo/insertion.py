"""Insertion of vehicles into SUMO's traffic, with all that a departure of the route file says."""

from __future__ import annotations

from collections.abc import Sequence

import libsumo

from harness.road.demand.route_file import SHARE, Departure
from harness.road.demand.stops import Stop
from harness.road.xml.xml_file import number_of

_PARKING = 1  # a flag of setStop: the vehicle leaves the lane while it stands
_WITHOUT_END = -1073741824.0  # SUMO's double for a value that is not given


class Insertion:
    """Adds vehicles to the traffic of one loaded simulation. Each route is declared once."""

    def __init__(self) -> None:
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
            vehicle_type,
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
            libsumo.vehicle.setPreviousSpeed(name, motion.speed_mps)
        for stop in departure.stops:
            _add_stop(prefix, name, stop, departure.depart_s)


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
