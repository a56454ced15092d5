"""Background vehicles: a reading is what SUMO has."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

import libsumo
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.errors import SimulationError
from harness.game.state import NOTICED_M
from harness.road.demand.route_file import Departure
from harness.sumo.simulation import distance_to_player_m, reading_of
from tests.support.scenes import LEFT_Y, build_scene, placed
from tests.support.simulations import local_simulation, stepped

GAMES, STEPS, VAN_M = 3, 40, 6.0
LONG = "a_name_that_is_longer_than_the_room_within_a_string_of_the_library"
OTHERS = '<vehicle id="other" type="van" depart="0"><route edges="road"/></vehicle>'


def van(name: str, position_m: float, depart_s: float = 0.0) -> Departure:
    where = {"lane": "0", "position": str(position_m), "speed": "5"}
    return Departure(name=name, vehicle_type="van", edges=("road",), depart_s=depart_s, **where)


@pytest.mark.parametrize("recorded", [False, True])
def test_reading__is_what_sumo_has(tmp_path: Path, recorded: bool) -> None:
    """Of all vehicles in a recorded game, else of those near a player; the table of vehicles grows."""
    scene = build_scene(tmp_path, others=OTHERS)
    with closing(local_simulation(scene, GAMES, seed=5, recorded=recorded)) as simulation:
        for game in range(GAMES):
            row = [van(f"v{k}", 20.0 + 20.0 * k) for k in range(7 + 3 * game)]
            late = [van(LONG, 10.0, depart_s=1.5), van("leaves", 290.0)]
            simulation.reset(game, placed(scene, (40, LEFT_Y, 0, 10), None), row + late)
        for _ in range(STEPS):
            x, y = np.full((GAMES, 2), 40.0), np.full((GAMES, 2), LEFT_Y)
            reading = stepped(simulation, x, y, np.zeros((GAMES, 2)))
            found = {}
            for game, place in np.argwhere(reading.present).tolist():
                assert reading.types[game, place] == "van"
                values = (reading.x_m, reading.heading_rad, reading.speed_mps, reading.length_m, reading.width_m)
                found[f"g{game}_{reading.names[game, place]}"] = [column[game, place] for column in values]
            for name in [each for each in libsumo.vehicle.getIDList() if not each.endswith("ego")]:
                front_m, speed_mps = libsumo.vehicle.getPosition(name)[0], libsumo.vehicle.getSpeed(name)
                heading = np.radians(90.0 - libsumo.vehicle.getAngle(name))
                if recorded or front_m < 40.0 + NOTICED_M:
                    expected = [front_m - 0.5 * VAN_M * np.cos(heading), heading, speed_mps, VAN_M, 2.0]
                    assert found.pop(name) == pytest.approx(expected, abs=1e-9)
            assert all(recorded is False and name[3:] != "leaves" for name in found), "a margin of a vehicle's length"


def test_reading__a_vehicle_that_sumo_has_lost_is_an_error(tmp_path: Path) -> None:
    scene = build_scene(tmp_path, others=OTHERS)
    with closing(local_simulation(scene)) as simulation:
        start = placed(scene, (40, LEFT_Y, 0, 0), None)
        simulation.reset(0, start, [van("first", 60), van("second", 120)])
        stepped(simulation, start.x_m[None], start.y_m[None], start.heading_rad[None])
        libsumo.vehicle.remove("second")
        with pytest.raises(SimulationError, match="'second' is not known"):
            stepped(simulation, start.x_m[None], start.y_m[None], start.heading_rad[None])


def test_distance__is_that_to_the_nearest_player_that_is_present() -> None:
    x_m, present = (
        np.array([[0.0, 70.0], [0.0, 70.0], [0.0, 70.0]]),
        np.array([[True, True], [True, False], [False] * 2]),
    )
    fronts_m = np.array([[60.0, 0.0], [60.0, 80.0], [60.0, 0.0]])
    found = distance_to_player_m(fronts_m, np.arange(3), (x_m, np.zeros((3, 2)), present))
    assert found.tolist() == [10.0, 100.0, np.inf]


@given(counts=st.lists(st.integers(0, 5), min_size=1, max_size=6))
def test_rows__have_all_vehicles_of_a_game_from_the_first_place_on(counts: list[int]) -> None:
    of_game = np.repeat(np.arange(len(counts)), counts)
    x, names = np.arange(1.0, len(of_game) + 1.0), [f"v{k}" for k in range(len(of_game))]
    motion, size_m = (x, -x, np.zeros_like(x), 2.0 * x), (np.full_like(x, 4.0), np.full_like(x, 2.0))
    reading = reading_of(len(counts), of_game, names=names, types=names, motion=motion, sizes_m=size_m)
    assert reading.present.tolist() == [[k < count for k in range(max(counts))] for count in counts]
    assert reading.names[reading.present].tolist() == names
    assert reading.x_m[reading.present].tolist() == (x - 2.0).tolist(), "the centre, half the length behind the front"
    assert reading.speed_mps[reading.present].tolist() == (2.0 * x).tolist()
    assert not reading.y_m[~reading.present].any()
