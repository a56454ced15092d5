"""The simulation of this process, compared with SUMO's own state."""

from __future__ import annotations

import gc
import subprocess
import sys
import weakref
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import libsumo
import numpy as np
import pytest

from harness.errors import SimulationError
from harness.game.human_factors import HumanFactors
from harness.game.initial_state import InitialState, draw_initial_state
from harness.road.demand.route_file import Departure
from harness.road.scene.open_scene import OpenScene, open_scene
from harness.sumo.libsumo_simulation import LibsumoSimulation
from harness.sumo.simulation import Reading
from tests.support.repository import REPOSITORY
from tests.support.scenes import LEFT_Y, RIGHT_Y, build_scene, placed
from tests.support.simulations import local_simulation, stepped

HARNESS, SUMO = True, False
BACKGROUND = '<vehicle id="other" type="van" depart="0"><route edges="road"/></vehicle>'
Open = Callable[..., LibsumoSimulation]


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> OpenScene:
    return build_scene(tmp_path_factory.mktemp("scenes") / "straight")


@pytest.fixture(scope="module")
def busy(tmp_path_factory: pytest.TempPathFactory) -> OpenScene:
    """The same road with background traffic, which the tests define."""
    return build_scene(tmp_path_factory.mktemp("scenes") / "busy", others=BACKGROUND)


@pytest.fixture
def opened(scene: OpenScene) -> Iterator[Open]:
    """Opens simulations of the straight road, and closes them."""
    simulations = []

    def opened(
        taken_over: tuple[bool, bool] = (HARNESS, HARNESS), games: int = 1, on: OpenScene = scene, seed: int = 1
    ):
        simulations.append(local_simulation(on, games, taken_over, seed))
        return simulations[-1]

    yield opened
    for each in simulations:
        each.close()
    assert not libsumo.isLoaded()


def test_bicycle__starts_anywhere_along_its_route(opened: Open) -> None:
    """SUMO refuses a vehicle whose speed exceeds what its type desires: 5.6 m/s here, at a maxSpeed of 8 m/s."""
    scene = open_scene(REPOSITORY / "networks" / "cyclist")
    starts = scene.start_distribution([HumanFactors()] * 2, [0.0, 1.0], along_route_share=1.0)
    drawn = [draw_initial_state(starts, "training", seed) for seed in range(20)]
    assert max(float(each.speed_mps[1]) for each in drawn) > 5.6
    assert all(each.speed_mps[1] <= 8.0 for each in drawn)
    simulation = opened(on=scene)
    for each in drawn:
        simulation.reset(0, each, [])


def other(name: str, depart_s: float = 0.0, lane: str = "0", position: str = "100", speed: str = "5") -> Departure:
    where = {"lane": lane, "position": position, "speed": speed}
    return Departure(name=name, vehicle_type="van", edges=("road",), depart_s=depart_s, **where)


def step(simulation: LibsumoSimulation, start: InitialState) -> Reading:
    """A step in which the players stay at their start."""
    return stepped(simulation, start.x_m[None], start.y_m[None], start.heading_rad[None])


def centre_in_sumo(name: str) -> tuple[float, float, float]:
    x, y = libsumo.vehicle.getPosition(name)
    heading = np.radians(90.0 - libsumo.vehicle.getAngle(name))
    return x - 2.3 * np.cos(heading), y - 2.3 * np.sin(heading), np.angle(np.exp(1j * heading))


# --- players ----------------------------------------------------------------------------------------------------------


def test_step__sumo_has_the_poses_of_the_players_in_every_game(scene: OpenScene, opened: Open) -> None:
    simulation, generator = opened(games=2), np.random.default_rng(0)
    start = placed(scene, (40, RIGHT_Y, 0, 10), (40, LEFT_Y, 0, 10))
    simulation.reset(1, start, [])
    for reach_m in (0, 2000, 0, 0):  # on the road of 300 m and beside it, and far off
        simulation.reset(0, start, [])
        for _ in range(50):
            x, y = generator.uniform(10 - reach_m, 290 + reach_m, (2, 2)), generator.uniform(-9, 3, (2, 2))
            heading = generator.uniform(-np.pi, np.pi, (2, 2))
            for _ in range(5):
                stepped(simulation, x, y, heading)
            for k, name in enumerate(("g0_ego", "g0_non_ego")):
                assert centre_in_sumo(name) == pytest.approx((x[0, k], y[0, k], heading[0, k]), abs=1e-3)
        assert set(libsumo.vehicle.getIDList()) == {"g0_ego", "g0_non_ego", "g1_ego", "g1_non_ego"}
        simulation.remove(0, 1)


