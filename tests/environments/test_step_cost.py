"""The cost of a step as counts: calls into SUMO, calls of Python functions, memory that is not released.

The counts do not depend on the machine, so the bounds are the measured counts. If a change makes a step cheaper, print
the counts with `python -m tests.environments.test_step_cost` and lower the bounds. `make bench` measures times.
"""

from __future__ import annotations

import gc
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import BuiltinFunctionType, FrameType
from typing import Any
from unittest.mock import patch

import libsumo
import numpy as np
import pytest

from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.drivers.sumo import SumoDriver
from harness.environments.arena import Arena, Seat
from harness.game.human_factors import HumanFactors
from harness.game.initial_state import StartDistribution, draw_initial_state
from harness.game.outcome import Outcome
from harness.game.seeding import generator_of
from harness.traffic import background_traffic
from harness.traffic.scene import OpenScene, open_scene
from harness.traffic.vehicle_reads import DIRECT
from tests.support.repository import REPOSITORY
from tests.support.scenes import build_scene

# Exact numbers of calls.
PLACEMENTS_PER_GAME = 2  # moveToXY, with two players that the harness drives
PER_STEP = {"simulationStep": 1, "simulation.getArrivedIDList": 1}
PER_STEP_WITH_TRAFFIC = {"simulation.getDepartedIDList": 1}
PER_STEP_WITH_DIRECT_READS = {"simulation.getMinExpectedNumber": 1}
READS_PER_VEHICLE = ("getPosition", "getAngle", "getSpeed")

# Upper bounds: the measured counts plus a margin. `python -m tests.environments.test_step_cost` prints the counts.
LIBSUMO_CALLS_PER_RESET = 0  # without background traffic, players stay in SUMO from game to game
LIBSUMO_CALLS_PER_RESET_IN_TRAFFIC = 44  # of a running game: 8 to remove and add both players, 6 per vehicle
READS_PER_FAR_VEHICLE = 0.2  # a step
PYTHON_CALLS_PER_STEP = 110  # of all games together
PYTHON_CALLS_PER_GAME = 0  # per game; placements are calls into the extension module
PYTHON_CALLS_PER_VEHICLE = 0.5
PYTHON_CALLS_PER_RESET = 88
BLOCKS_NOT_RELEASED = 350  # after 500 steps: one block per step would be 500; 50 to 200 vary from run to run

FEW, MANY = 4, 16  # games
VEHICLES = 6  # of background traffic, per game
STEPS = 20
PERSONA = REPOSITORY / "personas" / "distracted.toml"
VAN = (
    '<vehicle id="van{k}" type="van" depart="0" departLane="{lane}" departPos="{position_m}" departSpeed="10">'
    '<route edges="road"/></vehicle>'
)
NEAR_M, FAR_M = 60.0, 210.0  # along the road; the players start at 30 to 40


@contextmanager
def counted_sumo(counts: Counter[str]) -> Iterator[None]:
    """Count the calls of every function of libsumo by its name. A function such as `vehicle.getSpeed` is
    `vehicle_getSpeed` in the extension module; libsumo's Python functions and the harness call it there."""
    extension = libsumo.libsumo._libsumo
    with ExitStack() as patches:
        for name, function in list(vars(extension).items()):
            part, _, method = name.partition("_")
            if isinstance(function, BuiltinFunctionType) and isinstance(getattr(libsumo, part, None), type) and method:
                known = "simulationStep" if name == "simulation_step" else f"{part}.{method}"
                patches.enter_context(patch.object(extension, name, counted(function, counts, known)))
        yield


def counted(function: Callable[..., Any], counts: Counter[str], name: str) -> Callable[..., Any]:
    def called(*arguments: Any, **options: Any) -> Any:
        counts[name] += 1
        return function(*arguments, **options)

    return called


class Counting:
    """An arena of coasting players that do not reach their goals during the count."""

    def __init__(self, scene: OpenScene, games: int, sumo_drives: bool = False) -> None:
        persona = read_document(PERSONA, Persona)
        seats = [Seat(None, persona.payoff), Seat(SumoDriver() if sumo_drives else None, persona.payoff)]
        self.arena = Arena(scene, games, seats, seed=1)
        self._start_distribution: StartDistribution = scene.start_distribution(
            [HumanFactors()] * 2, [1.0, 1.0]
        )  # without lapses of attention no player leaves the road
        self._coast = np.zeros((games, 2, 2))

    def reset(self, *games: int) -> None:
        departures = {game: self.arena.scene.departures(generator_of(1)) for game in games}
        self.arena.reset(
            {game: draw_initial_state(self._start_distribution, "cost", game) for game in games}, departures
        )

    def steps(self, count: int = STEPS) -> None:
        for _ in range(count):
            self.arena.step(self._coast)

    def libsumo_calls(self, work: Callable[[], None]) -> Counter[str]:
        """Calls into libsumo during `work`."""
        calls: Counter[str] = Counter()
        with counted_sumo(calls):
            work()
        return calls


