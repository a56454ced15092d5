"""Persons and bicycles of the route file: SUMO moves them, and players see and touch their real bodies."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.game.observation_layout import LAYOUT
from harness.game.outcome import Outcome
from harness.replay.vehicles import types_of_vehicles
from tests.support.rollouts import Steady, arm, play, trace
from tests.support.scenes import LEFT_Y, RIGHT_Y, build_scene, placed

LENGTH_M, WIDTH_M = 0.215, 0.478  # SUMO's for the class
PERSON = """<person id="walker" depart="0" departPos="60" speedFactor="1"><walk edges="road" arrivalPos="200"/></person>
"""
Open = Callable[..., Any]


BICYCLE = """<vType id="bike" vClass="bicycle" maxSpeed="4" sigma="0" speedDev="0"/>
<vehicle id="rider" type="bike" depart="0" departLane="0" departPos="60" departSpeed="3">
<route edges="road"/></vehicle>"""


@pytest.mark.parametrize(
    ("others", "size_m", "speed_mps", "name"),
    [
        (PERSON, (LENGTH_M, WIDTH_M), 1.39, ("walker", "DEFAULT_PEDTYPE")),  # 5 km/h, less SUMO's dawdling
        (BICYCLE, (1.6, 0.65), 4.0, ("rider", "bike")),  # SUMO's size of the class
    ],
    ids=["person", "bicycle"],
)
def test_others__of_the_route_file_are_seen_and_hit(
    others: str, size_m: Any, speed_mps: float, name: Any, tmp_path: Path, arena_of: Open
) -> None:
    scene = build_scene(tmp_path / "scene", others=others)
    arena = arena_of(scene)
    moved_mps: list[float] = []
    start = placed(scene, (30.0, RIGHT_Y - 0.5, 0.0, 10.0), (30.0, LEFT_Y, 0.0, 10.0))
    arena.reset({0: start}, {0: scene.departures(1)})
    while arena.state.outcome[0, 0] == Outcome.RUNNING:
        before_m = arena.state.x_m[0, 0]
        seen = dict(zip(LAYOUT, arena.observation[0, 0].tolist(), strict=True))
        bodies = arena.step(np.zeros((1, 2, 2))).quantities.bodies
        moved_mps.append(arena.reading.speed_mps[0, 0])
    assert arena.state.outcome[0].tolist() == [
        Outcome.COLLISION,
        Outcome.RUNNING,
    ]  # beside it
    assert (bodies.length_m[0, 2], bodies.width_m[0, 2]) == pytest.approx(size_m)
    assert before_m + 2.3 < bodies.x_m[0, 2] - 0.5 * size_m[0] <= arena.state.x_m[0, 0] + 2.3
    assert np.mean(moved_mps[1:-1]) == pytest.approx(speed_mps, abs=0.25)
    assert (arena.reading.names[0, 0], arena.reading.types[0, 0]) == name
    assert seen["leader_seen"] == 1.0


def test_person__is_in_the_trace_and_looks_like_one_in_the_replay(tmp_path: Path) -> None:
    scene = build_scene(tmp_path / "scene", others=PERSON)
    recorded = trace(play(arm(scene, Steady(), Steady()), episodes=1)[0])
    rows = recorded[recorded["player"] == "walker"]
    assert rows["x_m"].iloc[0] == pytest.approx(60.0, abs=0.2)
    assert rows["x_m"].is_monotonic_increasing
    drawn = types_of_vehicles(recorded, scene.routes.types_xml)["walker"]
    assert (drawn.shape, drawn.length_m, drawn.width_m) == ("pedestrian", LENGTH_M, WIDTH_M)


def test_persons__of_all_games_leave_at_the_reset(tmp_path: Path, arena_of: Open) -> None:
    flow = """<personFlow id="walkers" begin="0" end="100" period="1" departPos="random">
        <walk edges="road" arrivalPos="max"/></personFlow>"""
    scene = build_scene(tmp_path / "scene", others=flow)
    arena = arena_of(scene, 2, recorded=True)
    start = placed(scene, (30.0, RIGHT_Y, 0.0, 0.0), (30.0, LEFT_Y, 0.0, 0.0))
    departures = scene.departures(1)
    arena.reset({0: start, 1: start}, {0: departures, 1: departures})
    for _ in range(50):
        arena.step(np.zeros((2, 2, 2)))
    before = arena.reading.present.sum(1).tolist()
    arena.reset({1: start}, {1: departures})
    arena.step(np.zeros((2, 2, 2)))
    after = arena.reading.present.sum(1).tolist()
    assert before == [5, 5]  # one a second
    assert after == [6, 1]  # at 5.0 s a sixth one departs in the first game
