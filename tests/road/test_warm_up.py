"""The warm-up: games begin with traffic on the road, the same for the same seed, and clear of the players."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

import numpy as np
import platformdirs
import pytest

from harness.environments.arena import Arena, Seat
from harness.errors import UsageError
from harness.game.observation_layout import LAYOUT, in_units
from harness.road.demand import warm_up
from harness.road.demand.route_file import Departure
from harness.road.scene.load_check import check_loads
from harness.road.scene.open_scene import OpenScene, open_scene
from harness.sumo.insertion import CLEAR_AROUND_M, clear_of_players
from tests.support.rollouts import Steady, arm, play, trace
from tests.support.scenes import build_scene, drawn, placed

FLOW = """
    <flow id="right" type="van" begin="0" period="4" departSpeed="max" departLane="0"><route edges="road"/></flow>
    <flow id="left" type="van" begin="0" period="exp(0.2)" departSpeed="max" departLane="1">
        <route edges="road"/>
    </flow>"""


@pytest.fixture(autouse=True)
def _small_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(platformdirs, "user_cache_dir", lambda name: str(tmp_path / "cache"))
    monkeypatch.setattr(warm_up, "SNAPSHOTS", 6)


@pytest.fixture
def scene(tmp_path: Path) -> OpenScene:
    return warmed(tmp_path / "scene", FLOW, "warm_up_s = 40.0")


def warmed(folder: Path, others: str, keys: str) -> OpenScene:
    """A straight road of 300 m with background traffic and more keys in its document."""
    build_scene(folder, others=others)
    document = folder / "scene.toml"
    document.write_text(re.sub("(?m)^time_limit_s", f"{keys}\ntime_limit_s", document.read_text(), count=1))
    return open_scene(folder)


def on_road(departures: Sequence[Departure]) -> list[Departure]:
    return [each for each in departures if each.motion is not None]


def test_game__begins_with_traffic_on_the_road(scene: OpenScene) -> None:
    vehicles = on_road(scene.departures("a"))
    assert len(vehicles) >= 6  # 300 m at 13.89 m/s take 21.6 s: 5.4 vehicles on the right lane alone
    assert {each.name.split(".")[0] for each in vehicles} == {"right", "left"}
    assert all(each.motion and 0.0 < each.motion.x_m < 300.0 and each.motion.speed_mps > 5.0 for each in vehicles)


def test_game__later_vehicles_follow_the_rhythm_of_the_flow(scene: OpenScene) -> None:
    # vehicles 0 to 9 depart at 0, 4, ... 36 s, before the game begins at 40 s
    later = [each for each in scene.departures("a") if each.name.startswith("right") and not each.motion]
    assert [(each.name, each.depart_s) for each in later] == [(f"right.{10 + k}", 4.0 * k) for k in range(5)]


def test_game__begins_with_persons_on_their_way(tmp_path: Path) -> None:
    people = """<personFlow id="walkers" begin="0" end="100" period="10">
        <walk edges="road" arrivalPos="250"/></personFlow>"""
    scene = warmed(tmp_path / "scene", people, "warm_up_s = 40.0")
    found = sorted(on_road(scene.departures("a")), key=lambda each: each.name)
    assert [each.name for each in found] == [f"walkers.{k}.warm" for k in range(4)]
    # they began 40, 30, 20 and 10 s ago, at 5 km/h, with SUMO's differences of 10 % between persons and its dawdling
    walked_m = np.array([float(each.position) for each in found])
    assert walked_m / np.array([40.0, 30.0, 20.0, 10.0]) == pytest.approx(1.25, abs=0.4)
    with closing(Arena(scene, 1, [Seat(None), Seat(None)], recorded=True)) as arena:
        away = placed(scene, (150.0, -4.8, 0.0, 0.0), (150.0, -1.6, 0.0, 0.0))
        arena.reset({0: away}, {0: scene.departures("a")})
        for _ in range(2):
            arena.step(np.zeros((1, 2, 2)))
        assert arena.reading is not None
        places_m = dict(zip(arena.reading.names[0], arena.reading.x_m[0], strict=True))
    assert [places_m[each.name] for each in found] == pytest.approx(walked_m.tolist(), abs=1.0)


def test_game__with_the_same_seed_has_the_same_traffic(scene: OpenScene) -> None:
    first = scene.departures("a")
    again = open_scene(scene.folder)
    assert again.departures("a") == first  # from the cache
    assert {str(again.departures(k)) for k in range(5)} != {str(first)}


def test_density__is_drawn_for_each_game(tmp_path: Path) -> None:
    flow = FLOW.replace('period="4"', 'period="2"')
    scene = warmed(tmp_path / "scene", flow, "varies = { traffic_density = [0.5, 1.5] }")
    counts = [sum(each.name.startswith("right") for each in scene.departures(k)) for k in range(200)]
    # in 20 s at density d: 10 d vehicles, rounded up, d from 0.5 to 1.5
    assert min(counts) in (5, 6)
    assert max(counts) == 15
    assert np.mean(counts) == pytest.approx(10.5, abs=0.7)


def test_density__of_a_warmed_game_is_that_of_its_warm_up(tmp_path: Path) -> None:
    scene = warmed(tmp_path / "scene", FLOW, "warm_up_s = 30\nvaries = { traffic_density = [0.5, 1.5] }")
    densities = [each.density for each in scene.warm_up]
    vehicles = [len(each.vehicles) for each in scene.warm_up]
    assert max(densities) - min(densities) > 0.4
    assert np.corrcoef(densities, vehicles)[0, 1] > 0.7


@pytest.mark.parametrize("games", [1, 3])
def test_arena__has_the_vehicles_where_the_warm_up_left_them(scene: OpenScene, games: int) -> None:
    start = drawn(scene, 1)
    departures = scene.departures("b")
    expected = clear_of_players(departures, start, scene.world.length_m)
    with closing(Arena(scene, games, [Seat(Steady()), Seat(Steady())], recorded=True)) as arena:
        for _ in range(2):  # a second game begins as the first one did
            arena.reset(dict.fromkeys(range(games), start), dict.fromkeys(range(games), departures))
            arena.step()
            reading = arena.reading
            assert reading is not None
            for game in range(games):
                x_m = dict(zip(reading.names[game], reading.x_m[game], strict=True))
                for each in on_road(expected):
                    assert each.motion is not None
                    moved = x_m[each.name] + 0.5 * each.motion.length_m - each.motion.x_m
                    assert moved == pytest.approx(each.motion.speed_mps * scene.world.step_s, abs=0.12)


def test_first_observation__shows_the_vehicles_of_the_warm_up(scene: OpenScene) -> None:
    van = next(each for each in on_road(scene.departures("b")) if each.lane == "road_0")
    assert van.motion is not None
    start = placed(scene, (van.motion.x_m - 40.0, van.motion.y_m, 0.0, 10.0), None)
    with closing(Arena(scene, 1, [Seat(Steady()), Seat(Steady())])) as arena:
        arena.reset({0: start}, {0: [van]})
        seen = dict(zip(LAYOUT, in_units(arena.observation[0, 0], 0.5), strict=True))
    assert seen["other0_ahead_m"] == pytest.approx(40.0 - 3.0, abs=1e-3)  # to the middle of the van
    assert seen["leader_gap_m"] == pytest.approx(40.0 - 6.0 - 2.3, abs=1e-3)
    assert seen["leader_mps"] == pytest.approx(van.motion.speed_mps - 10.0, abs=1e-3)


def test_trace__has_the_vehicles_from_the_first_sample_on(scene: OpenScene) -> None:
    (game,) = play(arm(scene, Steady(), Steady()), 1)
    frame = trace(game)
    first, second = (frame[(frame["step"] == k) & frame["player"].str.endswith(".warm")] for k in (0, 1))
    assert len(first) > 3
    assert first["player"].tolist() == second["player"].tolist()
    assert first["vehicle_type"].tolist() == second["vehicle_type"].tolist()
    moved_m = second["x_m"].to_numpy() - first["x_m"].to_numpy()
    np.testing.assert_allclose(moved_m, second["speed_mps"] * scene.world.step_s, atol=0.01)


def test_start__is_clear_of_vehicles(scene: OpenScene) -> None:
    start = drawn(scene, 1)
    kept = on_road(clear_of_players(scene.departures("b"), start, scene.world.length_m))
    assert kept
    for each in kept:
        assert each.motion is not None
        distance_m = np.hypot(
            each.motion.x_m - 3.0 - start.x_m, each.motion.y_m - start.y_m
        )  # 3 m: half the length of the van
        assert (distance_m >= CLEAR_AROUND_M + 0.5 * (6.0 + scene.world.length_m)).all()


def test_stop__goes_on_for_the_rest_of_its_time(tmp_path: Path) -> None:
    bus = """<vehicle id="bus" type="van" depart="0" departPos="100" departSpeed="10"><route edges="road"/>
        <stop lane="road_0" endPos="200" duration="60"/></vehicle>"""
    (vehicle,) = warmed(tmp_path / "scene", bus, "warm_up_s = 40.0").warm_up[0].vehicles
    assert vehicle.motion is not None
    assert vehicle.motion.speed_mps == 0.0
    (stop,) = vehicle.stops
    assert stop.duration_s is not None
    assert 25.0 < stop.duration_s < 35.0  # it arrived after some 10 s


def test_warm_up__that_sumo_can_not_run_is_named(scene: OpenScene, monkeypatch: pytest.MonkeyPatch) -> None:
    failed = subprocess.CompletedProcess([], 1, stderr="out of order")
    monkeypatch.setattr(warm_up, "run_program", lambda *_: failed)
    with pytest.raises(UsageError, match=r"scene.toml: warm_up_s: SUMO failed in the warm-up: out of order"):
        check_loads(scene)
