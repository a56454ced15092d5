"""What a step costs, counted rather than timed: calls into SUMO, calls of Python functions, memory left behind.

The counts do not depend on the machine, so they are held to what was measured. When a step becomes cheaper on purpose,
print the numbers again with `python -m tests.environments.test_step_cost` and lower the bounds. `make bench` has times.
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
from harness.game.attention import HumanFactors
from harness.game.initial_state import StartDistribution, draw_initial_state
from harness.game.seeding import generator_of
from harness.game.state import Outcome
from harness.traffic.scene import OpenScene, open_scene
from tests.support.repository import REPOSITORY
from tests.support.scenes import build_scene

# Exact: what SUMO is asked, and no more.
PLACEMENTS_PER_GAME = 2  # moveToXY, with two players that the harness drives
OF_ALL_GAMES = {"simulationStep": 1, "simulation.getArrivedIDList": 1}
WHERE_OTHERS_ARE = {"simulation.getDepartedIDList": 1}
READS_OF_OTHER = ("getPosition", "getAngle", "getSpeed")

# At most: what was measured, and a little more. `python -m tests.environments.test_step_cost` prints what it is now.
LIBSUMO_CALLS_PER_RESTART = 0  # where SUMO drives nobody, players stay in the traffic from game to game
LIBSUMO_CALLS_PER_RESTART_AMONG_OTHERS = 44  # of a game that is on: 8 for both players, out and in again, 6 an other
FAR_READS_PER_OTHER = 0.2  # a step
PYTHON_CALLS_PER_STEP = 112  # of all games together
PYTHON_CALLS_PER_GAME = 0  # what each game adds: its placements are libsumo's own
PYTHON_CALLS_PER_OTHER = 0.5
PYTHON_CALLS_PER_RESTART = 90
BLOCKS_LEFT_BEHIND = 350  # by 500 steps: one that were left by each step would be 500; some 50 to 200 come and go

FEW, MANY = 4, 16  # games
OTHERS = 6  # a game
STEPS = 20
PERSONA = REPOSITORY / "personas" / "distracted.toml"
VAN = (
    '<vehicle id="van{k}" type="van" depart="0" departLane="{lane}" departPos="{position_m}" departSpeed="10">'
    '<route edges="road"/></vehicle>'
)
NEAR_M, FAR_M = 60.0, 210.0  # along the road; the players start at 30 to 40


@contextmanager
def counted_sumo(counts: Counter[str]) -> Iterator[None]:
    """Count the calls of every function of libsumo, by the name it has there: a part's functions are called in the
    extension module as `vehicle_getSpeed`, by libsumo's own Python functions and by the harness."""
    extension = libsumo.libsumo._libsumo
    with ExitStack() as patches:
        for name, function in list(vars(extension).items()):
            part, _, called = name.partition("_")
            if isinstance(function, BuiltinFunctionType) and isinstance(getattr(libsumo, part, None), type) and called:
                known = "simulationStep" if name == "simulation_step" else f"{part}.{called}"
                patches.enter_context(patch.object(extension, name, counted(function, counts, known)))
        yield


def counted(function: Callable[..., Any], counts: Counter[str], name: str) -> Callable[..., Any]:
    def called(*arguments: Any) -> Any:
        counts[name] += 1
        return function(*arguments)

    return called


class Counting:
    """An arena of coasting players, in which nobody gets anywhere before something was counted."""

    def __init__(self, scene: OpenScene, games: int, sumo_drives: bool = False) -> None:
        persona = read_document(PERSONA, Persona)
        seats = [Seat(None, persona.payoff), Seat(SumoDriver() if sumo_drives else None, persona.payoff)]
        self.arena = Arena(scene, games, seats, seed=1)
        self._start_distribution: StartDistribution = scene.start_distribution(
            [HumanFactors()] * 2, [1.0, 1.0]
        )  # always attentive: nobody drifts off the road
        self._coast = np.zeros((games, 2, 2))

    def start(self, *games: int) -> None:
        departures = {game: self.arena.scene.departures(generator_of(1)) for game in games}
        self.arena.reset(
            {game: draw_initial_state(self._start_distribution, "cost", game) for game in games}, departures
        )

    def steps(self, count: int = STEPS) -> None:
        for _ in range(count):
            self.arena.step(self._coast)

    def libsumo_calls(self, work: Callable[[], None]) -> Counter[str]:
        """Calls into libsumo while something is done."""
        calls: Counter[str] = Counter()
        with counted_sumo(calls):
            work()
        return calls


