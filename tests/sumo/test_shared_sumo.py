"""Simulations of several scenes in one SUMO: each has the numbers that it has alone."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, closing
from dataclasses import replace
from pathlib import Path

import libsumo
import numpy as np
import pytest

from harness.drivers.sumo import SumoDriver
from harness.environments.arena import Arena
from harness.environments.seats import Seat
from harness.errors import SimulationError
from harness.game.arrays import FloatArray
from harness.road.demand.route_file import Departure
from harness.road.scene.open_scene import OpenScene, open_scene
from harness.sumo.libsumo_simulation import LibsumoSimulation
from harness.sumo.scene_games import SceneGames, can_share
from harness.sumo.simulation import Reading
from harness.sumo.subprocess_simulation import SubprocessSimulation, open_simulations
from tests.support.repository import REPOSITORY
from tests.support.scenes import CARS, LEFT_Y, RIGHT_Y, build_scene, drawn, placed
from tests.support.simulations import games_of

SHORT_VANS = CARS.replace('id="van" length="6.0"', 'id="van" length="5.0"')
VAN = Departure(
    name="van", vehicle_type="van", edges=("road",), depart_s=0.0, lane="1", position="280", speed="10"
)  # it arrives after two seconds
FAR_OFF = np.zeros((1, 2)), np.array([[RIGHT_Y, LEFT_Y]]), np.zeros((1, 2))


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> OpenScene:
    return build_scene(tmp_path_factory.mktemp("scenes") / "long")


@pytest.fixture(scope="module")
def other(tmp_path_factory: pytest.TempPathFactory) -> OpenScene:
    """The same road with vans of another length, under the same id."""
    return build_scene(tmp_path_factory.mktemp("scenes") / "short", cars=SHORT_VANS)


@pytest.fixture
def shared(scene: OpenScene, other: OpenScene) -> Iterator[list[LibsumoSimulation]]:
    simulations = LibsumoSimulation.side_by_side([games_of(scene, recorded=True), games_of(other, recorded=True)], 1)
    yield simulations
    simulations[0].close()
    assert not libsumo.isLoaded()


def played(arena: Arena, actions: FloatArray) -> Iterator[bytes]:
    """What an arena shows after the halves of its steps: one value for each half."""
    arena.reset({game: drawn(arena.scene, "shared", game) for game in range(arena.games)})
    for action in actions:
        arena.place(action)
        yield b""
        payoff = arena.advance().payoff
        yield arena.observation.tobytes() + payoff.tobytes() + arena.state.x_m.tobytes()


def test_arenas__have_the_same_bytes_in_one_sumo_as_alone() -> None:
    scenes = [open_scene(REPOSITORY / "networks" / name) for name in ("merge", "roundabout", "left_across")]
    actions = np.random.default_rng(0).normal(0.1, 0.2, (40, 3, 2, 2))
    alone = []
    for scene in scenes:
        with closing(Arena(scene, 3, [Seat(None), Seat(None)], seed=1)) as arena:
            alone.append(list(played(arena, actions)))
    simulations = open_simulations([games_of(scene, 3) for scene in scenes], seed=1)
    assert {type(each) for each in simulations} == {LibsumoSimulation}
    with ExitStack() as stack:
        arenas = []
        for scene, simulation in zip(scenes, simulations, strict=True):
            arena = Arena(scene, 3, [Seat(None), Seat(None)], simulation=simulation)
            arenas.append(played(stack.enter_context(closing(arena)), actions))
        in_turn = list(zip(*arenas, strict=True))
    assert [list(of_one) for of_one in zip(*in_turn, strict=True)] == alone


def test_types__with_the_same_id_are_those_of_their_own_scene(
    scene: OpenScene, other: OpenScene, shared: list[LibsumoSimulation]
) -> None:
    readings = step_with_van(shared, scene, other)
    assert [reading.length_m[0, 0] for reading in readings] == [6.0, 5.0]
    assert [reading.types[0, 0] for reading in readings] == ["van", "van"]
    assert [reading.names[0, 0] for reading in readings] == ["van", "van"]


def test_arrival__in_one_scene_is_no_error_in_the_other(
    scene: OpenScene, other: OpenScene, shared: list[LibsumoSimulation]
) -> None:
    step_with_van(shared, scene, other)
    shared[1].reset(0, placed(other, (40, RIGHT_Y, 0, 10), None), [])  # its van is gone, the first scene's drives on
    counts = []
    for _ in range(40):
        for each in shared:
            each.place(*FAR_OFF)
        counts.append([int(each.step().present.sum()) for each in shared])
    assert counts[0] == [1, 0]
    assert counts[-1] == [0, 0]


def step_with_van(shared: list[LibsumoSimulation], *scenes: OpenScene) -> list[Reading]:
    for each, scene in zip(shared, scenes, strict=True):
        each.reset(0, placed(scene, (40, RIGHT_Y, 0, 10), None), [VAN])
    for each in shared:
        each.place(*FAR_OFF)
    return [each.step() for each in shared]


def test_step__is_one_step_of_sumo_for_all(scene: OpenScene, other: OpenScene, shared: list[LibsumoSimulation]) -> None:
    step_with_van(shared, scene, other)
    assert libsumo.simulation.getTime() == pytest.approx(0.1)


def test_step__before_all_have_placed_their_players_is_an_error(
    scene: OpenScene, other: OpenScene, shared: list[LibsumoSimulation]
) -> None:
    step_with_van(shared, scene, other)
    shared[0].place(*FAR_OFF)
    with pytest.raises(SimulationError, match="1 of 2 simulations have placed their players"):
        shared[0].step()


def test_place__twice_by_one_simulation_does_not_count_for_another(
    scene: OpenScene, other: OpenScene, shared: list[LibsumoSimulation]
) -> None:
    step_with_van(shared, scene, other)
    for _ in range(2):
        shared[0].place(*FAR_OFF)
    with pytest.raises(SimulationError, match="1 of 2 simulations have placed their players"):
        shared[0].step()
    shared[1].place(*FAR_OFF)
    shared[0].step()
    assert libsumo.simulation.getTime() == pytest.approx(0.2)


def test_reload__loads_sumo_once_for_all(
    scene: OpenScene, other: OpenScene, shared: list[LibsumoSimulation], monkeypatch: pytest.MonkeyPatch
) -> None:
    step_with_van(shared, scene, other)
    loads, load = [], libsumo.load
    monkeypatch.setattr(libsumo, "load", lambda options: (loads.append(options), load(options)))
    for each in shared:
        each.reload(2)
    assert len(loads) == 1
    step_with_van(shared, scene, other)
    assert libsumo.simulation.getTime() == pytest.approx(0.1)


def test_scenes__with_other_options_of_sumo_have_a_process_of_their_own(scene: OpenScene, other: OpenScene) -> None:
    by_sumo = SceneGames(scene=scene, games=1, taken_over=(True, False))
    assert not can_share(games_of(other), by_sumo)
    simulations = open_simulations([games_of(scene), by_sumo, games_of(other), by_sumo], seed=1)
    kinds, far = (
        [type(each) for each in simulations],
        [each for each in simulations if isinstance(each, SubprocessSimulation)],
    )
    for each in simulations:
        each.close()
    assert kinds == [LibsumoSimulation, SubprocessSimulation] * 2
    assert far[0].child is far[1].child


def test_simulations__side_by_side_in_a_child_give_the_same_bytes_and_rules() -> None:
    scenes = [open_scene(REPOSITORY / "networks" / name) for name in ("merge", "left_across")]
    parts = [SceneGames(scene=scene, games=2, taken_over=(True, False)) for scene in scenes]
    actions = np.random.default_rng(0).normal(0.1, 0.2, (40, 2, 2, 2))
    found = []
    for kind in (LibsumoSimulation, SubprocessSimulation):
        simulations = kind.side_by_side(parts, 1)
        with ExitStack() as stack:
            arenas = []
            for scene, simulation in zip(scenes, simulations, strict=True):
                arena = Arena(scene, 2, [Seat(None), Seat(SumoDriver())], simulation=simulation)
                arenas.append(played(stack.enter_context(closing(arena)), actions))
            found.append(list(zip(*arenas, strict=True)))
            simulations[0].place(*(np.repeat(each, 2, axis=0) for each in FAR_OFF))
            with pytest.raises(SimulationError, match="1 of 2 simulations have placed their players"):
                simulations[0].step()
    assert found[0] == found[1]


def test_failure__of_one_scene_closes_all(scene: OpenScene, tmp_path: Path) -> None:
    broken = replace(scene, routes=replace(scene.routes, types_xml='<routes><vType id="a" length="-1"/></routes>'))
    with pytest.raises(SimulationError):
        open_simulations([games_of(scene), games_of(broken)], seed=1)
    assert not libsumo.isLoaded()
