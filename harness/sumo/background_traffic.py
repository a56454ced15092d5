"""Background traffic: departures, motion and arrivals of the vehicles that SUMO drives beside the players.

Persons on foot depart with them; `background_people` reads them.

Reading a vehicle's motion from libsumo costs up to half of SUMO's own work on it. A vehicle that is far from every
player is therefore read again only when it may have come near, at the top speeds of vehicle and players.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple
from typing import Any

import libsumo
import numpy as np
from libsumo import _libsumo  # the same functions without Python wrappers

from harness.errors import SimulationError
from harness.game.arrays import FloatArray, IntArray
from harness.road.demand.route_file import Departure
from harness.road.xml.angles import heading_rad_of
from harness.sumo.background_people import BackgroundPeople
from harness.sumo.insertion import Insertion, put_beside
from harness.sumo.simulation import Players, Reading, Tiles, reading_of, side_by_side
from harness.sumo.vehicle_reads import NearSearch, read_near

_LONGEST_WAIT = 50  # steps
_NEVER = -1
_ROOM = 8  # initial number of vehicles per game


class _Table:
    """The background vehicles of all games, [G, N]: a row for each game, a place for each vehicle that departed."""

    def __init__(self, games: int) -> None:
        shape = (games, _ROOM)
        self.count = [0] * games  # places taken
        self.due = np.full(shape, _NEVER)  # the step in which to read it; _NEVER while it is not in the traffic
        self.sumo_name = np.empty(shape, dtype=object)
        self.name = np.empty(shape, dtype=object)  # without the prefix of the tile
        self.kind = np.empty(shape, dtype=object)
        self.length_m = np.zeros(shape)
        self.width_m = np.zeros(shape)
        self.max_speed_mps = np.zeros(shape)

    def add(self, game: int, **values: Any) -> int:
        """Add a vehicle that is not in the traffic yet to a game. Returns its place."""
        place = self.count[game]
        if place == self.due.shape[1]:
            self._grow()
        self.count[game] += 1
        self.due[game, place] = _NEVER
        for column, value in values.items():
            getattr(self, column)[game, place] = value
        return place

    def clear(self, game: int) -> None:
        self.count[game] = 0
        self.due[game] = _NEVER

    def _grow(self) -> None:
        for column, values in vars(self).items():
            if column != "count":
                setattr(self, column, np.concatenate((values, values), axis=1))
        self.due[:, self.due.shape[1] // 2 :] = _NEVER


class BackgroundTraffic:
    def __init__(
        self, tiles: Tiles, insertion: Insertion, *, step_s: float, fastest_player_mps: float, recorded: bool
    ) -> None:
        self._tiles, self._insertion, self._recorded = tiles, insertion, recorded
        self._step_s, self._fastest_player_mps = step_s, fastest_player_mps
        self._step = 0
        games = len(tiles.prefixes)
        self._first_step = [0] * games
        self._waiting: dict[int, list[Departure]] = {}  # by game, the next departure last
        self._places: dict[str, tuple[int, int]] = {}  # row and place of each vehicle in SUMO, by its name there
        self._beside: dict[str, Departure] = {}  # vehicles that are to depart beside the middle of their lane
        self._table = _Table(games)
        self._people = BackgroundPeople(tiles, recorded=recorded)
        self._empty_reading = self._reading(np.zeros(0, dtype=np.int64), np.zeros((4, 0)))

    def reset(self, game: int, departures: Sequence[Departure]) -> Reading | None:
        """Reset a game: remove its vehicles, and insert the departures of the next game at their times.

        Returns the vehicles of a warm-up, which are on the road at once, [1, M]; None without any.
        """
        if self._table.count[game]:
            for sumo_name in self._table.sumo_name[game, : self._table.count[game]].tolist():
                if self._places.pop(sumo_name, None) is not None:
                    self._beside.pop(sumo_name, None)
                    libsumo.vehicle.remove(sumo_name)
            self._table.clear(game)
        if self._people.inserted:
            self._people.clear(game)
        self._first_step[game] = self._step
        self._waiting.pop(game, None)
        if not departures:
            return None
        self._waiting[game] = list(reversed(departures))
        self._depart(game)
        return self._warmed_up(game, departures)

    def advance(self) -> None:
        """Process a step of SUMO: arrivals, vehicles that entered the traffic, and departures that are due."""
        self._step += 1
        due = self._table.due
        for name in _libsumo.simulation_getArrivedIDList():
            place = self._places.pop(name, None)
            if place is not None:
                due[place] = _NEVER
            elif self._tiles.has(name):
                raise SimulationError(f"SUMO removed player {name!r} from the traffic")
        if self._places:
            for name in _libsumo.simulation_getDepartedIDList():
                if name in self._places:
                    due[self._places[name]] = self._step
                    if name in self._beside:
                        put_beside(name, self._beside.pop(name))
        if self._people.inserted:
            self._people.advance()
        for game in list(self._waiting):
            self._depart(game)

    def read(self, players: Players) -> Reading:
        """The vehicles and persons near a player, or all if games are recorded."""
        vehicles = self._read_vehicles(players)
        return side_by_side(vehicles, self._people.read(players)) if self._people.inserted else vehicles

    def _read_vehicles(self, players: Players) -> Reading:
        table = self._table
        if not self._places or not len(due := np.flatnonzero(table.due == self._step)):  # by game, then by departure
            return self._empty_reading
        search = NearSearch(
            *(table.due, table.length_m, table.max_speed_mps, self._tiles.offsets_m, *players),
            *(self._fastest_player_mps, self._step, self._step_s),
            *(1 if self._recorded else _LONGEST_WAIT, self._recorded),
        )
        places, motion = read_near(search, table.sumo_name, due)
        if self._tiles.roads_m is None:
            return self._reading(places, motion)
        points = map(_libsumo.vehicle_getPosition3D, table.sumo_name.ravel()[places].tolist())
        near = self._tiles.on_level(points, places // table.due.shape[1])
        return self._reading(places[near], motion[:, near])

    def _reading(self, places: IntArray, motion: FloatArray) -> Reading:
        """The reading of vehicles at flat places [n] of the table; motion [4, n] is front x, y, SUMO's angle, speed."""
        table, (front_x_m, front_y_m, angle_deg, speed_mps) = self._table, motion
        return reading_of(
            len(self._first_step),
            places // table.due.shape[1],
            names=table.name.ravel()[places],
            types=table.kind.ravel()[places],
            motion=(front_x_m, front_y_m, heading_rad_of(angle_deg), speed_mps),
            sizes_m=(table.length_m.ravel()[places], table.width_m.ravel()[places]),
        )

    def _warmed_up(self, game: int, departures: Sequence[Departure]) -> Reading | None:
        """The vehicles of a warm-up among the departures that are on the level of the players' roads, [1, M]."""
        moving = [(each, each.motion) for each in departures if each.motion is not None and not each.on_foot]
        places = (_libsumo.vehicle_getPosition3D(self._tiles.prefixes[game] + each.name) for each, _ in moving)
        on_level = self._tiles.on_level(places, np.full(len(moving), game))
        vehicles = [vehicle for vehicle, kept in zip(moving, on_level.tolist(), strict=True) if kept]
        if not vehicles:
            return None
        *motion, length_m, width_m = np.array([astuple(each) for _, each in vehicles]).T
        return reading_of(
            1,
            np.zeros(len(vehicles), dtype=np.int64),
            names=[each.name for each, _ in vehicles],
            types=[each.vehicle_type for each, _ in vehicles],
            motion=motion,
            sizes_m=(length_m, width_m),
        )

    def _depart(self, game: int) -> None:
        now = (self._step - self._first_step[game]) * self._step_s + 1e-9
        waiting = self._waiting[game]
        while waiting and waiting[-1].depart_s <= now:
            departure = waiting.pop()
            if departure.on_foot:
                self._people.add(game, departure)
                continue
            sumo_name, vehicle = self._tiles.prefixes[game] + departure.name, libsumo.vehicle
            self._insertion.depart(self._tiles.prefixes[game], sumo_name, departure)
            place = self._table.add(
                game,
                sumo_name=sumo_name,
                name=departure.name,
                kind=departure.vehicle_type,
                length_m=vehicle.getLength(sumo_name),
                width_m=vehicle.getWidth(sumo_name),
                max_speed_mps=vehicle.getMaxSpeed(sumo_name),
            )
            self._places[sumo_name] = (game, place)
            if departure.motion is not None:  # in the traffic already: SUMO does not announce its departure
                self._table.due[game, place] = self._step + 1
            elif departure.lateral:
                self._beside[sumo_name] = departure
        if not waiting:
            del self._waiting[game]