@contextmanager
def counting(scene: OpenScene, games: int, sumo_drives: bool = False) -> Iterator[Counting]:
    """An arena that has begun, with everything warm that is compiled or kept at first use."""
    counted = Counting(scene, games, sumo_drives)
    try:
        counted.start(*range(games))
        counted.steps(3)
        yield counted
    finally:
        counted.arena.close()


def python_calls(work: Callable[[], None]) -> int:
    """Calls of Python functions while something is done; comprehensions count where Python makes functions of them."""
    calls = 0

    def note(frame: FrameType, event: str, argument: object) -> None:
        nonlocal calls
        calls += event == "call"

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        work()
    finally:
        sys.setprofile(before)
    return calls


def blocks_left(work: Callable[[], None]) -> int:
    """Blocks of memory that Python holds after something was done and did not before."""
    gc.collect()
    before = sys.getallocatedblocks()
    work()
    gc.collect()
    return sys.getallocatedblocks() - before


@dataclass(frozen=True)
class Scenes:
    """A straight road: with nobody else on it, with others beside the players, and with others far ahead."""

    empty: OpenScene
    busy: OpenScene
    far: OpenScene

    @classmethod
    def built(cls, folder: Path) -> Scenes:
        empty = build_scene(folder / "empty")
        return cls(empty, among(vans(NEAR_M), empty, folder / "busy"), among(vans(FAR_M), empty, folder / "far"))


def among(others: str, empty: OpenScene, folder: Path) -> OpenScene:
    """A scene with others on it, on the same net: its tiles are made once."""
    shutil.copytree(empty.folder, folder)
    routes = folder / empty.document.routes
    routes.write_text(routes.read_text().replace("</routes>", others + "</routes>"))
    return open_scene(folder)


def vans(first_m: float) -> str:
    """Others on both lanes, one behind the other from there on."""
    places = [(k, k % 2, first_m + 10.0 * k) for k in range(OTHERS)]
    return "".join(VAN.format(k=k, lane=lane, position_m=position_m) for k, lane, position_m in places)


def measured(scenes: Scenes) -> dict[str, float]:
    """Each of the counts that have a bound."""
    found: dict[str, float] = {}
    with counting(scenes.empty, FEW) as few:
        of_few = python_calls(few.steps) / STEPS
    with counting(scenes.empty, MANY) as many:
        of_many = python_calls(many.steps) / STEPS
        blocks_left(many.steps)  # what is kept at first use is nothing left behind
        found["BLOCKS_LEFT_BEHIND"] = blocks_left(lambda: many.steps(500))
        many.start(0)
        found["PYTHON_CALLS_PER_RESTART"] = python_calls(lambda: many.start(0))
        found["LIBSUMO_CALLS_PER_RESTART"] = many.libsumo_calls(lambda: many.start(0)).total()
    found["PYTHON_CALLS_PER_GAME"] = (of_many - of_few) / (MANY - FEW)
    found["PYTHON_CALLS_PER_STEP"] = of_few - FEW * found["PYTHON_CALLS_PER_GAME"]
    with counting(scenes.busy, MANY) as busy:
        found["PYTHON_CALLS_PER_OTHER"] = (python_calls(busy.steps) / STEPS - of_many) / (MANY * OTHERS)
        found["LIBSUMO_CALLS_PER_RESTART_AMONG_OTHERS"] = busy.libsumo_calls(lambda: busy.start(0)).total()
    return found


@pytest.fixture(scope="module")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> Scenes:
    return Scenes.built(tmp_path_factory.mktemp("scenes"))


@pytest.fixture(scope="module")
def counts(scenes: Scenes) -> dict[str, float]:
    found = measured(scenes)
    assert not libsumo.isLoaded()
    return found


