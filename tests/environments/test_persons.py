"""Persons of the route file: SUMO moves them, and players see and touch their real bodies."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from harness.environments.arena import Arena, Seat
from harness.game.observation_layout import LAYOUT
from harness.game.state import Outcome
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
