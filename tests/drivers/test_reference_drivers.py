"""Reference drivers: the shipped documents describe the same ones, and the upper bound brakes at the first danger."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from harness.config.driver import read_driver
from harness.config.rule_driver import REACTIONS, Rules
from harness.drivers.reference_drivers import (
    PERSONS,
    UPPER_BOUND,
    lane_width_of,
    reference_driver,
    reference_identity,
    reference_rules,
)
from harness.environments.arena import Arena, Seat
from harness.game.roles import EGO
from harness.road.scene.open_scene import OpenScene
from tests.support.rollouts import Steady
from tests.support.scenes import placed

LANE_Y = -1.6


@pytest.mark.parametrize("name", PERSONS)
def test_reference_rules__are_those_of_the_shipped_document(name: str, repository: Path) -> None:
    shipped = read_driver(repository / "egos" / f"{name}.toml")
    assert isinstance(shipped, Rules)
    made = reference_rules(name, lane_width_m=3.2)
    for table in ("cruise", "lane_keeping", *REACTIONS):
        assert getattr(made, table) == getattr(shipped, table)


def test_lane_width__is_the_distance_of_the_lanes_centres(merge: OpenScene) -> None:
    assert lane_width_of(merge.world) == pytest.approx(3.2, abs=0.15)


def test_identity__has_every_parameter() -> None:
    identity = reference_identity()
    assert list(identity) == list(PERSONS)
    assert identity["rss"]["rss"]["reaction_s"] == 0.75


def test_upper_bound__brakes_fully_in_the_first_step_of_danger(merge: OpenScene) -> None:
    """A standing car 12 m ahead at 12 m/s is a danger to every driver; one 200 m ahead to none."""
    drivers = {name: reference_driver(name, merge.world) for name in (*PERSONS, UPPER_BOUND)}
    for ahead_m, danger in ((16.6, True), (150.0, False)):
        arena = Arena(merge, 1, [Seat(Steady()), Seat(Steady())])
        try:
            arena.reset({0: placed(merge, (20.0, LANE_Y, 0.0, 12.0), (20.0 + ahead_m, LANE_Y, 0.0, 0.0))})
            seen = arena.observation[:, EGO].astype(float)
        finally:
            arena.close()
        for name, driver in drivers.items():
            assert driver.sees_danger(seen).tolist() == [danger], name
        bound = drivers[UPPER_BOUND]
        bound.reset(np.array([0]))
        (decided,) = bound.decide(np.array([0]), seen, np.zeros((1, 2)))
        assert (decided[0] == -1.0) == danger
