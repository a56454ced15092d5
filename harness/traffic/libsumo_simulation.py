"""The simulation of this process: libsumo, which has room for one.

A player that the harness takes over is placed with moveToXY: exactly where the arena says, on the road or off it.
A player left to SUMO is started here and its state read back. At this border headings become SUMO's compass angles, and
the reference point moves from the body's centre to the front bumper.

To take a car out of SUMO's traffic and add it anew costs as much as ten steps of it, and SUMO forgets the route of one
that is only put back to its start. Where SUMO drives nobody there is nobody to whom that matters: players stay in the
traffic from game to game, SUMO looks for their lanes along their routes only, and its models of following and changing
lanes don't think for them (so that SUMO has their poses, but not always their speeds).
"""

from __future__ import annotations

import tempfile
import weakref
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from itertools import repeat
from pathlib import Path

import libsumo
import numpy as np
from libsumo import _libsumo  # its functions without the Python function around each: for what is called most

from harness.errors import SimulationError
from harness.game.arrays import FloatArray
from harness.game.initial_state import InitialState
from harness.game.state import ROLES
from harness.traffic.angles import compass_deg_of, heading_rad_of
from harness.traffic.background_traffic import BackgroundTraffic
from harness.traffic.route_file import Departure
from harness.traffic.scene import OpenScene
from harness.traffic.simulation import Reading
from harness.traffic.tiles import tile_offset_m, tile_prefix, tiled_net

# How moveToXY places a car: its keepRoute, and how far away it looks for a lane. keepRoute's bit 2: exactly there, on
# the road or off it; its bit 1: of the lanes near it, only those of its route count.
_ON_ANY_LANE = (2, 100.0)  # SUMO's default distance
_ON_ITS_ROUTE = (2 | 1, 10.0)  # which is all that a car can be on
_ANY_EDGE, _ANY_LANE = repeat(""), repeat(-1)
_HARDLY_EVER_S = 1e6  # an action step, between two thoughts of SUMO's own models for a car
_LATERAL_RESOLUTION_M = 0.8  # as in SUMO's documentation of the sublane model: a quarter of a lane
_ANY_SPEED = 100.0  # a speed factor: SUMO would show the others no speed above the limit times this
_FAILURES = (libsumo.TraCIException, libsumo.FatalTraCIError)


@dataclass
class _Tile:
    """One game's corner of the simulation."""

    prefix: str
    offset_m: float
    inside: set[int] = field(default_factory=set)  # players that SUMO knows


