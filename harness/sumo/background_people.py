"""Persons that SUMO moves beside the players: their insertion, their motion and their arrivals.

They are few, and beside pavements only: every person is read in every step, and those near a player are bodies like
the background vehicles.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain

import libsumo
import numpy as np
from libsumo import _libsumo  # the same functions without Python wrappers, for frequent calls

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.near_players import NOTICED_M
from harness.road.demand.route_file import EDGE_SHARE, Departure
from harness.road.net.levels import on_players_level
from harness.road.xml.angles import heading_rad_of
from harness.sumo.simulation import Reading

_AS_ITS_TYPE = -1.0  # a walk's speed


class BackgroundPeople:
    """The persons of all games."""

    def __init__(
        self, *, prefixes: Sequence[str], offsets_m: FloatArray, recorded: bool, roads_m: FloatArray | None = None
    ) -> None:
        """`roads_m` are the points [n, 3] of the players' roads: persons on other levels are left out of readings."""
        self._prefixes, self._offsets_m, self._recorded, self._roads_m = prefixes, offsets_m, recorded, roads_m
        self.inserted: dict[str, int] = {}
        """The game of each person in SUMO, by its name there."""
        self._on_road: dict[str, tuple[int, str, str, float, float]] = {}  # game, name, type, length, width
        self._listed: _List | None = None  # of the persons on the road, until they change

    def add(self, game: int, person: Departure) -> None:
        """Add a person, who departs in the next step."""
        prefix = self._prefixes[game]
        name, edges = prefix + person.name, [prefix + edge for edge in person.edges]
        begin_m, end_m = _metres(edges[0], person.position), _metres(edges[-1], person.arrival[1])
        speed_mps = float(person.speed) if person.speed else _AS_ITS_TYPE
        libsumo.person.add(name, edges[0], begin_m, depart=libsumo.simulation.getTime(), typeID=person.vehicle_type)
        libsumo.person.appendWalkingStage(name, edges, arrivalPos=end_m, speed=speed_mps)
        if person.speed_factor is not None:
            libsumo.person.setSpeedFactor(name, person.speed_factor)
        self.inserted[name] = game

    def clear(self, game: int) -> None:
        """Remove all persons of a game."""
        for name in [name for name, of_game in self.inserted.items() if of_game == game]:
            libsumo.person.remove(name)
            self._forget(name)

    def advance(self) -> None:
        """Process a step of SUMO: arrivals, and persons that departed."""
        for name in _libsumo.simulation_getArrivedPersonIDList():
            self._forget(name)
        for name in _libsumo.simulation_getDepartedPersonIDList():
            if name in self.inserted:
                game, person = self.inserted[name], libsumo.person
                plain = name[len(self._prefixes[game]) :]
                size_m = person.getLength(name), person.getWidth(name)
                self._on_road[name] = (game, plain, person.getTypeID(name), *size_m)
                self._listed = None

    def read(self, players_x_m: FloatArray, players_y_m: FloatArray, players_present: BoolArray) -> Reading:
        """The persons near the players [G, P] that are present, or all persons if games are recorded."""
        if self._listed is None:
            self._listed = _List(self._on_road)
        listed, count = self._listed, len(self._on_road)
        places = np.fromiter(chain.from_iterable(map(_libsumo.person_getPosition, listed.names)), float, 2 * count)
        front_m = places.reshape(-1, 2)
        front_m[:, 1] -= self._offsets_m[listed.games]
        if self._recorded:
            near: IntArray = np.arange(count)
        else:
            away_m = np.hypot(front_m[:, :1] - players_x_m[listed.games], front_m[:, 1:] - players_y_m[listed.games])
            near = np.flatnonzero(((away_m < NOTICED_M + 1.0) & players_present[listed.games]).any(1))
        if self._roads_m is not None and len(near):
            near = np.compress(on_players_level(self._roads_m, self._points(listed, near)), near)
        names = [listed.names[k] for k in near.tolist()]
        heading = heading_rad_of(np.fromiter(map(_libsumo.person_getAngle, names), float, len(names)))
        speed = np.fromiter(map(_libsumo.person_getSpeed, names), float, len(names))
        return _reading(listed, near, front_m=front_m[near], heading=heading, speed=speed, games=len(self._prefixes))

    def _points(self, listed: _List, near: IntArray) -> FloatArray:
        """[m, 3] where persons are, with their heights, in the coordinates of the net."""
        points = np.array([libsumo.person.getPosition3D(listed.names[k]) for k in near.tolist()]).reshape(-1, 3)
        points[:, 1] -= self._offsets_m[listed.games[near]]
        return points

    def _forget(self, name: str) -> None:
        self.inserted.pop(name, None)
        if self._on_road.pop(name, None) is not None:
            self._listed = None


class _List:
    """The persons on the road as columns [n], by game."""

    def __init__(self, on_road: dict[str, tuple[int, str, str, float, float]]) -> None:
        rows = sorted(on_road.items(), key=lambda row: row[1][0])  # stable: in the order of their departures
        self.names = [name for name, _ in rows]
        self.games = np.array([row[0] for _, row in rows], dtype=np.int64)
        self.words = np.array([row[1:3] for _, row in rows], dtype=object).reshape(-1, 2)
        self.sizes_m = np.array([row[3:] for _, row in rows]).reshape(-1, 2)


def _metres(edge: str, place: str) -> float:
    """The distance of a place along an edge."""
    length_m = libsumo.lane.getLength(f"{edge}_0")
    drawn = place.endswith(EDGE_SHARE)
    metres = float(place.removesuffix(EDGE_SHARE)) * length_m if drawn else float(place)
    return metres + length_m if metres < 0.0 else metres


def _reading(
    listed: _List, near: IntArray, *, front_m: FloatArray, heading: FloatArray, speed: FloatArray, games: int
) -> Reading:
    """The reading [G, M] of the persons `near` [n] with fronts [n, 2]."""
    of_game, (length, width) = listed.games[near], listed.sizes_m[near].T
    column = np.arange(len(near)) - np.searchsorted(of_game, of_game)
    shape = (games, int(column.max(initial=-1)) + 1)
    (names, types), numbers = np.full((2, *shape), None, dtype=object), np.zeros((6, *shape))
    x_m, y_m, heading_rad, speed_mps, length_m, width_m = numbers
    present = np.zeros(shape, dtype=bool)
    reading = Reading(names, types, x_m, y_m, heading_rad, speed_mps, length_m, width_m, present)
    x, y = front_m[:, 0] - 0.5 * length * np.cos(heading), front_m[:, 1] - 0.5 * length * np.sin(heading)
    values = (*listed.words[near].T, x, y, heading, speed, length, width, True)
    for row, of_people in zip(reading.bodies, values, strict=True):
        row[of_game, column] = of_people
    return reading
