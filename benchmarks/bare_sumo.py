"""SUMO alone: recorded placements of an arena's vehicles and SUMO's steps, without the harness."""

from __future__ import annotations

import contextlib
import io
import itertools
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import libsumo
import numpy as np
import sumo
import traci
from sumolib.miscutils import getFreeSocketPort

from benchmarks.games import CoastingGames
from harness.road.net.tiles import Copies, tiled_net, tiles_of
from harness.road.scene.open_scene import OpenScene

KEEP_ROUTE = 2  # of moveToXY: place the vehicle exactly as given, on the road or off it

Placement = tuple[str, float, float, float]
"""A vehicle's name, the x and y of its front bumper in metres, its compass angle in degrees."""


def record_placements(coasting: CoastingGames, steps: int, reset_ended: bool = True) -> list[list[Placement]]:
    """Play some steps and return where both players of every game are after each of them."""
    return [_step_and_read(coasting, reset_ended) for _ in range(steps)]


def _step_and_read(coasting: CoastingGames, reset_ended: bool) -> list[Placement]:
    coasting.step(reset_ended)
    arena = coasting.arena
    state, games = arena.state, arena.games
    [tiles] = tiles_of([Copies(arena.scene.net_file, games)])
    offset_m = np.array([tile.offset_m for tile in tiles])[:, None]
    half_m = 0.5 * arena.world.length_m
    x = (state.x_m + half_m * np.cos(state.heading_rad)).tolist()
    y = (state.y_m + half_m * np.sin(state.heading_rad) + offset_m).tolist()
    angle = ((90.0 - np.degrees(state.heading_rad)) % 360.0).tolist()
    return [
        (tile.prefix + role, x[game][player], y[game][player], angle[game][player])
        for game, tile in enumerate(tiles)
        for player, role in enumerate(arena.world.roles)
    ]


def place_and_step(placements: list[Placement], api: Any = libsumo) -> None:
    """Place vehicles and step SUMO. `api` is libsumo or a TraCI connection, which has the same functions."""
    move = api.vehicle.moveToXY
    for name, x, y, angle in placements:
        move(name, "", -1, x, y, angle, KEEP_ROUTE)
    api.simulationStep()


@contextlib.contextmanager
def start_bare_sumo(scene: OpenScene, games: int, by_socket: bool = False) -> Iterator[Any]:
    """SUMO with the two vehicles of each game, without the harness: libsumo, or `sumo` behind a TraCI connection.

    The vehicles are added as in any SUMO script.
    """
    with tempfile.TemporaryDirectory(prefix="benchmark-") as folder:
        types = Path(folder) / "types.rou.xml"
        types.write_text(scene.routes.types_xml, encoding="utf-8")
        [tiles] = tiles_of([Copies(scene.net_file, games)])
        options = [
            *("--net-file", str(tiled_net(tiles)), "--route-files", str(types)),
            *("--step-length", str(scene.world.step_s), "--collision.action", "none"),
            *("--time-to-teleport", "-1", "--no-step-log", "--no-warnings", "--xml-validation", "never"),
        ]
        with _behind_socket(options) if by_socket else _in_process(options) as api:
            for tile, (player, role) in itertools.product(tiles, enumerate(scene.world.roles)):
                prefix = tile.prefix
                api.route.add(f"{prefix}route {role}", [prefix + edge for edge in scene.edges[player]])
                lane = (scene.document.players[player].lane or "_0").rsplit("_", 1)[1]
                kind = scene.vehicle(player).vehicle_type
                api.vehicle.add(prefix + role, f"{prefix}route {role}", kind, "now", lane, str(20 + 20 * player), "10")
            yield api


@contextlib.contextmanager
def _in_process(options: list[str]) -> Iterator[Any]:
    libsumo.start(["sumo", *options])
    try:
        yield libsumo
    finally:
        libsumo.close()


@contextlib.contextmanager
def _behind_socket(options: list[str]) -> Iterator[Any]:
    program = shutil.which("sumo", path=str(Path(sumo.SUMO_HOME) / "bin"))
    assert program is not None, "eclipse-sumo contains sumo"
    port = getFreeSocketPort()
    command = [program, *options, "--remote-port", str(port)]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        with contextlib.redirect_stdout(io.StringIO()):  # traci prints each attempt to connect
            connection = traci.connect(port, numRetries=100, proc=process, waitBetweenRetries=0.1)
        yield connection
    finally:
        process.kill()
        process.wait()
