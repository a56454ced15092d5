"""Bicycles of the route file: SUMO rides them, and players see and touch their real bodies."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from harness.environments.arena import Arena, Seat
from harness.game.observation_layout import LAYOUT
from harness.game.outcome import Outcome
from tests.support.scenes import LEFT_Y, RIGHT_Y, build_scene, placed

BICYCLE = """<vType id="bike" vClass="bicycle" maxSpeed="4" sigma="0" speedDev="0"/>
<vehicle id="rider" type="bike" depart="0" departLane="0" departPos="60" departSpeed="3">
<route edges="road"/></vehicle>"""
LENGTH_M, WIDTH_M = 1.6, 0.65  # SUMO's for the class


def test_bicycle__of_the_route_file_is_seen_and_hit(tmp_path: Path) -> None:
    scene = build_scene(tmp_path / "scene", others=BICYCLE)
    arena = Arena(scene, 1, [Seat(None), Seat(None)])
    try:
        start = placed(scene, (30.0, RIGHT_Y, 0.0, 10.0), (30.0, LEFT_Y, 0.0, 10.0))
        arena.reset({0: start}, {0: scene.departures(np.random.default_rng(1))})
        while arena.state.outcome[0, 0] == Outcome.RUNNING:
            before_m = arena.state.x_m[0, 0]
            seen = dict(zip(LAYOUT, arena.observation[0, 0].tolist(), strict=True))
            step = arena.step(np.zeros((1, 2, 2)))
        bodies = step.quantities.bodies
    finally:
        arena.close()
    assert arena.state.outcome[0, 0] == Outcome.COLLISION
    assert (bodies.length_m[0, 2], bodies.width_m[0, 2]) == pytest.approx((LENGTH_M, WIDTH_M))
    assert before_m + 2.3 < bodies.x_m[0, 2] - 0.5 * LENGTH_M <= arena.state.x_m[0, 0] + 2.3
    assert seen["leader_seen"] == 1.0
    assert seen["other0_length_m"] in (pytest.approx(LENGTH_M / 20.0), pytest.approx(4.6 / 20.0))
    assert arena.state.outcome[0, 1] == Outcome.RUNNING  # beside it, in the other lane