def test_step__tiles_are_side_by_side_and_independent(busy: OpenScene, opened: Open) -> None:
    simulation = opened(games=3, on=busy)
    for game in range(3):
        simulation.reset(game, placed(busy, (40, RIGHT_Y, 0, 10), None), [other("van")])
    poses = np.array([[50.0, 0.0], [60.0, 0.0], [70.0, 0.0]]), np.full((3, 2), RIGHT_Y), np.zeros((3, 2))
    reading = stepped(simulation, *poses)
    assert [round(libsumo.vehicle.getPosition(f"g{k}_ego")[0] - 2.3) for k in range(3)] == [50, 60, 70]
    assert len({libsumo.vehicle.getPosition(f"g{k}_ego")[1] for k in range(3)}) == 3
    assert reading.names.tolist() == [["van"]] * 3
    np.testing.assert_allclose(reading.y_m, RIGHT_Y, atol=1e-6)


def test_step__sumo_has_the_speed_of_a_player_above_the_limit(busy: OpenScene, opened: Open) -> None:
    simulation = opened(on=busy)
    simulation.reset(0, placed(busy, (40, RIGHT_Y, 0, 12), None), [])
    speeds = []
    for k in range(1, 4):
        stepped(simulation, np.array([[40 + 2.5 * k, 0]]), np.array([[RIGHT_Y, 0]]), np.zeros((1, 2)))
        speeds.append(libsumo.vehicle.getSpeed("ego"))
    assert speeds == pytest.approx([12, 25, 25])  # the first step has the start speed


def test_reset__players_that_sumo_drives_start_at_their_pose_and_speed_and_drive_on(
    scene: OpenScene, opened: Open
) -> None:
    simulation = opened((HARNESS, SUMO))
    start = placed(scene, (40, RIGHT_Y, 0, 10), (50, LEFT_Y, 0, 9))
    simulation.reset(0, start, [])
    players = [step(simulation, start).players[0] for _ in range(20)]
    assert np.isnan(players[0][0]).all()
    np.testing.assert_allclose(players[0][1], (50.9, LEFT_Y, 0, 9), atol=1e-6)
    for before, after in pairwise(players):
        assert after[1, 0] - before[1, 0] == pytest.approx(0.1 * after[1, 3])
        assert abs(after[1, 3] - before[1, 3]) <= 0.3


def test_reset__a_player_that_sumo_drives_starts_where_sumo_would_not_insert_it(scene: OpenScene, opened: Open) -> None:
    simulation = opened((HARNESS, SUMO))
    start = placed(scene, (45.2, RIGHT_Y, 0, 0), (40, RIGHT_Y, 0, 13))
    simulation.reset(0, start, [])
    assert step(simulation, start).players[0, 1, 3] == pytest.approx(13)


def test_reset__a_start_speed_above_the_limit_of_sumo_is_reduced_to_it(tmp_path: Path, opened: Open) -> None:
    slow = '<vType id="ego_car"/><vType id="person_car" speedFactor="0.9" speedDev="0"/>'
    scene = build_scene(tmp_path / "slow", cars=slow)
    simulation = opened((HARNESS, SUMO), on=scene)
    start = placed(scene, (40, RIGHT_Y, 0, 30), (40, LEFT_Y, 0, 14))
    simulation.reset(0, start, [])
    assert step(simulation, start).players[0, 1, 3] == pytest.approx(0.9 * 13.89)


@pytest.mark.parametrize("by_sumo", [(HARNESS, SUMO), (HARNESS, HARNESS)])
def test_reset__removes_all_vehicles_of_the_previous_game(
    scene: OpenScene, opened: Open, by_sumo: tuple[bool, bool]
) -> None:
    simulation = opened(by_sumo)
    both, alone = placed(scene, (40, RIGHT_Y, 0, 10), (40, LEFT_Y, 0, 10)), placed(scene, (90, LEFT_Y, 0, 10), None)
    for start, expected in ((both, {"ego", "non_ego", "van"}), (alone, {"ego"}), (both, {"ego", "non_ego"})):
        simulation.reset(0, start, [other("van")] if len(expected) == 3 else [])
        for _ in range(5):
            step(simulation, start)
        assert set(libsumo.vehicle.getIDList()) == expected


def test_halt__a_player_that_sumo_drove_stands_at_the_given_pose(scene: OpenScene, opened: Open) -> None:
    simulation = opened((HARNESS, SUMO))
    start = placed(scene, (40, RIGHT_Y, 0, 10), (40, LEFT_Y, 0, 10))
    simulation.reset(0, start, [])
    step(simulation, start)
    simulation.halt(0, 1)
    for _ in range(3):
        reading = step(simulation, start)
    assert np.isnan(reading.players).all()
    assert centre_in_sumo("non_ego") == pytest.approx((40, LEFT_Y, 0), abs=1e-6)
    simulation.reset(0, start, [])
    assert step(simulation, start).players[0, 1, 0] == pytest.approx(41.0)


