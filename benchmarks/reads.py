"""What it costs to read background vehicles out of SUMO, by each way that libsumo offers.

Each way reads position, angle and speed of the same vehicles after every step. What SUMO prepares for it during the
step counts as well: the time by which such a step exceeds a step alone.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import libsumo
import numpy as np
from libsumo import constants

from benchmarks.bare_sumo import Placement, place_and_step, record_placements
from benchmarks.games import GAMES, CoastingGames
from benchmarks.traffic import write_scene
from harness.game.arrays import FloatArray
from harness.game.state import NOTICED_M
from harness.road.scene.open_scene import open_scene
from harness.sumo.vehicle_reads import NearSearch, read_near

_STEPS = 60  # the players have not met any vehicle by then, and no vehicle has left
_NEAREST = 17  # as many vehicles of a game as are near its players, of 50
_VARIABLES = (constants.VAR_POSITION, constants.VAR_ANGLE, constants.VAR_SPEED)


@dataclass(frozen=True, kw_only=True)
class _Way:
    words: str
    prepare: Callable[[list[str]], object] | None = None
    """Makes SUMO prepare results in every step."""
    read: Callable[[list[str]], object] = lambda names: None


def _read_as_arena() -> Callable[[list[str]], object]:
    """The reading of `BackgroundTraffic`, in which every vehicle counts as near."""
    prepared: list[Callable[[], object]] = []

    def read(names: list[str]) -> object:
        if not prepared:  # the arena prepares a name once as well
            shape, no_player = (1, len(names)), np.zeros((1, 1))
            numbers = (np.zeros(shape, dtype=np.int64), np.ones(shape), np.ones(shape), np.zeros(1))
            search = NearSearch(*numbers, no_player, no_player, no_player > 0.0, 1.0, 0, 1.0, 1, True)
            named, due = np.array([names], dtype=object), np.arange(len(names))
            prepared.append(partial(read_near, search, named, due))
        return prepared[0]()

    return read


def _subscribe(names: list[str]) -> None:
    for name in names:
        libsumo.vehicle.subscribe(name, _VARIABLES)


def _subscribe_around_egos(names: list[str]) -> None:
    for game in range(GAMES):
        libsumo.vehicle.subscribeContext(f"g{game}_ego", constants.CMD_GET_VEHICLE_VARIABLE, NOTICED_M, _VARIABLES)


_ALONE = _Way(words="a step alone")
_WAYS = (
    _Way(words="three getters", read=_read_as_arena()),
    _Way(words="subscriptions, results not fetched", prepare=_subscribe),
    _Way(
        words="subscriptions, results fetched at once",
        prepare=_subscribe,
        read=lambda names: libsumo.vehicle.getAllSubscriptionResults(),
    ),
    _Way(
        words=f"context subscriptions of the egos ({NOTICED_M:.0f} m), results fetched at once",
        prepare=_subscribe_around_egos,
        read=lambda names: libsumo.vehicle.getAllContextSubscriptionResults(),
    ),
)


def reads_table(laps: int, background: int = 50) -> str:
    """In Markdown: per way of reading, nanoseconds per vehicle, and the share of SUMO's step.

    The vehicles are the 17 nearest of each of 64 games. Of each step, the fastest of `laps` counts.
    """
    with tempfile.TemporaryDirectory(prefix="benchmark-") as scratch:
        coasting = CoastingGames(open_scene(write_scene(Path(scratch) / "scene", background)), GAMES)
        try:
            coasting.reset_all()
            placements = record_placements(coasting, _STEPS, reset_ended=False)
            ways = [_ALONE, *_WAYS]
            seconds = {way.words: np.full((2, _STEPS - 1), np.inf) for way in ways}
            for _ in range(laps):
                for way in ways:
                    np.minimum(seconds[way.words], _lap(coasting, placements, way), out=seconds[way.words])
        finally:
            coasting.arena.close()
    alone_s = seconds[_ALONE.words][0].sum()
    lines = ["| read by | in SUMO's step, ns per vehicle | after it, ns per vehicle | share of SUMO's step |"]
    lines.append("| --- | ---: | ---: | ---: |")
    for way in ways[1:]:
        step_s, reading_s = seconds[way.words].sum(1)
        prepared_s = step_s - alone_s if way.prepare else 0.0
        per_vehicle_ns = 1e9 / ((_STEPS - 1) * GAMES * _NEAREST)
        costs = f"{per_vehicle_ns * prepared_s:,.0f} | {per_vehicle_ns * reading_s:,.0f}"
        lines.append(f"| {way.words} | {costs} | {(prepared_s + reading_s) / alone_s:.2f} |")
    return "\n".join(lines)


def _lap(coasting: CoastingGames, placements: list[list[Placement]], way: _Way) -> FloatArray:
    """[2, steps] seconds of each step, and of the reading after it. The vehicles depart in a first step before."""
    coasting.reset_all()
    place_and_step(placements[0])
    names = [f"g{game}_other{k}" for game in range(GAMES) for k in range(_NEAREST)]
    if way.prepare is not None:
        way.prepare(names)
    way.read(names)  # compiles
    seconds = []
    for of_step in placements[1:]:
        start_s = time.perf_counter()
        place_and_step(of_step)
        stepped_s = time.perf_counter()
        way.read(names)
        seconds.append((stepped_s - start_s, time.perf_counter() - stepped_s))
    return np.array(seconds).T
