"""The simulation of this process: libsumo, which has room for one.

A player that the harness takes over is placed with moveToXY(keepRoute=2): exactly where the arena says, on the road
or off it. A player left to SUMO is started here and its state read back. At this border headings become SUMO's
compass angles, and the reference point moves from the body's centre to the front bumper.
"""

from __future__ import annotations

import tempfile
import weakref
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import libsumo
import numpy as np

from harness.errors import SimulationError
from harness.game.arrays import FloatArray
from harness.game.start import Start
from harness.game.state import ROLES
from harness.traffic.opening import OpenScene
from harness.traffic.route_file import Departure
from harness.traffic.simulation import Reading
from harness.traffic.tiles import tile_offset_m, tile_prefix, tiled_net

_EXACTLY_THERE = 2  # moveToXY's keepRoute: the position as given, even off the road
_ANY_SPEED = 100.0  # a speed factor: SUMO would show the others no speed above the limit times this
_FAILURES = (libsumo.TraCIException, libsumo.FatalTraCIError)


@dataclass
class _Tile:
    """One game's corner of the simulation."""

    prefix: str
    offset_m: float
    step: int = 0
    inside: set[int] = field(default_factory=set)  # players that SUMO knows
    placed: set[int] = field(default_factory=set)  # those of them that stand and go as the arena says
    others: dict[str, tuple[str, float, float]] = field(default_factory=dict)  # name -> type, length, width
    due: list[Departure] = field(default_factory=list)


