"""Fixtures of the tests of drivers."""

from __future__ import annotations

import pytest

from harness.drivers.car import Car, car_of
from harness.game.cartesian_view import CartesianView
from harness.game.roles import EGO
from harness.road.scene.open_scene import OpenScene


@pytest.fixture(scope="session")
def car(merge: OpenScene) -> Car:
    """The ego's car on the merge."""
    return car_of(merge.world, EGO)


@pytest.fixture(scope="session")
def start(merge: OpenScene) -> CartesianView:
    """The view at the start of the ego's route on the merge."""
    return CartesianView.at_start(merge.cartesian_roads[EGO])
