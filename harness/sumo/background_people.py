"""Persons that SUMO moves beside the players: their insertion, their motion and their arrivals.

They are few, and beside pavements only: every person is read in every step, and those near a player are bodies like
the background vehicles.
"""

from __future__ import annotations

from typing import NamedTuple

import libsumo
import numpy as np
from libsumo import _libsumo  # the same functions without Python wrappers, for frequent calls

from harness.game.state import NOTICED_M
from harness.road.demand.route_file import EDGE_SHARE, Departure
from harness.road.xml.angles import heading_rad_of
from harness.sumo.simulation import Players, Reading, Tiles, distance_to_player_m, reading_of

_AS_ITS_TYPE = -1.0  # a walk's speed


class _Person(NamedTuple):
    """A person on the road. `name` is without the prefix of its tile."""

    game: int
    name: str
    person_type: str
    length_m: float
    width_m: float


class BackgroundPeople:
    """The persons of all games."""

    def __init__(self, tiles: Tiles, *, recorded: bool) -> None:
        self._tiles, self._recorded = tiles, recorded
        self.inserted: dict[str, int] = {}
        """The game of each person in SUMO, by its name there."""
        self._on_road: dict[str, _Person] = {}

    def add(self, game: int, person: Departure) -> None:
        """Add a person, who departs in the next step."""
        prefix = self._tiles.prefixes[game]
        name, edges = prefix + person.name, [prefix + edge for edge in person.edges]
        begin_m, end_m = _metres(edges[0], person.position), _metres(edges[-1], person.arrival[1])
        speed_mps = float(person.speed) if person.speed else _AS_ITS_TYPE
        person_type = self._tiles.types.in_sumo(person.vehicle_type)
        libsumo.person.add(name, edges[0], begin_m, depart=libsumo.simulation.getTime(), typeID=person_type)
        libsumo.person.appendWalkingStage(name, edges, arrivalPos=end_m, speed=speed_mps)
        if person.speed_factor is not None:
            libsumo.person.setSpeedFactor(name, person.speed_factor)
        self.inserted[name] = game

    def clear(self, game: int) -> None:
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
                plain = name[len(self._tiles.prefixes[game]) :]
                size_m = person.getLength(name), person.getWidth(name)
                self._on_road[name] = _Person(game, plain, self._tiles.types.plain(person.getTypeID(name)), *size_m)

    def read(self, players: Players) -> Reading:
        """The persons near a player, or all persons if games are recorded."""
        names = sorted(self._on_road, key=lambda name: self._on_road[name].game)  # stable: then by their departures
        of_game = np.array([self._on_road[name].game for name in names], dtype=np.int64)
        fronts_m = self._tiles.points_m(map(_libsumo.person_getPosition, names), of_game)
        is_near = self._recorded | (distance_to_player_m(fronts_m, of_game, players) < NOTICED_M + 1.0)
        near = np.flatnonzero(is_near)
        places = (_libsumo.person_getPosition3D(names[k]) for k in near.tolist())
        near = near[self._tiles.on_level(places, of_game[near])]
        names = [names[k] for k in near.tolist()]
        people = [self._on_road[name] for name in names]
        heading_rad = heading_rad_of(np.fromiter(map(_libsumo.person_getAngle, names), float, len(names)))
        speed_mps = np.fromiter(map(_libsumo.person_getSpeed, names), float, len(names))
        return reading_of(
            len(self._tiles.prefixes),
            of_game[near],
            names=[each.name for each in people],
            types=[each.person_type for each in people],
            motion=(*fronts_m[near].T, heading_rad, speed_mps),
            sizes_m=([each.length_m for each in people], [each.width_m for each in people]),
        )

    def _forget(self, name: str) -> None:
        self.inserted.pop(name, None)
        self._on_road.pop(name, None)


def _metres(edge: str, place: str) -> float:
    length_m = libsumo.lane.getLength(f"{edge}_0")
    drawn = place.endswith(EDGE_SHARE)
    metres = float(place.removesuffix(EDGE_SHARE)) * length_m if drawn else float(place)
    return metres + length_m if metres < 0.0 else metres
