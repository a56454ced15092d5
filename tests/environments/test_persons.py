"""Persons of the route file: SUMO moves them, and players see and touch their real bodies."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from harness.environments.arena import Arena, Seat
from harness.game.observation_layout import LAYOUT
from harness.game.outcome import Outcome
from harness.replay.vehicles import types_of_vehicles
from tests.support.rollouts import Steady, arm, play, trace
from tests.support.scenes import LEFT_Y, RIGHT_Y, build_scene, placed

LENGTH_M, WIDTH_M = 0.215, 0.478  # SUMO's for the class
PERSON = """<person id="walker" depart="0" departPos="60" speedFactor="1"><walk edges="road" arrivalPos="200"/></person>
"""


def test_person__of_the_route_file_is_seen_and_hit(tmp_path: Path) -> None:
    scene = build_scene(tmp_path / "scene", others=PERSON)
    arena = Arena(scene, 1, [Seat(None), Seat(None)])
    walked_mps: list[float] = []
    try:
        start = placed(scene, (30.0, RIGHT_Y - 0.5, 0.0, 10.0), (30.0, LEFT_Y, 0.0, 10.0))
        arena.reset({0: start}, {0: scene.departures(np.random.default_rng(1))})
        while arena.state.outcome[0, 0] == Outcome.RUNNING:
            seen = dict(zip(LAYOUT, arena.observation[0, 0].tolist(), strict=True))
            step = arena.step(np.zeros((1, 2, 2)))
            walked_mps.append(arena.reading.speed_mps[0, 0])
        bodies, reading = step.quantities.bodies, arena.reading
    finally:
        arena.close()
    assert arena.state.outcome[0, 0] == Outcome.COLLISION
    assert (bodies.length_m[0, 2], bodies.width_m[0, 2]) == pytest.approx((LENGTH_M, WIDTH_M))
    assert np.mean(walked_mps[1:-1]) == pytest.approx(1.39, abs=0.25)  # 5 km/h, less SUMO's dawdling
    assert (reading.names[0, 0], reading.types[0, 0]) == ("walker", "DEFAULT_PEDTYPE")
    assert seen["leader_seen"] == 1.0
    assert arena.state.outcome[0, 1] == Outcome.RUNNING  # beside it, in the other lane


def test_person__is_in_the_trace_and_looks_like_one_in_the_replay(tmp_path: Path) -> None:
    scene = build_scene(tmp_path / "scene", others=PERSON)
    recorded = trace(play(arm(scene, Steady(), Steady()), episodes=1)[0])
    rows = recorded[recorded["player"] == "walker"]
    assert rows["x_m"].iloc[0] == pytest.approx(60.0, abs=0.2)
    assert rows["x_m"].is_monotonic_increasing
    drawn = types_of_vehicles(recorded, scene.route_files)["walker"]
    assert (drawn.shape, drawn.length_m, drawn.width_m) == ("pedestrian", LENGTH_M, WIDTH_M)


def test_persons__of_all_games_leave_at_the_reset(tmp_path: Path) -> None:
    flow = """<personFlow id="walkers" begin="0" end="100" period="1" departPos="random">
        <walk edges="road" arrivalPos="max"/></personFlow>"""
    scene = build_scene(tmp_path / "scene", others=flow)
    arena = Arena(scene, 2, [Seat(None), Seat(None)], recorded=True)
    try:
        start = placed(scene, (30.0, RIGHT_Y, 0.0, 0.0), (30.0, LEFT_Y, 0.0, 0.0))
        departures = scene.departures(np.random.default_rng(1))
        arena.reset({0: start, 1: start}, {0: departures, 1: departures})
        for _ in range(50):
            arena.step(np.zeros((2, 2, 2)))
        before = arena.reading.present.sum(1).tolist()
        arena.reset({1: start}, {1: departures})
        arena.step(np.zeros((2, 2, 2)))
        after = arena.reading.present.sum(1).tolist()
    finally:
        arena.close()
    assert before == [5, 5]  # one a second
    assert after == [6, 1]  # at 5.0 s a sixth one departs in the first game
