"""The cost of a step as calls into SUMO, which do not depend on the machine. `make bench` measures times."""

from __future__ import annotations

import gc
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from types import BuiltinFunctionType
from typing import Any
from unittest.mock import patch

import libsumo
import numpy as np
import pytest

from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.drivers.sumo import SumoDriver
from harness.environments.arena import Arena, Seat
from harness.game.initial_state import draw_initial_state
from harness.game.outcome import Outcome
from harness.road.scene.open_scene import OpenScene
from tests.support.repository import REPOSITORY
from tests.support.scenes import build_scene

PLACEMENTS_PER_GAME = 2  # moveToXY, with two players that the harness drives
PER_STEP = {"simulationStep": 1, "simulation.getArrivedIDList": 1}
PER_STEP_WITH_TRAFFIC = {"simulation.getDepartedIDList": 1}
READS_PER_VEHICLE = ("getPosition", "getAngle", "getSpeed")
READS_PER_FAR_VEHICLE = 0.2  # a step
FEW, MANY = 4, 16  # games
VEHICLES = 6  # of background traffic, per game
STEPS = 20
PERSONA = REPOSITORY / "personas" / "paper_distracted.toml"
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
        payoff = read_document(PERSONA, Persona).payoff
        seats = [Seat(None, payoff), Seat(SumoDriver() if sumo_drives else None, payoff)]
        self.arena = Arena(scene, games, seats, seed=1)
        self._coast = np.zeros((games, 2, 2))

    def reset(self, *games: int) -> None:
        scene = self.arena.scene  # without lapses of attention no player leaves the road
        starts = {game: draw_initial_state(scene.usual_starts, "cost", game) for game in games}
        self.arena.reset(starts, {game: scene.departures(1) for game in games})

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


def vans(first_m: float) -> str:
    """Vehicles on both lanes, one behind the other, from `first_m` on."""
    places = [(k, k % 2, first_m + 10.0 * k) for k in range(VEHICLES)]
    return "".join(VAN.format(k=k, lane=lane, position_m=position_m) for k, lane, position_m in places)


@pytest.fixture(scope="module")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> dict[str, OpenScene]:
    """A straight road: without background traffic, with traffic beside the players, and with traffic far ahead."""
    folder = tmp_path_factory.mktemp("scenes")
    others = {"empty": "", "busy": vans(NEAR_M), "far": vans(FAR_M)}
    return {name: build_scene(folder / name, others=vehicles) for name, vehicles in others.items()}


# --- calls into SUMO --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("games", [1, FEW, MANY])
def test_step__calls_sumo_for_placements_and_a_step_only(games: int, scenes: dict[str, OpenScene]) -> None:
    with counting(scenes["empty"], games) as counted:
        calls = counted.libsumo_calls(counted.steps)
    expected = {name: number * STEPS for name, number in PER_STEP.items()}
    assert calls == expected | {"vehicle.moveToXY": PLACEMENTS_PER_GAME * games * STEPS}


def test_step__reads_each_vehicle_near_a_player_once(scenes: dict[str, OpenScene]) -> None:
    with counting(scenes["busy"], FEW) as counted:
        calls = counted.libsumo_calls(counted.steps)
    expected = {name: number * STEPS for name, number in (PER_STEP | PER_STEP_WITH_TRAFFIC).items()}
    expected |= {f"vehicle.{name}": VEHICLES * FEW * STEPS for name in READS_PER_VEHICLE}
    assert calls == expected | {"vehicle.moveToXY": PLACEMENTS_PER_GAME * FEW * STEPS}


def test_step__seldom_reads_vehicles_far_away(scenes: dict[str, OpenScene]) -> None:
    with counting(scenes["far"], FEW) as counted:
        calls = counted.libsumo_calls(counted.steps)
    reads = sum(calls[f"vehicle.{name}"] for name in READS_PER_VEHICLE)
    assert 0 < reads <= READS_PER_FAR_VEHICLE * VEHICLES * FEW * STEPS


def test_step__a_player_driven_by_sumo_is_read_and_not_placed(scenes: dict[str, OpenScene]) -> None:
    with counting(scenes["empty"], FEW, sumo_drives=True) as counted:
        calls = counted.libsumo_calls(counted.steps)
    assert calls["vehicle.moveToXY"] == FEW * STEPS
    assert calls.total() == STEPS * (sum(PER_STEP.values()) + FEW * (1 + len(READS_PER_VEHICLE)))


def test_step__a_finished_game_has_no_placements(scenes: dict[str, OpenScene]) -> None:
    with counting(scenes["busy"], FEW) as counted:
        counted.arena.state.outcome[0] = Outcome.GOAL
        for player in range(2):
            counted.arena.simulation.remove(0, player)
        calls = counted.libsumo_calls(counted.steps)
    assert calls["vehicle.moveToXY"] == PLACEMENTS_PER_GAME * (FEW - 1) * STEPS


def test_reset__without_background_traffic_players_stay_in_sumo(scenes: dict[str, OpenScene]) -> None:
    with counting(scenes["empty"], FEW) as counted:
        assert counted.libsumo_calls(lambda: counted.reset(0)).total() == 0


def test_step__releases_the_memory_that_it_takes(scenes: dict[str, OpenScene]) -> None:
    with counting(scenes["empty"], FEW) as counted:
        counted.steps(1500)  # until caches are filled: of the first 500 steps they keep 700 blocks

        def kept() -> int:
            gc.collect()
            before = sys.getallocatedblocks()
            counted.steps(500)
            gc.collect()
            return sys.getallocatedblocks() - before

        # 50 to 200 vary from run to run, rarely more; one per step would be 500 each time
        assert min(kept() for _ in range(3)) < 350