# --- what SUMO is asked -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("games", [1, FEW, MANY])
def test_step__asks_sumo_for_placements_and_a_step_and_nothing_else(games: int, scenes: Scenes) -> None:
    with counting(scenes.empty, games) as counted:
        calls = counted.libsumo_calls(counted.steps)
    expected = {name: number * STEPS for name, number in OF_ALL_GAMES.items()}
    assert calls == expected | {"vehicle.moveToXY": PLACEMENTS_PER_GAME * games * STEPS}


def test_step__reads_each_other_beside_a_player_once(scenes: Scenes) -> None:
    with counting(scenes.busy, FEW) as counted:
        calls = counted.libsumo_calls(counted.steps)
    expected = {name: number * STEPS for name, number in (OF_ALL_GAMES | WHERE_OTHERS_ARE).items()}
    expected |= {f"vehicle.{name}": OTHERS * FEW * STEPS for name in READS_OF_OTHER}
    assert calls == expected | {"vehicle.moveToXY": PLACEMENTS_PER_GAME * FEW * STEPS}


def test_step__seldom_asks_for_others_far_away(scenes: Scenes) -> None:
    with counting(scenes.far, FEW) as counted:
        calls = counted.libsumo_calls(counted.steps)
    reads = sum(calls[f"vehicle.{name}"] for name in READS_OF_OTHER)
    assert 0 < reads <= FAR_READS_PER_OTHER * OTHERS * FEW * STEPS


def test_step__a_player_left_to_sumo_is_read_and_not_placed(scenes: Scenes) -> None:
    with counting(scenes.empty, FEW, sumo_drives=True) as counted:
        calls = counted.libsumo_calls(counted.steps)
    assert calls["vehicle.moveToXY"] == FEW * STEPS
    assert calls.total() == STEPS * (sum(OF_ALL_GAMES.values()) + FEW * (1 + len(READS_OF_OTHER)))


def test_step__a_game_that_has_ended_asks_no_more(scenes: Scenes) -> None:
    with counting(scenes.busy, FEW) as counted:
        counted.arena.state.outcome[0] = Outcome.GOAL
        for player in range(2):
            counted.arena.simulation.remove(0, player)
        calls = counted.libsumo_calls(counted.steps)
    assert calls["vehicle.moveToXY"] == PLACEMENTS_PER_GAME * (FEW - 1) * STEPS


# --- what Python does -------------------------------------------------------------------------------------------------

BOUNDS = {
    "LIBSUMO_CALLS_PER_RESTART": LIBSUMO_CALLS_PER_RESTART,
    "LIBSUMO_CALLS_PER_RESTART_AMONG_OTHERS": LIBSUMO_CALLS_PER_RESTART_AMONG_OTHERS,
    "PYTHON_CALLS_PER_STEP": PYTHON_CALLS_PER_STEP,
    "PYTHON_CALLS_PER_GAME": PYTHON_CALLS_PER_GAME,
    "PYTHON_CALLS_PER_OTHER": PYTHON_CALLS_PER_OTHER,
    "PYTHON_CALLS_PER_RESTART": PYTHON_CALLS_PER_RESTART,
    "BLOCKS_LEFT_BEHIND": BLOCKS_LEFT_BEHIND,
}


@pytest.mark.parametrize("name", BOUNDS)
def test_cost__is_no_more_than_it_was(name: str, counts: dict[str, float]) -> None:
    assert counts[name] <= BOUNDS[name]


def test_cost__every_count_has_a_bound(counts: dict[str, float]) -> None:
    assert counts.keys() == BOUNDS.keys()


# --- the test's own eyes ----------------------------------------------------------------------------------------------


def test_python_calls__are_counted() -> None:
    def nothing() -> None:
        """Called, and that is all."""

    def work() -> None:
        for _ in range(5):
            nothing()

    assert python_calls(work) == 6


def test_blocks_left__what_is_kept_is_seen() -> None:
    kept: list[list[int]] = []
    assert 100 <= blocks_left(lambda: kept.extend([k] for k in range(100))) < 250


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as scratch:
        for name, value in measured(Scenes.built(Path(scratch))).items():
            print(f"{name} = {value:g}")