@contextmanager
def counting(scene: OpenScene, games: int, sumo_drives: bool = False) -> Iterator[Counting]:
    """An arena after a reset and three steps, so that compilation and caching at first use are not counted."""
    counted = Counting(scene, games, sumo_drives)
    try:
        counted.reset(*range(games))
        counted.steps(3)
        yield counted
    finally:
        counted.arena.close()


def python_calls(work: Callable[[], None]) -> int:
    """Calls of Python functions during `work`, including comprehensions where Python compiles them to functions."""
    calls = 0

    def count(frame: FrameType, event: str, argument: object) -> None:
        nonlocal calls
        calls += event == "call"

    before = sys.getprofile()
    sys.setprofile(count)
    try:
        work()
    finally:
        sys.setprofile(before)
    return calls


def blocks_not_released(work: Callable[[], None]) -> int:
    """Blocks of memory that Python holds after `work` and did not hold before."""
    gc.collect()
    before = sys.getallocatedblocks()
    work()
    gc.collect()
    return sys.getallocatedblocks() - before


@dataclass(frozen=True)
class Scenes:
    """A straight road: without background traffic, with traffic beside the players, and with traffic far ahead."""

    empty: OpenScene
    busy: OpenScene
    far: OpenScene

    @classmethod
    def built(cls, folder: Path) -> Scenes:
        empty = build_scene(folder / "empty")
        return cls(
            empty, with_traffic(vans(NEAR_M), empty, folder / "busy"), with_traffic(vans(FAR_M), empty, folder / "far")
        )


def with_traffic(vehicles: str, empty: OpenScene, folder: Path) -> OpenScene:
    """A scene with background traffic on the same network, so that the tiles are made once."""
    shutil.copytree(empty.folder, folder)
    routes = folder / empty.document.routes
    routes.write_text(routes.read_text().replace("</routes>", vehicles + "</routes>"))
    return open_scene(folder)


def vans(first_m: float) -> str:
    """Vehicles on both lanes, one behind the other, from `first_m` on."""
    places = [(k, k % 2, first_m + 10.0 * k) for k in range(VEHICLES)]
    return "".join(VAN.format(k=k, lane=lane, position_m=position_m) for k, lane, position_m in places)


def measured(scenes: Scenes) -> dict[str, float]:
    """The counts that have a bound."""
    found: dict[str, float] = {}
    with counting(scenes.empty, FEW) as few:
        of_few = python_calls(few.steps) / STEPS
    with counting(scenes.empty, MANY) as many:
        of_many = python_calls(many.steps) / STEPS
        blocks_not_released(many.steps)  # caches at first use are not counted
        found["BLOCKS_NOT_RELEASED"] = blocks_not_released(lambda: many.steps(500))
        many.reset(0)
        found["PYTHON_CALLS_PER_RESET"] = python_calls(lambda: many.reset(0))
        found["LIBSUMO_CALLS_PER_RESET"] = many.libsumo_calls(lambda: many.reset(0)).total()
    found["PYTHON_CALLS_PER_GAME"] = (of_many - of_few) / (MANY - FEW)
    found["PYTHON_CALLS_PER_STEP"] = of_few - FEW * found["PYTHON_CALLS_PER_GAME"]
    with counting(scenes.busy, MANY) as busy:
        found["PYTHON_CALLS_PER_VEHICLE"] = (python_calls(busy.steps) / STEPS - of_many) / (MANY * VEHICLES)
        found["LIBSUMO_CALLS_PER_RESET_IN_TRAFFIC"] = busy.libsumo_calls(lambda: busy.reset(0)).total()
    return found


@pytest.fixture(scope="module")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> Scenes:
    return Scenes.built(tmp_path_factory.mktemp("scenes"))


@pytest.fixture(scope="module")
def counts(scenes: Scenes) -> dict[str, float]:
    found = measured(scenes)
    assert not libsumo.isLoaded()
    return found


# --- calls into SUMO --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("games", [1, FEW, MANY])
def test_step__calls_sumo_for_placements_and_a_step_only(games: int, scenes: Scenes) -> None:
    with counting(scenes.empty, games) as counted:
        calls = counted.libsumo_calls(counted.steps)
    expected = {name: number * STEPS for name, number in PER_STEP.items()}
    assert calls == expected | {"vehicle.moveToXY": PLACEMENTS_PER_GAME * games * STEPS}