class LibsumoSimulation:
    """The simulation of this process. It is given back by `close`, or when nobody refers to it any more."""

    @staticmethod
    def in_use() -> bool:
        """Whether this process's libsumo is taken, by one of us or by the user's own code."""
        return libsumo.isLoaded()

    def __init__(
        self, scene: OpenScene, games: int, taken_over: Sequence[bool], seed: int, recorded: bool = False
    ) -> None:
        """Load SUMO with a tile for each game. Raises SimulationError if SUMO refuses, or is in use already."""
        if self.in_use():
            raise SimulationError("this process has a libsumo simulation already")
        self._scene, self._games, self._taken_over = scene, games, tuple(taken_over)
        self._recorded = recorded
        self._drives_nobody = all(self._taken_over) and not scene.has_background_traffic
        self._placing = _ON_ITS_ROUTE if self._drives_nobody else _ON_ANY_LANE
        self._half_length = 0.5 * scene.world.length_m
        offset = tile_offset_m(scene.net_file, games)
        self._offsets = offset * np.arange(games)
        folder = tempfile.TemporaryDirectory(prefix="harness-sumo-")
        types = Path(folder.name) / "types.rou.xml"
        types.write_text(scene.routes.types_xml, encoding="utf-8")
        document = scene.document
        # Taken-over cars that leave a junction's lanes may kill SUMO 1.28 (SIGSEGV) if lane changes take time: they
        # do so only where there is somebody whom SUMO drives.
        duration_s = 0.0 if self._drives_nobody else document.lane_change_duration_s
        lateral = ["--lanechange.duration", str(duration_s)]
        if self._by_sublanes():
            lateral = ["--lateral-resolution", str(_LATERAL_RESOLUTION_M)]  # SUMO takes one of the two options
        self._options = [
            *("--net-file", str(tiled_net(scene.net_file, games)), "--route-files", str(types)),
            *("--step-length", str(document.step_length_s), "--collision.action", "none"),
            *lateral,
            *("--time-to-teleport", "-1", "--no-step-log", "--no-warnings", "--xml-validation", "never"),
        ]
        self._release = weakref.finalize(self, _release, folder)
        try:
            self._load(["sumo", *self._options, "--seed", str(seed)], libsumo.start)
        except SimulationError:
            self.close()
            raise

    def _by_sublanes(self) -> bool:
        """Whether a player that SUMO drives changes lanes by SL2015, which without sublanes never would."""
        types = self._scene.routes.types
        kinds = [
            types[self._scene.vehicle(player).vehicle_type] for player in np.flatnonzero(~np.array(self._taken_over))
        ]
        return any(kind.lane_changes == "SL2015" for kind in kinds)

    def _load(self, options: list[str], load: Callable[[list[str]], object]) -> None:
        with self._asking(f"load scene {self._scene.document.name!r}"):
            load(options)
        self._tiles = [_Tile(tile_prefix(game, self._games), float(self._offsets[game])) for game in range(self._games)]
        self._routes: set[str] = set()
        self._placed: dict[str, int] = {}  # players that stand and go as the arena says; their entry in [G, P]
        self._self_driven: dict[str, tuple[int, int]] = {}  # the other players; their game and seat
        self._there = np.zeros((self._games, len(self._taken_over)), dtype=bool)
        self._entrances = [self._entrance(player) for player in range(len(self._taken_over))]
        world = self._scene.world
        self._others = BackgroundTraffic(
            [tile.prefix for tile in self._tiles],
            self._offsets,
            world.step_s,
            float(world.actuators.max_speed_mps.max()),
            self._recorded,
            self._enter,
        )

    def reload(self, seed: int) -> None:
        """Start SUMO anew, with its random numbers from `seed`: every game has to be started again."""
        self._load([*self._options, "--seed", str(seed)], libsumo.load)

    def reset(self, game: int, start: InitialState, departures: list[Departure]) -> None:
        """Clear a game's tile and put its players at their start; others depart as time goes by."""
        tile = self._tiles[game]
        with self._asking(f"start game {game}"):
            taking_part = {player for player, present in enumerate(start.present.tolist()) if present}
            staying = tile.inside & taking_part if self._drives_nobody else set()
            for player in tile.inside - staying:
                self._take_out(game, player)
            for player in sorted(taking_part - staying):
                self._add_player(game, player, start)
            self._others.reset(game, departures)

    def halt(self, game: int, player: int) -> None:
        """Whoever drove a player, from now on it stands where `step` says."""
        if self._taken_over[player]:
            return
        name = self._name(game, player)
        self._self_driven.pop(name, None)
        self._placed[name] = game * len(self._taken_over) + player

    def remove(self, game: int, player: int) -> None:
        """Take a player out of the traffic; where there is nobody else it stands there till the next game starts."""
        if not self._drives_nobody:
            with self._asking(f"remove a player from game {game}"):
                self._take_out(game, player)

    def _take_out(self, game: int, player: int) -> None:
        name = self._name(game, player)
        libsumo.vehicle.remove(name)
        self._tiles[game].inside.discard(player)
        self._there[game, player] = False
        self._self_driven.pop(name, None)
        self._placed.pop(name, None)

    def step(self, x_m: FloatArray, y_m: FloatArray, heading_rad: FloatArray) -> Reading:
        """Place the players that are taken over at poses [G, P] of their centres, let SUMO step, read the rest."""
        seats = list(self._placed.values())
        front_x = (x_m + self._half_length * np.cos(heading_rad)).ravel()[seats].tolist()
        front_y = (y_m + self._half_length * np.sin(heading_rad) + self._offsets[:, None]).ravel()[seats].tolist()
        angle = compass_deg_of(heading_rad).ravel()[seats].tolist()
        with self._asking("step"):
            where = (_ANY_EDGE, _ANY_LANE, front_x, front_y, angle, *map(repeat, self._placing))
            deque(map(_libsumo.vehicle_moveToXY, self._placed, *where), maxlen=0)  # one after another, without a loop
            libsumo.simulationStep()
            self._others.advance()
            players = self._read_players()
            if players is not None:
                x_m = np.where(np.isnan(players[..., 0]), x_m, players[..., 0])
                y_m = np.where(np.isnan(players[..., 1]), y_m, players[..., 1])
            reading = self._others.read(x_m, y_m, self._there)
            return replace(reading, players=players) if players is not None else reading

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

    def _name(self, game: int, player: int) -> str:
        return self._tiles[game].prefix + ROLES[player]

    def _add_player(self, game: int, player: int, start: InitialState) -> None:
        tile, name, speed = self._tiles[game], self._name(game, player), float(start.speed_mps[player])
        kind, lane, fastest = self._entrances[player]
        entering = (kind, lane, str(start.position_m[player]), str(min(speed, fastest)))
        self._add(tile, name, self._scene.edges[player], *entering)
        tile.inside.add(player)
        self._there[game, player] = True
        ahead = self._half_length[player]
        if self._taken_over[player]:
            self._placed[name] = game * len(self._taken_over) + player
            if self._drives_nobody:
                libsumo.vehicle.setActionStepLength(name, _HARDLY_EVER_S)
            else:
                libsumo.vehicle.setSpeedFactor(name, _ANY_SPEED)
        else:
            self._self_driven[name] = (game, player)
            ahead += speed * self._scene.world.step_s  # SUMO moves nobody in the step it starts them
        heading = float(start.heading_rad[player])
        x = float(start.x_m[player] + ahead * np.cos(heading))
        y = float(start.y_m[player] + ahead * np.sin(heading) + tile.offset_m)
        # Placed there it is in the traffic at once; only added, it would have to wait for room.
        libsumo.vehicle.moveToXY(name, "", -1, x, y, float(compass_deg_of(heading)), *self._placing)

    def _entrance(self, player: int) -> tuple[str, str, float]:
        """A player's type, the lane it starts on, and the speed above which SUMO refuses to start it: what its type
        keeps to on the road there."""
        routes, types = self._scene.world.road.routes, libsumo.vehicletype
        kind = self._scene.vehicle(player).vehicle_type
        lane = self._scene.document.players[player].lane.rsplit("_", 1)[1]
        legal = float(routes.speed_limit_mps[routes.first_row[player]])
        return kind, lane, float(min(legal * min(1.0, types.getSpeedFactor(kind)), types.getMaxSpeed(kind)))

    def _enter(self, game: int, name: str, other: Departure) -> None:
        self._add(self._tiles[game], name, other.edges, other.vehicle_type, other.lane, other.position, other.speed)

    def _add(
        self, tile: _Tile, name: str, edges: Sequence[str], kind: str, lane: str, position: str, speed: str
    ) -> None:
        route = tile.prefix + "route " + " ".join(edges)
        if route not in self._routes:
            libsumo.route.add(route, [tile.prefix + edge for edge in edges])
            self._routes.add(route)
        libsumo.vehicle.add(name, route, kind, "now", lane, position, speed)

    def _read_players(self) -> FloatArray | None:
        """[G, P, 4] where the players are that SUMO drives; None if it drives none."""
        if all(self._taken_over):
            return None
        players = np.full((*self._there.shape, 4), np.nan)
        for name, seat in self._self_driven.items():
            x, y = libsumo.vehicle.getPosition(name)
            if x < -1e6:
                raise SimulationError(f"SUMO has not inserted {name!r}")
            players[seat] = (x, y, libsumo.vehicle.getAngle(name), libsumo.vehicle.getSpeed(name))
        players[..., 2] = heading_rad_of(players[..., 2])
        players[..., 0] -= self._half_length * np.cos(players[..., 2])
        players[..., 1] -= self._half_length * np.sin(players[..., 2]) + self._offsets[:, None]
        return players


def _release(folder: tempfile.TemporaryDirectory[str]) -> None:
    libsumo.close()
    folder.cleanup()
