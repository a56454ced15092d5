"""The shield around a driver: by hand, from the formula of responsibility-sensitive safety."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from harness.drivers.shield import ShieldedDriver
from harness.environments.arena import Arena, Seat
from harness.game.arrays import FloatArray, IntArray
from harness.game.bicycle import GRAVITY_MPS2, requests
from harness.game.roles import EGO
from harness.road.scene.open_scene import OpenScene, open_scene
from tests.support.rollouts import Steady
from tests.support.scenes import placed

LANE_Y = -1.6
SAFE_M = 9.84375 + 16.921875
"""From 12 m/s to a standing car: 0.75 s at 3 m/s2, (12 + 14.25) / 2 * 0.75, then braking at 6 m/s2, 14.25^2 / 12."""
ONE, NOISE = np.array([0]), np.zeros((1, 2))


class Pressing:
    """Holds its pedals and its wheel, and counts its resets."""

    takes_over = True

    def __init__(self, pedals: float, wheel: float = 0.25) -> None:
        self.actions, self.resets = np.array([[pedals, wheel]], dtype=np.float32), 0

    def reset(self, games: IntArray) -> None:
        self.resets += 1

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        return np.repeat(self.actions, len(games), axis=0)


def seen_at(gap_m: float, scene: OpenScene) -> FloatArray:
    """[1, SIZE] what the ego sees at 12 m/s, this far behind a standing car in its lane."""
    ahead_m = gap_m + 0.5 * float(scene.world.length_m.sum())
    arena = Arena(scene, 1, [Seat(Steady()), Seat(Steady())])
    try:
        arena.reset({0: placed(scene, (20.0, LANE_Y, 0.0, 12.0), (20.0 + ahead_m, LANE_Y, 0.0, 0.0))})
        return arena.observation[:, EGO].astype(float)
    finally:
        arena.close()


def test_shield__keeps_a_decision_byte_for_byte_at_a_safe_distance(merge: OpenScene) -> None:
    driver = Pressing(0.5)
    shield = ShieldedDriver(driver, merge.world)
    shield.reset(ONE)
    decided = shield.decide(ONE, seen_at(SAFE_M + 0.5, merge), NOISE)
    assert decided.tobytes() == driver.actions.tobytes()
    assert not shield.intervenes.any()
    assert driver.resets == 1


def test_shield__brakes_below_the_safe_distance_and_leaves_the_wheel_alone(merge: OpenScene) -> None:
    shield, seen = ShieldedDriver(Pressing(0.5), merge.world), seen_at(SAFE_M - 0.5, merge)
    shield.reset(ONE)
    decided = shield.decide(ONE, seen, NOISE)
    speed, road = np.array([[12.0, 0.0]]), np.zeros((1, 2))
    of_both = np.stack([decided, decided], axis=1)  # [G, P, 2]
    acceleration, _ = requests(of_both, speed, road, merge.world.actuators)
    assert acceleration[0, EGO] == pytest.approx(-0.774 * GRAVITY_MPS2, abs=1e-6)
    assert decided[0, 1] == 0.25
    assert shield.intervenes.tolist() == [True]
    shield.reset(ONE)
    assert shield.intervenes.tolist() == [False]


def test_shield__keeps_a_decision_that_brakes_as_hard(merge: OpenScene) -> None:
    driver = Pressing(-1.0)
    shield = ShieldedDriver(driver, merge.world)
    shield.reset(ONE)
    assert shield.decide(ONE, seen_at(10.0, merge), NOISE).tobytes() == driver.actions.tobytes()
    assert not shield.intervenes.any()


@pytest.mark.parametrize(("speed_mps", "brakes"), [(0.0, False), (0.2, True)])
def test_shield__passes_a_car_that_waits_to_turn_across(repository: Path, speed_mps: float, brakes: bool) -> None:
    """The ego is 5.3 m from it at 5 m/s, and 0.82 m beside it: neither (5 + 7.25) / 2 * 0.75 + 7.25^2 / 12 = 8.97 m nor
    0.8625 m is kept."""
    scene = open_scene(repository / "networks" / "left_across")
    arena = Arena(scene, 1, [Seat(Steady()), Seat(Steady())])
    try:
        turned = math.radians(-172.6)
        arena.reset({0: placed(scene, (195.6, 98.4, 0.0, 5.0), (205.6, 101.3, turned, speed_mps))})
        seen = arena.observation[:, EGO].astype(float)
    finally:
        arena.close()
    shield = ShieldedDriver(Pressing(0.5), scene.world)
    shield.reset(ONE)
    shield.decide(ONE, seen, NOISE)
    assert shield.intervenes.tolist() == [brakes]


def test_shield__changes_only_the_games_in_danger(merge: OpenScene) -> None:
    shield, games = ShieldedDriver(Pressing(0.5), merge.world), np.array([1, 3])
    shield.reset(games)
    seen = np.concatenate([seen_at(SAFE_M - 0.5, merge), seen_at(SAFE_M + 0.5, merge)])
    decided = shield.decide(games, seen, np.zeros((2, 2)))
    assert decided[0, 0] < 0.0
    assert decided[1].tolist() == [0.5, 0.25]
    assert shield.intervenes.tolist() == [False, True, False, False]