class LocalSimulation:
    """The simulation of this process. It is given back by `close`, or when nobody refers to it any more."""

    @staticmethod
    def in_use() -> bool:
        """Whether this process's libsumo is taken, by one of us or by the user's own code."""
        return libsumo.isLoaded()

    def __init__(self, scene: OpenScene, games: int, taken_over: Sequence[bool], seed: int) -> None:
        """Load SUMO with a tile for each game. Raises SimulationError if SUMO refuses, or is in use already."""
        if self.in_use():
            raise SimulationError("this process has a libsumo simulation already")
        self._scene, self._games, self._taken_over = scene, games, tuple(taken_over)
        self._players = range(len(self._taken_over))
        self._half_length = 0.5 * scene.world.length_m
        offset = tile_offset_m(scene.net_file, games)
        self._offsets = offset * np.arange(games)
        folder = tempfile.TemporaryDirectory(prefix="harness-sumo-")
        types = Path(folder.name) / "types.rou.xml"
        types.write_text(scene.routes.types_xml, encoding="utf-8")
        document = scene.document
        # Taken-over cars that leave a junction's lanes may kill SUMO 1.28 (SIGSEGV) if lane changes take time: they
        # do so only where there is somebody whom SUMO drives.
        smoothly = not all(self._taken_over) or _has_others(scene)
        self._options = [
            *("--net-file", str(tiled_net(scene.net_file, games)), "--route-files", str(types)),
            *("--step-length", str(document.step_length_s), "--collision.action", "none"),
            *("--lanechange.duration", str(document.lane_change_duration_s if smoothly else 0.0)),
            *("--time-to-teleport", "-1", "--no-step-log", "--no-warnings", "--xml-validation", "never"),
        ]
        self._release = weakref.finalize(self, _release, folder)
        try:
            self._load(["sumo", *self._options, "--seed", str(seed)], libsumo.start)
        except SimulationError:
            self.close()
            raise

    def _load(self, options: list[str], load: Callable[[list[str]], object]) -> None:
        with self._asking(f"load scene {self._scene.document.name!r}"):
            load(options)
        self._tiles = [_Tile(tile_prefix(game, self._games), float(self._offsets[game])) for game in range(self._games)]
        self._routes: set[str] = set()
        self._owners: dict[str, tuple[_Tile, str]] = {}

    def reload(self, seed: int) -> None:
        """Start SUMO anew, with its random numbers from `seed`: every game has to be started again."""
        self._load([*self._options, "--seed", str(seed)], libsumo.load)

    def restart(self, game: int, start: Start, departures: list[Departure]) -> None:
        """Clear a game's tile and put its players at their start; others depart as time goes by."""
        tile = self._tiles[game]
        with self._asking(f"start game {game}"):
            for player in list(tile.inside):
                self.remove(game, player)
            for name in tile.others:
                libsumo.vehicle.remove(tile.prefix + name)
                del self._owners[tile.prefix + name]
            tile.others.clear()
            tile.step, tile.due = 0, departures
            for player in np.flatnonzero(start.present):
                self._add_player(tile, int(player), start)
            self._depart(tile)

    def halt(self, game: int, player: int) -> None:
        """Whoever drove a player, from now on it stands where `step` says."""
        self._tiles[game].placed.add(player)

    def remove(self, game: int, player: int) -> None:
        """Take a player out of the traffic."""
        tile = self._tiles[game]
        with self._asking(f"remove a player from game {game}"):
            libsumo.vehicle.remove(tile.prefix + ROLES[player])
        tile.inside.discard(player)
        tile.placed.discard(player)

    def step(self, x_m: FloatArray, y_m: FloatArray, heading_rad: FloatArray) -> Reading:
        """Place the players that are taken over at poses [G, P] of their centres, let SUMO step, read the rest."""
        front_x = (x_m + self._half_length * np.cos(heading_rad)).tolist()
        front_y = (y_m + self._half_length * np.sin(heading_rad) + self._offsets[:, None]).tolist()
        angle = _compass(heading_rad).tolist()
        move = libsumo.vehicle.moveToXY
        with self._asking("step"):
            for game, tile in enumerate(self._tiles):
                xs, ys, angles = front_x[game], front_y[game], angle[game]
                for player in tile.placed:
                    name = tile.prefix + ROLES[player]
                    move(name, "", -1, xs[player], ys[player], angles[player], _EXACTLY_THERE)
            libsumo.simulationStep()
            self._forget_arrived()
            for tile in self._tiles:
                tile.step += 1
                if tile.due:
                    self._depart(tile)
            return self._read()

    def close(self) -> None:
        """Give libsumo back to the process. Closing twice is closing once."""
        self._release()

    @contextmanager
    def _asking(self, what: str) -> Iterator[None]:
        if not self._release.alive:
            raise SimulationError(f"SUMO can't {what}: this simulation was closed")
        try:
            yield
        except _FAILURES as error:
            raise SimulationError(f"SUMO could not {what}: {error}") from error

    def _add_player(self, tile: _Tile, player: int, start: Start) -> None:
        name, speed = tile.prefix + ROLES[player], float(start.speed_mps[player])
        vehicle, lane = self._scene.vehicle(player), self._scene.document.players[player].lane
        self._add(
            tile,
            name,
            self._scene.edges[player],
            vehicle.vehicle_type,
            lane.rsplit("_", 1)[1],
            str(start.position_m[player]),
            str(min(speed, self._fastest_start_mps(player, vehicle.vehicle_type))),
        )
        tile.inside.add(player)
        ahead = self._half_length[player]
        if self._taken_over[player]:
            tile.placed.add(player)
            libsumo.vehicle.setSpeedFactor(name, _ANY_SPEED)
        else:
            ahead += speed * self._scene.world.step_s  # SUMO moves nobody in the step it starts them
        heading = float(start.heading_rad[player])
        x = float(start.x_m[player] + ahead * np.cos(heading))
        y = float(start.y_m[player] + ahead * np.sin(heading) + tile.offset_m)
        # Placed there it is in the traffic at once; only added, it would have to wait for room.
        libsumo.vehicle.moveToXY(name, "", -1, x, y, float(_compass(heading)), _EXACTLY_THERE)

    def _fastest_start_mps(self, player: int, kind: str) -> float:
        """SUMO refuses to start a vehicle above what its type keeps to on the road it starts on."""
        routes, types = self._scene.world.road.routes, libsumo.vehicletype
        legal = float(routes.speed_limit_mps[routes.first_row[player]])
        return float(min(legal * min(1.0, types.getSpeedFactor(kind)), types.getMaxSpeed(kind)))

    def _depart(self, tile: _Tile) -> None:
        now = tile.step * self._scene.world.step_s + 1e-9
        while tile.due and tile.due[0].depart_s <= now:
            other = tile.due.pop(0)
            name = tile.prefix + other.name
            self._add(tile, name, other.edges, other.vehicle_type, other.lane, other.position, other.speed)
            length, width = libsumo.vehicle.getLength(name), libsumo.vehicle.getWidth(name)
            tile.others[other.name] = (libsumo.vehicle.getTypeID(name), length, width)
            self._owners[name] = (tile, other.name)

    def _add(
        self, tile: _Tile, name: str, edges: Sequence[str], kind: str, lane: str, position: str, speed: str
    ) -> None:
        route = tile.prefix + "route " + " ".join(edges)
        if route not in self._routes:
            libsumo.route.add(route, [tile.prefix + edge for edge in edges])
            self._routes.add(route)
        libsumo.vehicle.add(name, route, kind, "now", lane, position, speed)

    def _forget_arrived(self) -> None:
        for name in libsumo.simulation.getArrivedIDList():
            owner = self._owners.pop(name, None)
            if owner is None:
                raise SimulationError(f"SUMO took player {name!r} out of the game")
            del owner[0].others[owner[1]]

    def _read(self) -> Reading:
        vehicle = libsumo.vehicle
        players = np.full((self._games, len(self._players), 4), np.nan)
        for player in self._players:
            if not self._taken_over[player]:
                for game, tile in enumerate(self._tiles):
                    if player in tile.inside - tile.placed:
                        players[game, player] = self._state_of(tile.prefix + ROLES[player])
        most = max(len(tile.others) for tile in self._tiles)
        values = np.zeros((self._games, most, 6))
        present = np.zeros((self._games, most), dtype=bool)
        for game, tile in enumerate(self._tiles):
            for slot, (name, (_, length, width)) in enumerate(tile.others.items()):
                known = tile.prefix + name
                x, y = vehicle.getPosition(known)
                values[game, slot] = (x, y, vehicle.getAngle(known), vehicle.getSpeed(known), length, width)
                present[game, slot] = x > -1e6  # not yet inserted: SUMO's invalid value
        heading = _mathematical(values[..., 2])
        half = 0.5 * values[..., 4]
        return Reading(
            [list(tile.others) for tile in self._tiles],
            [[kind for kind, _, _ in tile.others.values()] for tile in self._tiles],
            values[..., 0] - half * np.cos(heading),
            values[..., 1] - half * np.sin(heading) - self._offsets[:, None],
            heading,
            values[..., 3],
            values[..., 4],
            values[..., 5],
            present,
            self._centred(players),
        )

    def _state_of(self, name: str) -> tuple[float, float, float, float]:
        x, y = libsumo.vehicle.getPosition(name)
        if x < -1e6:
            raise SimulationError(f"SUMO has not inserted {name!r}")
        return x, y, libsumo.vehicle.getAngle(name), libsumo.vehicle.getSpeed(name)

    def _centred(self, players: FloatArray) -> FloatArray:
        if np.isnan(players).all():
            return players
        players[..., 2] = _mathematical(players[..., 2])
        players[..., 0] -= self._half_length * np.cos(players[..., 2])
        players[..., 1] -= self._half_length * np.sin(players[..., 2]) + self._offsets[:, None]
        return players


def _has_others(scene: OpenScene) -> bool:
    players = {player.vehicle for player in scene.document.players}
    return bool(scene.routes.flows) or bool(set(scene.routes.vehicles) - players)


def _release(folder: tempfile.TemporaryDirectory[str]) -> None:
    libsumo.close()
    folder.cleanup()


def _compass(heading_rad: FloatArray | float) -> FloatArray:
    """SUMO's compass angle in degrees of a heading in radians."""
    return (90.0 - np.degrees(heading_rad)) % 360.0


def _mathematical(compass_deg: FloatArray) -> FloatArray:
    """Heading in radians (0 east, counter-clockwise, within ±pi) of SUMO's compass angle."""
    return (np.radians(90.0 - compass_deg) + np.pi) % (2.0 * np.pi) - np.pi
