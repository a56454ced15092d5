"""A SUMO simulation in this process.

A player that the harness drives is placed with moveToXY, exactly at the arena's pose, on the road or off it. A player
that SUMO drives is inserted here, and its state is read back. This module converts headings to SUMO's angles, and the
reference point from the body's centre to the front bumper.

Removing a vehicle from SUMO's traffic and adding it again takes as long as ten of its steps. A vehicle that is only
moved back to its start loses its route in SUMO. If SUMO drives no vehicle of a game, the lost route has no effect. In
this case players stay in the traffic from game to game, and SUMO's driver models are disabled for them. SUMO then has
the poses of the players, but not always their speeds. If SUMO drives only steady vehicles, such as one that follows the
ego, it looks for the players' lanes along their routes only.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from itertools import repeat

import libsumo
import numpy as np
from libsumo import _libsumo  # the same functions without Python wrappers, for frequent calls

from harness.errors import SimulationError
from harness.game.arrays import FloatArray
from harness.game.geometry import boxes_of
from harness.game.initial_state import InitialState
from harness.game.roles import EGO
from harness.road.demand.route_file import Departure
from harness.road.scene.following import NO_ROAD
from harness.road.xml.angles import compass_deg_of, heading_rad_of
from harness.sumo.background_traffic import BackgroundTraffic
from harness.sumo.insertion import (
    Insertion,
    StandingVehicles,
    clear_of,
    clear_of_players,
    drive_as,
    with_follower,
)
from harness.sumo.loaded_sumo import LoadedSumo
from harness.sumo.road_signals import Signals, SpeedLimits
from harness.sumo.scene_games import SceneGames
from harness.sumo.simulation import NO_SIGNALS, TURN_SIGNALS, AtReset, Reading, Simulation

# Options of moveToXY: keepRoute, and the distance within which SUMO looks for a lane. keepRoute's bit 2 places the car
# exactly, on the road or off it. Its bit 1 limits the search to lanes of the car's route.
_ON_ANY_LANE = (2, 100.0)  # SUMO's default distance
_ON_ITS_ROUTE = (2 | 1, 10.0)
_ANY_EDGE, _ANY_LANE = repeat(""), repeat(-1)
_NO_ACTIONS_S = 1e6  # an action step longer than any game: disables SUMO's driver model for a car
_ANY_SPEED = 100.0  # a speed factor: other vehicles see at most the speed limit times this


class LibsumoSimulation(Simulation):
    """A SUMO simulation in this process, alone or beside others (`side_by_side`). `close`, or the end of this object
    and those beside it, releases libsumo."""

    @classmethod
    def side_by_side(cls, parts: Sequence[SceneGames], seed: int) -> list[LibsumoSimulation]:
        """Load SUMO with the games of several simulations that can share it (`can_share`). Before one of them is
        stepped, all have placed their players; to close one is to close all.

        Raises SimulationError if SUMO refuses or is in use.
        """
        sumo = LoadedSumo(parts, seed)
        try:
            return [cls(games, sumo, number) for number, games in enumerate(parts)]
        except SimulationError:
            sumo.close()
            raise

    def __init__(self, games: SceneGames, sumo: LoadedSumo, number: int) -> None:
        """The games are the part of SUMO with this number."""
        self._scene, self._games, self._taken_over = games.scene, games.games, games.taken_over
        self._recorded, self._steady = games.recorded, games.steady
        self._sumo, self._number, self._tiles = sumo, number, sumo.tiles[number]
        self._move_options = _ON_ITS_ROUTE if self._steady else _ON_ANY_LANE
        self._half_length = 0.5 * games.scene.world.length_m
        self._begin()

    def _begin(self) -> None:
        """Begin with the traffic that SUMO has loaded."""
        self._loads, self._steps = self._sumo.loads, self._sumo.steps
        self._traffic = Insertion(self._tiles.types)
        self._placed: dict[str, int] = {}  # players placed by the arena, by name in SUMO: index in a flat [G, P]
        self._sumo_driven: dict[str, tuple[int, int]] = {}  # players that SUMO drives: game and player
        self._present = np.zeros((self._games, len(self._taken_over)), dtype=bool)
        self._insertions = [self._insertion(player) for player in range(len(self._taken_over))]
        world, prefixes = self._scene.world, self._tiles.prefixes
        self._signals = Signals(prefixes, world.right_of_way.signal_links)
        self._speed_limits = SpeedLimits(prefixes) if self._scene.document.varies.speed_limit_share else None
        self._players_only = [self._steady] * self._games  # whether SUMO drives no vehicle of the game
        others = self._scene.road_behind is not NO_ROAD or self._scene.has_background_traffic
        blocks = bool(self._scene.obstacles.each) and (others or not self._steady)
        self._standing = StandingVehicles(self._scene, prefixes, self._traffic) if blocks else None
        fastest_mps = float(world.actuators.max_speed_mps.max())
        self._background = BackgroundTraffic(
            self._tiles, self._traffic, step_s=world.step_s, fastest_player_mps=fastest_mps, recorded=self._recorded
        )

    def reload(self, seed: int) -> None:
        if self._loads == self._sumo.loads:  # none of the simulations beside it has been reloaded yet
            self._sumo.reload(seed)
        self._begin()

    def reset(self, game: int, start: InitialState, departures: list[Departure]) -> AtReset:
        with self._sumo.calls(f"reset game {game}"):
            length_m = self._scene.world.length_m
            departures = clear_of_players(departures, start, length_m)
            follower = self._scene.road_behind.follower(start, length_m[EGO])
            if follower is not None:
                departures = with_follower(departures, follower, start, length_m)
            before, players_only = self._players_only[game], self._steady and not departures
            self._players_only[game] = players_only
            staying = self._present[game] & start.present & before & players_only
            for player in np.flatnonzero(self._present[game] & ~staying).tolist():
                self._remove_vehicle(game, player)
            for player in np.flatnonzero(start.present & ~staying).tolist():
                self._add_player(game, player, start)
            if self._standing is not None:
                self._standing.reset(game, *start.parts)
                departures = clear_of(departures, boxes_of(self._scene.obstacles.boxes(*start.parts)))
            background = self._background.reset(game, departures)
            if self._speed_limits is not None:
                self._speed_limits.reset(game, start.limit_share)
            at_reset = self._signals.reset(game, start.signal_place) if self._signals else NO_SIGNALS
            return at_reset if background is None else at_reset._replace(background=background)

    def halt(self, game: int, player: int) -> None:
        if self._taken_over[player]:
            return
        name = self._name(game, player)
        self._sumo_driven.pop(name, None)
        self._placed[name] = game * len(self._taken_over) + player

    def remove(self, game: int, player: int) -> None:
        """Remove a player from the traffic. If SUMO drives no vehicle of its game, it stays until the next reset."""
        if not self._players_only[game]:
            with self._sumo.calls(f"remove a player from game {game}"):
                self._remove_vehicle(game, player)

    def _remove_vehicle(self, game: int, player: int) -> None:
        name = self._name(game, player)
        libsumo.vehicle.remove(name)
        self._present[game, player] = False
        self._sumo_driven.pop(name, None)
        self._placed.pop(name, None)

    def place(self, x_m: FloatArray, y_m: FloatArray, heading_rad: FloatArray) -> None:
        self._poses = x_m, y_m
        seats = np.fromiter(self._placed.values(), np.int64, len(self._placed))
        in_tiles_y_m = y_m + self._half_length * np.sin(heading_rad) + self._tiles.offsets_m[:, None]
        front_x = (x_m + self._half_length * np.cos(heading_rad)).ravel()[seats].tolist()
        front_y = in_tiles_y_m.ravel()[seats].tolist()
        angle = compass_deg_of(heading_rad).ravel()[seats].tolist()
        with self._sumo.calls("step"):
            targets = (_ANY_EDGE, _ANY_LANE, front_x, front_y, angle, *map(repeat, self._move_options))
            deque(map(_libsumo.vehicle_moveToXY, self._placed, *targets), maxlen=0)  # faster than a loop
        self._sumo.placed.add(self._number)

    def step(self) -> Reading:
        with self._sumo.calls("step"):
            if self._steps == self._sumo.steps:  # none of the simulations beside it has been stepped yet
                self._sumo.step()
            self._steps += 1
            self._background.advance()
            x_m, y_m = self._poses
            players = self._read_players()
            if players is not None:
                x_m = np.where(np.isnan(players[..., 0]), x_m, players[..., 0])
                y_m = np.where(np.isnan(players[..., 1]), y_m, players[..., 1])
            reading = self._background.read((x_m, y_m, self._present))
            if not self._signals:
                return reading if players is None else replace(reading, players=players)
            texts = self._signals.texts() if self._recorded else None
            return replace(reading, players=players, signals=self._signals.read(), signal_texts=texts)

    def turn_signals(self, vehicles: Sequence[tuple[int, str]]) -> list[str]:
        with self._sumo.calls("read turn signals"):
            codes = (libsumo.vehicle.getSignals(self._tiles.prefixes[game] + name) for game, name in vehicles)
            return [TURN_SIGNALS[code % len(TURN_SIGNALS)] for code in codes]

    def close(self) -> None:
        self._sumo.close()

    def _name(self, game: int, player: int) -> str:
        return self._tiles.prefixes[game] + self._scene.world.roles[player]

    def _add_player(self, game: int, player: int, start: InitialState) -> None:
        name, speed = self._name(game, player), float(start.speed_mps[player])
        vehicle_type, lane, fastest = self._insertions[player]
        on_lane = lane is not None and not np.isnan(start.position_m[player])
        self._traffic.add(
            self._tiles.prefixes[game],
            name,
            edges=self._scene.edges[player],
            vehicle_type=vehicle_type,
            lane=str(lane) if on_lane else "best",
            position=str(start.position_m[player]) if on_lane else "base",
            speed=str(min(speed, fastest)),
        )
        self._present[game, player] = True
        ahead = self._half_length[player]
        if self._taken_over[player]:
            self._placed[name] = game * len(self._taken_over) + player
            if self._players_only[game]:
                libsumo.vehicle.setActionStepLength(name, _NO_ACTIONS_S)
            else:
                libsumo.vehicle.setSpeedFactor(name, _ANY_SPEED)
        else:
            self._sumo_driven[name] = (game, player)
            if start.ordinary_driver is not None and player != EGO:
                drive_as(name, start.ordinary_driver)
            ahead += speed * self._scene.world.step_s  # SUMO does not move a vehicle in the step of its insertion
        heading = float(start.heading_rad[player])
        x = float(start.x_m[player] + ahead * np.cos(heading))
        y = float(start.y_m[player] + ahead * np.sin(heading) + self._tiles.offsets_m[game])
        options = self._move_options if self._taken_over[player] else _ON_ITS_ROUTE
        # moveToXY puts the vehicle in the traffic at once; without it, the vehicle would wait for free space
        libsumo.vehicle.moveToXY(name, "", -1, x, y, float(compass_deg_of(heading)), *options)

    def _insertion(self, player: int) -> tuple[str, str | None, float]:
        """A player's vehicle type, its start lane (None: its start is along its route), and the largest speed at which
        SUMO inserts it: the speed limit for its type, or the speed that its type desires."""
        routes, types = self._scene.world.road.routes, libsumo.vehicletype
        vehicle_type = self._scene.vehicle(player).vehicle_type
        desired = self._scene.routes.types[vehicle_type].desired_speed_mps
        lane = self._scene.document.players[player].lane
        legal = float(routes.speed_limit_mps[routes.first_row[player]])
        in_sumo = self._tiles.types.in_sumo(vehicle_type)
        obeyed = min(legal, desired) * min(1.0, types.getSpeedFactor(in_sumo))
        return vehicle_type, lane and lane.rsplit("_", 1)[1], float(min(obeyed, types.getMaxSpeed(in_sumo)))

    def _read_players(self) -> FloatArray | None:
        """[G, P, 4] x_m, y_m, heading_rad and speed_mps of the players that SUMO drives; None if it drives none."""
        if all(self._taken_over):
            return None
        players = np.full((*self._present.shape, 4), np.nan)
        for name, seat in self._sumo_driven.items():
            x, y = libsumo.vehicle.getPosition(name)
            if x < -1e6:
                raise SimulationError(f"SUMO has not inserted {name!r}")
            players[seat] = (x, y, libsumo.vehicle.getAngle(name), libsumo.vehicle.getSpeed(name))
        players[..., 2] = heading_rad_of(players[..., 2])
        players[..., 0] -= self._half_length * np.cos(players[..., 2])
        players[..., 1] -= self._half_length * np.sin(players[..., 2]) + self._tiles.offsets_m[:, None]
        return players
