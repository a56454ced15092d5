"""Fixtures of the tests of drivers."""

from __future__ import annotations

import pytest

from harness.drivers.car import Car, car_of
from harness.game.roles import EGO
from harness.road.scene.open_scene import OpenScene


@pytest.fixture(scope="session")
def car(merge: OpenScene) -> Car:
    """The ego's car on the merge."""
    return car_of(merge.world, EGO)
