"""Obstacles in games: contact, observation, starts of a training, and the recorded trace."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from harness.environments.arena import Arena
from harness.game.geometry import Box, box_distance
from harness.game.human_factors import HumanFactors
from harness.game.initial_state import draw_initial_state
from harness.game.observation_layout import LAYOUT
from harness.game.outcome import Outcome
from harness.road.scene.open_scene import OpenScene, open_scene
from tests.support.scenes import LEFT_Y, RIGHT_Y, build_scene, placed

VAN = '[[obstacle]]\nkind = "van"\nlane = "road_0"\nposition_m = {}\n'
SIZE_M = (6.5, 2.16)
HALF_CAR_M = 2.3
Open = Callable[..., Arena]


def scene_with(folder: Path, obstacle: str) -> OpenScene:
    build_scene(folder)
    file = folder / "scene.toml"
    file.write_text(f"{file.read_text(encoding='utf-8')}\n{obstacle}", encoding="utf-8")
    return open_scene(folder)


def test_contact__is_that_of_the_boxes(tmp_path: Path, arena_of: Open) -> None:
    """The van's back is at 150 - 3.25 = 146.75 m: a car of 4.6 m in its lane touches it with its centre at 144.45 m.
    A car in the other lane has 3.2 - 0.9 - 1.08 m of room and drives past."""
    scene = scene_with(tmp_path / "scene", VAN.format(150.0))
    arena = arena_of(scene, 1)
    arena.reset({0: placed(scene, (100.0, RIGHT_Y, 0.0, 13.0), (100.0, LEFT_Y, 0.0, 13.0))})
    centres = []
    while arena.state.outcome[0, 0] == Outcome.RUNNING:
        centres.append(arena.state.x_m[0, 0])
        arena.step(np.zeros((1, 2, 2)))
    assert arena.state.outcome[0, 0] == Outcome.COLLISION
    assert centres[-1] < 144.45 <= arena.state.x_m[0, 0]
    least_m = np.inf
    while arena.state.outcome[0, 1] == Outcome.RUNNING and arena.state.x_m[0, 1] < 170.0:
        step = arena.step(np.zeros((1, 2, 2)))
        least_m = min(least_m, float(step.quantities.vehicle_clearance_m[0, 1]))
    assert arena.state.outcome[0, 1] == Outcome.RUNNING
    assert least_m == pytest.approx(3.2 - 0.9 - 1.08, abs=1e-6)


def test_obstacle__is_observed_as_any_body(tmp_path: Path, arena_of: Open) -> None:
    scene = scene_with(tmp_path / "scene", VAN.format(150.0))
    arena = arena_of(scene, 1)
    arena.reset({0: placed(scene, (120.0, RIGHT_Y, 0.0, 10.0), None)})
    seen = dict(zip(LAYOUT, arena.observation[0, 0].tolist(), strict=True))
    gap_m = 30.0 - 3.25 - HALF_CAR_M
    assert seen["leader_gap_m"] == pytest.approx(gap_m / (gap_m + 20.0))
    assert seen["leader_mps"] == pytest.approx(-10.0 / 20.0)
    assert seen["other0_ahead_m"] == pytest.approx(30.0 / 50.0)
    assert (seen["other0_length_m"], seen["other0_width_m"]) == pytest.approx((6.5 / 20.0, 2.16 / 4.0))


def test_obstacle__hides_a_player(tmp_path: Path, arena_of: Open) -> None:
    """The van stands between the two in one lane; the person in the other lane is seen past it."""
    scene = scene_with(tmp_path / "scene", VAN.format(150.0))
    arena = arena_of(scene, 2)
    ego = (130.0, RIGHT_Y, 0.0, 10.0)
    behind, beside = placed(scene, ego, (170.0, RIGHT_Y, 0.0, 0.0)), placed(scene, ego, (170.0, LEFT_Y, 0.0, 0.0))
    arena.reset({0: behind, 1: beside})
    others = [arena.observation[:, 0, LAYOUT.index(f"other{k}_seen")].tolist() for k in range(2)]
    assert others == [[1.0, 1.0], [0.0, 1.0]]


def test_training_starts__along_the_route_are_clear_of_obstacles(tmp_path: Path) -> None:
    scene = scene_with(tmp_path / "scene", VAN.format("[100.0, 200.0]"))
    starts = scene.start_distribution([HumanFactors()] * 2, [1.0, 0.0], along_route_share=1.0)
    nearest_m, anywhere = np.inf, set()
    for seed in range(200):
        start = draw_initial_state(starts, "training", seed)
        (pose,) = scene.obstacles.poses("training", seed).tolist()
        car = Box(float(start.x_m[0]), float(start.y_m[0]), float(start.heading_rad[0]), 4.6, 1.8)
        nearest_m = min(nearest_m, box_distance(car, Box(*pose, *SIZE_M)))
        anywhere.add(round(float(start.x_m[0]), -1))
    assert nearest_m > 0.3
    assert len(anywhere) > 15


def test_vehicle_of_2_1_m__hides_in_a_scene_without_obstacles(tmp_path: Path) -> None:
    assert not build_scene(tmp_path / "cars").world.hiding.anything
    bus = '<vType id="bus" vClass="bus"/><vehicle id="b" type="bus" depart="0"><route edges="road"/></vehicle>'
    assert build_scene(tmp_path / "bus", others=bus).world.hiding.vehicles
    unused = '<vType id="bus" vClass="bus"/>'
    assert not build_scene(tmp_path / "unused", others=unused).world.hiding.anything