# --- background traffic------------------------------------------------------------------------------------------------


def test_background__waits_while_a_player_blocks_the_insertion(busy: OpenScene, opened: Open) -> None:
    simulation = opened(on=busy)
    start = placed(busy, (4, RIGHT_Y, 0, 0), None)
    simulation.reset(0, start, [other("waiting", 0.2, "0", "base", "10")])
    readings = [step(simulation, start) for _ in range(10)]
    assert not any(reading.present.any() for reading in readings)
    moved = replace(start, x_m=start.x_m + 60)
    assert [step(simulation, moved).present.any() for _ in range(3)][-1]


def test_background__waiting_vehicles_are_removed_by_a_reset(busy: OpenScene, opened: Open) -> None:
    simulation = opened(on=busy)
    start = placed(busy, (4, RIGHT_Y, 0, 0), None)
    for _ in range(2):
        simulation.reset(0, start, [other("waiting", 0.0, "0", "base", "10")])
        for _ in range(3):
            reading = step(simulation, start)
    assert reading.names.tolist() == [["waiting"]]
    simulation.reset(0, replace(start, x_m=start.x_m + 60), [])
    assert step(simulation, replace(start, x_m=start.x_m + 60)).names.tolist() == [[]]
    assert libsumo.vehicle.getIDList() == ("ego",)


def test_background__a_refused_vehicle_is_an_error_with_the_message_of_sumo(busy: OpenScene, opened: Open) -> None:
    simulation = opened(on=busy)
    with pytest.raises(SimulationError, match=r"reset game 0.*departLane.*refused"):
        simulation.reset(0, placed(busy, (40, LEFT_Y, 0, 0), None), [other("refused", lane="7")])


def test_reload__the_same_seed_gives_the_same_traffic(tmp_path: Path, opened: Open) -> None:
    scene = build_scene(tmp_path, others='<flow id="f" type="van" begin="0" period="2"><route edges="road"/></flow>')
    simulation, start = opened(on=scene), placed(build_scene(tmp_path), (150, LEFT_Y, 0, 0), None)

    def played(seed: int) -> bytes:
        simulation.reload(seed)
        simulation.reset(0, start, scene.departures(0))
        return b"".join(step(simulation, start).x_m.tobytes() for _ in range(80))

    assert played(1) == played(1) != played(2)


# --- one libsumo per process ------------------------------------------------------------------------------------------


def test_local__there_can_be_one(scene: OpenScene, opened: Open) -> None:
    first = opened()
    with pytest.raises(SimulationError, match="already"):
        opened()
    first.close()
    opened()


def test_close__twice_has_no_effect_on_the_next_simulation(scene: OpenScene, opened: Open) -> None:
    first = opened()
    first.close()
    second = opened()
    first.close()
    start = placed(scene, (40, LEFT_Y, 0, 0), None)
    second.reset(0, start, [])
    step(second, start)
    for call in (lambda: first.reload(1), lambda: first.reset(0, start, []), lambda: step(first, start)):
        with pytest.raises(SimulationError, match="closed"):
            call()


def test_garbage__releases_libsumo(scene: OpenScene) -> None:
    simulation = weakref.ref(local_simulation(scene))
    gc.collect()
    assert simulation() is None
    assert not libsumo.isLoaded()


def test_failed_load__is_an_error_and_leaves_libsumo_free(scene: OpenScene) -> None:
    broken = replace(scene, routes=replace(scene.routes, types_xml="<routes><vType/></routes>"))
    with pytest.raises(SimulationError, match="load scene 'small'"):
        local_simulation(broken)
    assert not libsumo.isLoaded()


def test_exit__without_close_is_quiet_and_leaves_no_file(scene: OpenScene, tmp_path: Path) -> None:
    program = f"""
import pathlib
from harness.road.scene.open_scene import open_scene
from tests.support.simulations import local_simulation
simulation = local_simulation(open_scene(pathlib.Path({str(scene.folder)!r})))
"""
    run = subprocess.run(
        [sys.executable, "-X", "dev", "-c", program],
        cwd=REPOSITORY,
        env={"TMPDIR": str(tmp_path), "PATH": ""},
        capture_output=True,
        text=True,
    )
    assert (run.returncode, run.stderr) == (0, "")
    assert list(tmp_path.iterdir()) == []
