"""The road users that SUMO drives beside the players: when they depart, where they are, when they have arrived.

To ask libsumo for a vehicle's motion costs up to half of what it costs SUMO to move it. So an other that is far from
every player is looked up again only when it may have come near, at the fastest that it and the players can go.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import chain
from typing import Any

import libsumo
import numpy as np
from libsumo import _libsumo  # its functions without the Python function around each: for what is called most

from harness.errors import SimulationError
from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.neighbours import by_game, who_is_near
from harness.traffic.angles import heading_rad_of
from harness.traffic.route_file import Departure
from harness.traffic.simulation import Reading

_LONGEST_WAIT = 50  # steps
_NEVER = -1
_ROOM = 8  # others in a game that there is room for at first


class _Table:
    """What is known of every other, [G, N]: a row for each game, in it a place for each vehicle that departed in it."""

    def __init__(self, games: int) -> None:
        shape = (games, _ROOM)
        self.count = [0] * games  # places that are taken
        self.due = np.full(shape, _NEVER)  # the step to look it up in; never: not in the traffic, or no more
        self.known = np.empty(shape, dtype=object)  # its name in SUMO
        self.name = np.empty(shape, dtype=object)
        self.kind = np.empty(shape, dtype=object)
        self.length_m = np.zeros(shape)
        self.width_m = np.zeros(shape)
        self.max_speed_mps = np.zeros(shape)

    def add(self, game: int, **values: Any) -> int:
        """The place of one more vehicle in a game, which is not to be looked up yet."""
        place = self.count[game]
        if place == self.due.shape[1]:
            self._grow()
        self.count[game] += 1
        self.due[game, place] = _NEVER
        for column, value in values.items():
            getattr(self, column)[game, place] = value
        return place

    def clear(self, game: int) -> None:
        """Forget all vehicles of a game."""
        self.count[game] = 0
        self.due[game] = _NEVER

    def _grow(self) -> None:
        """Twice the room, in whose second half nobody is due."""
        for column, values in vars(self).items():
            if column != "count":
                setattr(self, column, np.concatenate((values, values), axis=1))
        self.due[:, self.due.shape[1] // 2 :] = _NEVER


class BackgroundTraffic:
    """All others of all games. `enter` starts one in SUMO under a name."""

    def __init__(
        self,
        prefixes: Sequence[str],
        offsets_m: FloatArray,
        step_s: float,
        fastest_player_mps: float,
        recorded: bool,
        enter: Callable[[int, str, Departure], None],
    ) -> None:
        self._prefixes, self._offsets_m, self._step_s = prefixes, offsets_m, step_s
        self._fastest_player_mps, self._recorded, self._enter = fastest_player_mps, recorded, enter
        self._step = 0
        self._began = [0] * len(prefixes)
        self._waiting: dict[int, list[Departure]] = {}  # by game, the next one last
        self._there: dict[str, tuple[int, int]] = {}  # the rows and places of all in the traffic, by name in SUMO
        self._table = _Table(len(prefixes))
        self._nobody = self._reading(np.zeros(0, dtype=np.int64), np.zeros((4, 0)))

    def reset(self, game: int, departures: Sequence[Departure]) -> None:
        """A game starts anew: take away who is there, and let others depart as time goes by."""
        if self._table.count[game]:
            for known in self._table.known[game, : self._table.count[game]].tolist():
                if self._there.pop(known, None) is not None:
                    libsumo.vehicle.remove(known)
            self._table.clear(game)
        self._began[game] = self._step
        self._waiting.pop(game, None)
        if departures:
            self._waiting[game] = list(reversed(departures))
            self._depart(game)

    def advance(self) -> None:
        """SUMO has made a step: see who arrived and who has come, and start who is due."""
        self._step += 1
        due = self._table.due
        for name in libsumo.simulation.getArrivedIDList():
            place = self._there.pop(name, None)
            if place is None:
                raise SimulationError(f"SUMO took player {name!r} out of the game")
            due[place] = _NEVER
        if self._there:
            for name in libsumo.simulation.getDepartedIDList():
                if name in self._there:
                    due[self._there[name]] = self._step
        for game in list(self._waiting):
            self._depart(game)

    def read(self, players_x_m: FloatArray, players_y_m: FloatArray, players_there: BoolArray) -> Reading:
        """Who is near the players [G, P] that are there, or everyone if games are recorded."""
        if not self._there:
            return self._nobody
        table = self._table
        due = np.flatnonzero(table.due == self._step)  # by game, and in a game as they departed
        if not len(due):
            return self._nobody
        names = table.known.ravel()[due].tolist()
        fronts = np.fromiter(chain.from_iterable(map(_libsumo.vehicle_getPosition, names)), float, 2 * len(due))
        fronts = fronts.reshape(-1, 2)
        near = who_is_near(
            *(due, fronts, table.due, table.length_m, table.max_speed_mps, self._offsets_m),
            *(players_x_m, players_y_m, players_there, self._fastest_player_mps),
            *(self._step, self._step_s, 1 if self._recorded else _LONGEST_WAIT, self._recorded),
        )
        names = [names[k] for k in near.tolist()]
        motion = np.empty((4, len(near)))
        motion[:2] = fronts[near].T
        motion[2] = np.fromiter(map(_libsumo.vehicle_getAngle, names), float, len(near))
        motion[3] = np.fromiter(map(_libsumo.vehicle_getSpeed, names), float, len(near))
        return self._reading(due[near], motion)

    def _depart(self, game: int) -> None:
        now = (self._step - self._began[game]) * self._step_s + 1e-9
        waiting = self._waiting[game]
        while waiting and waiting[-1].depart_s <= now:
            departure = waiting.pop()
            known, vehicle = self._prefixes[game] + departure.name, libsumo.vehicle
            self._enter(game, known, departure)
            place = self._table.add(
                game,
                known=known,
                name=departure.name,
                kind=vehicle.getTypeID(known),
                length_m=vehicle.getLength(known),
                width_m=vehicle.getWidth(known),
                max_speed_mps=vehicle.getMaxSpeed(known),
            )
            self._there[known] = (game, place)
        if not waiting:
            del self._waiting[game]

    def _reading(self, found: IntArray, motion: FloatArray) -> Reading:
        """Of those found [n], by their places in the table: front x and y, SUMO's angle, and speed, [4, n]."""
        table, (front_x, front_y, angle, speed) = self._table, motion
        length, width, heading = table.length_m.ravel()[found], table.width_m.ravel()[found], heading_rad_of(angle)
        x = front_x - 0.5 * length * np.cos(heading)
        y = front_y - 0.5 * length * np.sin(heading)
        games, room = len(self._prefixes), table.due.shape[1]
        columns, present = by_game(found // room, games, np.stack((x, y, heading, speed, length, width)))
        names, types = (np.full(present.shape, None, dtype=object) for _ in range(2))
        names[present], types[present] = table.name.ravel()[found], table.kind.ravel()[found]
        x_m, y_m, heading_rad, speed_mps, length_m, width_m = columns
        return Reading(names, types, x_m, y_m, heading_rad, speed_mps, length_m, width_m, present)