@pytest.mark.skipif(not DIRECT, reason="vehicles can't be read directly on this platform")
def test_step__calls_no_function_per_vehicle_if_vehicles_are_read_directly(scenes: Scenes) -> None:
    with counting(scenes.busy, FEW) as counted:
        calls = counted.libsumo_calls(counted.steps)
    of_steps = PER_STEP | PER_STEP_WITH_TRAFFIC | PER_STEP_WITH_DIRECT_READS
    expected = {name: number * STEPS for name, number in of_steps.items()}
    assert calls == expected | {"vehicle.moveToXY": PLACEMENTS_PER_GAME * FEW * STEPS}


@pytest.fixture
def through_python(monkeypatch: pytest.MonkeyPatch) -> None:
    """Vehicles are read through Python, whatever the platform allows."""
    monkeypatch.setattr(background_traffic, "DIRECT", False)


@pytest.mark.usefixtures("through_python")
def test_step__reads_each_vehicle_near_a_player_once(scenes: Scenes) -> None:
    with counting(scenes.busy, FEW) as counted:
        calls = counted.libsumo_calls(counted.steps)
    expected = {name: number * STEPS for name, number in (PER_STEP | PER_STEP_WITH_TRAFFIC).items()}
    expected |= {f"vehicle.{name}": VEHICLES * FEW * STEPS for name in READS_PER_VEHICLE}
    assert calls == expected | {"vehicle.moveToXY": PLACEMENTS_PER_GAME * FEW * STEPS}


@pytest.mark.usefixtures("through_python")
def test_step__seldom_reads_vehicles_far_away(scenes: Scenes) -> None:
    with counting(scenes.far, FEW) as counted:
        calls = counted.libsumo_calls(counted.steps)
    reads = sum(calls[f"vehicle.{name}"] for name in READS_PER_VEHICLE)
    assert 0 < reads <= READS_PER_FAR_VEHICLE * VEHICLES * FEW * STEPS


def test_step__a_player_driven_by_sumo_is_read_and_not_placed(scenes: Scenes) -> None:
    with counting(scenes.empty, FEW, sumo_drives=True) as counted:
        calls = counted.libsumo_calls(counted.steps)
    assert calls["vehicle.moveToXY"] == FEW * STEPS
    assert calls.total() == STEPS * (sum(PER_STEP.values()) + FEW * (1 + len(READS_PER_VEHICLE)))


def test_step__a_finished_game_has_no_placements(scenes: Scenes) -> None:
    with counting(scenes.busy, FEW) as counted:
        counted.arena.state.outcome[0] = Outcome.GOAL
        for player in range(2):
            counted.arena.simulation.remove(0, player)
        calls = counted.libsumo_calls(counted.steps)
    assert calls["vehicle.moveToXY"] == PLACEMENTS_PER_GAME * (FEW - 1) * STEPS


# --- calls of Python functions ----------------------------------------------------------------------------------------

BOUNDS = {
    "LIBSUMO_CALLS_PER_RESET": LIBSUMO_CALLS_PER_RESET,
    "LIBSUMO_CALLS_PER_RESET_IN_TRAFFIC": LIBSUMO_CALLS_PER_RESET_IN_TRAFFIC,
    "PYTHON_CALLS_PER_STEP": PYTHON_CALLS_PER_STEP,
    "PYTHON_CALLS_PER_GAME": PYTHON_CALLS_PER_GAME,
    "PYTHON_CALLS_PER_VEHICLE": PYTHON_CALLS_PER_VEHICLE,
    "PYTHON_CALLS_PER_RESET": PYTHON_CALLS_PER_RESET,
    "BLOCKS_NOT_RELEASED": BLOCKS_NOT_RELEASED,
}


@pytest.mark.parametrize("name", BOUNDS)
def test_cost__is_within_its_bound(name: str, counts: dict[str, float]) -> None:
    assert counts[name] <= BOUNDS[name]


def test_cost__every_count_has_a_bound(counts: dict[str, float]) -> None:
    assert counts.keys() == BOUNDS.keys()


# --- the counters -----------------------------------------------------------------------------------------------------


def test_python_calls__are_counted() -> None:
    def nothing() -> None:
        """Do nothing."""

    def work() -> None:
        for _ in range(5):
            nothing()

    assert python_calls(work) == 6


def test_blocks_not_released__are_counted() -> None:
    stored: list[list[int]] = []
    assert 100 <= blocks_not_released(lambda: stored.extend([k] for k in range(100))) < 250


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as scratch:
        for name, value in measured(Scenes.built(Path(scratch))).items():
            print(f"{name} = {value:g}")
