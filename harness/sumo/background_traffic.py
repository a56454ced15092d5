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
from numpy.typing import NDArray

from harness.errors import SimulationError
from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.near_players import NearSearch, rows_by_game
from harness.road.demand.route_file import Departure
from harness.road.net.levels import on_players_level
from harness.road.xml.angles import heading_rad_of
from harness.sumo.background_people import BackgroundPeople
from harness.sumo.insertion import Insertion, put_beside
from harness.sumo.simulation import Reading, side_by_side
from harness.sumo.vehicle_reads import DIRECT, read_near, string_record

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
        self.sumo_text = np.empty(shape, dtype=object)  # the bytes of that name, which the records point to
        self.sumo_record = np.zeros((*shape, 4), dtype=np.uint64)
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
        """Remove all vehicles of a game."""
        self.count[game] = 0
        self.due[game] = _NEVER

    def _grow(self) -> None:
        """Double the number of places; the new ones are empty."""
        for column, values in vars(self).items():
            if column != "count":
                setattr(self, column, np.concatenate((values, values), axis=1))
        self.due[:, self.due.shape[1] // 2 :] = _NEVER


class BackgroundTraffic:
    """The background traffic of all games."""

    def __init__(
        self,
        *,
        prefixes: Sequence[str],
        offsets_m: FloatArray,
        step_s: float,
        fastest_player_mps: float,
        recorded: bool,
        insertion: Insertion,
        roads_m: FloatArray | None = None,
    ) -> None:
        """`roads_m` are the points [n, 3] of the players' roads: vehicles on other levels are left out of readings."""
        self._prefixes, self._offsets_m, self._step_s = prefixes, offsets_m, step_s
        self._fastest_player_mps, self._recorded, self._insertion = fastest_player_mps, recorded, insertion
        self._roads_m = roads_m
        self.standing = 0
        """Vehicles in SUMO that stand for obstacles."""
        self._step = 0
        self._first_step = [0] * len(prefixes)
        self._waiting: dict[int, list[Departure]] = {}  # by game, the next departure last
        self._places: dict[str, tuple[int, int]] = {}  # row and place of each vehicle in SUMO, by its name there
        self._beside: dict[str, Departure] = {}  # vehicles that are to depart beside the middle of their lane
        self._table = _Table(len(prefixes))
        self._people = BackgroundPeople(prefixes=prefixes, offsets_m=offsets_m, recorded=recorded, roads_m=roads_m)
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
        return _warmed_up(self._on_level(game, departures))

    def advance(self) -> None:
        """Process a step of SUMO: arrivals, vehicles that entered the traffic, and departures that are due."""
        self._step += 1
        due = self._table.due
        for name in _libsumo.simulation_getArrivedIDList():
            place = self._places.pop(name, None)
            if place is None:
                raise SimulationError(f"SUMO removed player {name!r} from the traffic")
            due[place] = _NEVER
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

    def read(self, players_x_m: FloatArray, players_y_m: FloatArray, players_present: BoolArray) -> Reading:
        """The vehicles and persons near the players [G, P] that are present, or all if games are recorded."""
        vehicles = self._read_vehicles(players_x_m, players_y_m, players_present)
        if not self._people.inserted:
            return vehicles
        return side_by_side(vehicles, self._people.read(players_x_m, players_y_m, players_present))

    def _read_vehicles(self, players_x_m: FloatArray, players_y_m: FloatArray, players_present: BoolArray) -> Reading:
        if not self._places:
            return self._empty_reading
        table = self._table
        due = np.flatnonzero(table.due == self._step)  # by game, then by departure
        if not len(due):
            return self._empty_reading
        search = NearSearch(
            *(table.due, table.length_m, table.max_speed_mps, self._offsets_m),
            *(players_x_m, players_y_m, players_present, self._fastest_player_mps),
            *(self._step, self._step_s, 1 if self._recorded else _LONGEST_WAIT, self._recorded),
        )
        direct = DIRECT and self._sumo_has_all(players_present)
        places, motion = read_near(search, table.sumo_name, records=table.sumo_record, due=due, direct=direct)
        if self._roads_m is not None and len(places):
            names, games = table.sumo_name.ravel()[places], places // table.due.shape[1]
            near = on_players_level(self._roads_m, self._points(names, games))
            places, motion = places[near], np.ascontiguousarray(motion[:, near])
        return self._reading(places, motion)

    def _points(self, sumo_names: NDArray[np.object_], games: IntArray) -> FloatArray:
        """[m, 3] where vehicles are, with their heights, in the coordinates of the net."""
        points = np.array([_libsumo.vehicle_getPosition3D(name) for name in sumo_names.tolist()]).reshape(-1, 3)
        points[:, 1] -= self._offsets_m[games]
        return points

    def _on_level(self, game: int, departures: Sequence[Departure]) -> list[Departure]:
        """The vehicles of the warm-up among the departures that are on the level of the players' roads."""
        vehicles = [each for each in departures if each.motion is not None and not each.on_foot]
        if self._roads_m is None or not vehicles:
            return vehicles
        names = np.array([self._prefixes[game] + each.name for each in vehicles], dtype=object)
        near = on_players_level(self._roads_m, self._points(names, np.full(len(names), game)))
        return [each for each, kept in zip(vehicles, near.tolist(), strict=True) if kept]

    def _sumo_has_all(self, players_present: BoolArray) -> bool:
        """Whether SUMO has as many vehicles and persons as were inserted and have neither arrived nor been removed."""
        others = np.count_nonzero(players_present) + self.standing + len(self._people.inserted)
        return _libsumo.simulation_getMinExpectedNumber() == len(self._places) + others

    def _depart(self, game: int) -> None:
        now = (self._step - self._first_step[game]) * self._step_s + 1e-9
        waiting = self._waiting[game]
        while waiting and waiting[-1].depart_s <= now:
            departure = waiting.pop()
            if departure.on_foot:
                self._people.add(game, departure)
                continue
            sumo_name, vehicle = self._prefixes[game] + departure.name, libsumo.vehicle
            sumo_text = sumo_name.encode()
            self._insertion.depart(self._prefixes[game], sumo_name, departure)
            place = self._table.add(
                game,
                sumo_name=sumo_name,
                sumo_text=sumo_text,
                sumo_record=string_record(sumo_text),
                name=departure.name,
                kind=vehicle.getTypeID(sumo_name),
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

    def _reading(self, places: IntArray, motion: FloatArray) -> Reading:
        """The reading of vehicles at flat places [n] of the table; motion [4, n] is front x, y, SUMO's angle, speed."""
        table, (front_x, front_y, angle, speed) = self._table, motion
        length, heading = table.length_m.ravel()[places], heading_rad_of(angle)
        x = front_x - 0.5 * length * np.cos(heading)
        y = front_y - 0.5 * length * np.sin(heading)
        columns, present, index = rows_by_game(places, (x, y, heading, speed), (table.length_m, table.width_m))
        names, types = (_in_rows(words, places, index) for words in (table.name, table.kind))
        x_m, y_m, heading_rad, speed_mps, length_m, width_m = columns
        return Reading(names, types, x_m, y_m, heading_rad, speed_mps, length_m, width_m, present)


def _warmed_up(departures: Sequence[Departure]) -> Reading | None:
    """The vehicles of a warm-up among the departures of a game, [1, M]; None without any."""
    vehicles = [(each, each.motion) for each in departures if each.motion is not None]
    if not vehicles:
        return None
    names, types = np.array([(each.name, each.vehicle_type) for each, _ in vehicles], dtype=object).T[:, None]
    front_x, front_y, heading, speed, length, width = np.array([astuple(motion) for _, motion in vehicles]).T[:, None]
    x, y = front_x - 0.5 * length * np.cos(heading), front_y - 0.5 * length * np.sin(heading)
    return Reading(names, types, x, y, heading, speed, length, width, np.ones((1, len(vehicles)), dtype=bool))


def _in_rows(words: NDArray[np.object_], places: IntArray, index: IntArray) -> NDArray[np.object_]:
    """[G, M] the words [G, N] of vehicles at flat places [n] in rows of their indices [G, M]; None where it is n."""
    of_vehicles = np.empty(len(places) + 1, dtype=object)  # filled with None
    of_vehicles[:-1] = words.ravel()[places]
    rows: NDArray[np.object_] = of_vehicles[index]
    return rows
