"""The trial of routes: a rule-based driver drives shipped scenes, and says where and why it can't drive others."""

from __future__ import annotations

from dataclasses import replace

import pytest

from harness.assessment.route_trial import try_routes
from harness.road.scene.open_scene import open_scene


@pytest.mark.parametrize("name", ["merge", "zebra", "roundabout"])
def test_trial__every_start_of_a_shipped_scene_reaches_the_goal(name: str) -> None:
    trials = try_routes(open_scene(name), starts=10)
    assert [(each.role, each.arrived, each.failure) for each in trials] == [("ego", 10, ""), ("non_ego", 10, "")]


# 150 m in 30 steps of 0.1 s are not driven at 50 km/h
def test_trial__names_the_place_the_time_and_the_reason() -> None:
    scene = open_scene("merge")
    ego, _ = try_routes(replace(scene, world=replace(scene.world, time_limit_s=3.0)), starts=4)
    assert ego.arrived == 0
    assert "reaches the goal from 0 of 4 starts" in ego.sentence()
    assert ego.failure.startswith("from one of the others it does not reach its goal in time at (")
    assert ego.failure.endswith("after 3.0 s")
