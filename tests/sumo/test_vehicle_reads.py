"""Vehicles are read from SUMO directly where the platform allows it, and through Python elsewhere: the same numbers."""

from __future__ import annotations

import platform
from collections.abc import Iterator
from dataclasses import fields

import libsumo
import numpy as np
import pytest

from harness.errors import SimulationError
from harness.road.demand.route_file import Departure
from harness.road.scene.open_scene import OpenScene
from harness.sumo import background_traffic
from harness.sumo.libsumo_simulation import LibsumoSimulation
from harness.sumo.simulation import Reading
from harness.sumo.vehicle_reads import DIRECT
from tests.support.scenes import LEFT_Y, build_scene, placed

GAMES, STEPS = 3, 40
LONG = "a_name_that_is_longer_than_the_room_within_a_string_of_the_library"


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> OpenScene:
    others = '<vehicle id="other" type="van" depart="0"><route edges="road"/></vehicle>'
    return build_scene(tmp_path_factory.mktemp("scenes") / "busy", others=others)


@pytest.fixture(params=[False, True], ids=["not_recorded", "recorded"])
def recorded(request: pytest.FixtureRequest) -> bool:
    return bool(request.param)


@pytest.fixture
def simulation(scene: OpenScene) -> Iterator[LibsumoSimulation]:
    """A simulation of one game with two background vehicles, after a step."""
    simulation = LibsumoSimulation(scene, 1, (True, True), seed=1)
    simulation.reset(0, placed(scene, (40, LEFT_Y, 0, 0), None), [van("first", 60), van("second", 120)])
    step(simulation)
    yield simulation
    simulation.close()


def van(name: str, position_m: float, depart_s: float = 0.0) -> Departure:
    return Departure(
        name=name,
        vehicle_type="van",
        edges=("road",),
        depart_s=depart_s,
        lane="0",
        position=str(position_m),
        speed="5",
    )


def step(simulation: LibsumoSimulation, games: int = 1) -> Reading:
    """A step in which the first player of every game stands on the left lane."""
    x, y = np.full((games, 2), 40.0), np.full((games, 2), LEFT_Y)
    return simulation.step(x, y, np.zeros((games, 2)))


def played(scene: OpenScene, recorded: bool) -> list[tuple[object, ...]]:
    """The readings of games with near, distant, late and leaving vehicles; the table of vehicles grows."""
    simulation = LibsumoSimulation(scene, GAMES, (True, True), seed=5, recorded=recorded)
    try:
        for game in range(GAMES):
            row = [van(f"v{k}", 20.0 + 20.0 * k) for k in range(7 + 3 * game)]
            late = [van(LONG, 10.0, depart_s=1.5), van("leaves", 290.0)]
            simulation.reset(game, placed(scene, (40, LEFT_Y, 0, 10), None), row + late)
        readings = [step(simulation, GAMES) for _ in range(STEPS)]
    finally:
        simulation.close()
    return [tuple(np.asarray(getattr(each, field.name)).tolist() for field in fields(each)) for each in readings]


def test_direct__is_available_on_linux_x86_64() -> None:
    on_it = (platform.system(), platform.machine()) == ("Linux", "x86_64")
    assert on_it == DIRECT


@pytest.mark.skipif(not DIRECT, reason="vehicles can't be read directly on this platform")
def test_reading__directly_and_through_python_has_the_same_bits(
    scene: OpenScene, recorded: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    directly = played(scene, recorded)
    monkeypatch.setattr(background_traffic, "DIRECT", False)
    assert played(scene, recorded) == directly
    assert any(LONG in names for names in directly[-1][0])
    assert not any("leaves" in names for names in directly[-1][0])


@pytest.mark.parametrize("direct", [False, True])
def test_reading__a_vehicle_that_sumo_has_lost_is_an_error(
    simulation: LibsumoSimulation, direct: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Read directly, it would end the process."""
    monkeypatch.setattr(background_traffic, "DIRECT", direct and DIRECT)
    libsumo.vehicle.remove("second")
    with pytest.raises(SimulationError, match="'second' is not known"):
        step(simulation)


def test_reading__after_a_player_was_removed_and_a_game_reset(
    scene: OpenScene, simulation: LibsumoSimulation, monkeypatch: pytest.MonkeyPatch
) -> None:
    """SUMO's number of vehicles is the expected one, so that they are read directly."""
    calls: list[bool] = []
    read_near = background_traffic.read_near

    def spied(*arguments, direct, **others):  # type: ignore[no-untyped-def]
        calls.append(direct)
        return read_near(*arguments, direct=direct, **others)

    monkeypatch.setattr(background_traffic, "read_near", spied)
    simulation.reset(0, placed(scene, (40, LEFT_Y, 0, 0), (20, LEFT_Y, 0, 0)), [van("third", 60), van("late", 5, 0.3)])
    for _ in range(5):
        step(simulation)
    simulation.remove(0, 1)
    assert step(simulation).names.tolist() == [["third", "late"]]
    assert calls == [DIRECT] * 6
