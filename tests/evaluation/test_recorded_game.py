"""What a recorded game holds, from traces made by hand on networks/merge."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from harness.evaluation.recorded_game import BodyKind
from harness.game.outcome import Outcome
from harness.game.sight import Hiding
from harness.game.state import NEAREST, NOTICED_M
from harness.road.scene.open_scene import OpenScene
from tests.support.traces import along, drawn, game, rows

KINDS = {"ego_car": BodyKind(length_m=4.6), "truck": BodyKind(length_m=12.0, width_m=2.5, vehicle_class="truck")}


def test_quantities__gap_and_time_to_a_slower_leader(merge: OpenScene) -> None:
    trace = drawn(ego=([20.0, 21.5], 15.0, -1.6, {}), non_ego=([40.0, 41.0], 10.0, -1.6, {}))
    found = game(merge.world, trace, KINDS).quantities
    assert found.leader_gap_m[:, 0] == pytest.approx([15.4, 14.9])
    assert found.time_to_collision_s[:, 0] == pytest.approx([15.4 / 5, 14.9 / 5])
    assert np.isinf(found.leader_gap_m[:, 1]).all()
    assert found.advanced_m[:, 0] == pytest.approx([0.0, 1.5])


def test_quantities__a_road_user_that_sumo_drives_is_a_leader_too(merge: OpenScene) -> None:
    trace = drawn(ego=([20.0], 15.0, -1.6, {}), other=([30.0], 15.0, -1.6, {}))
    found = game(merge.world, trace, KINDS)
    assert found.quantities.leader_gap_m[0, 0] == pytest.approx(5.4)
    assert not found.drove[0, 1]


def test_quantities__are_of_the_bodies_that_the_game_considered(merge: OpenScene) -> None:
    many = {f"car{k}": ([20.0 + 2.0 * k], 0.0, -4.8, {}) for k in range(NEAREST + 1)}
    found = game(merge.world, drawn(ego=([18.0], 0.0, -1.6, {}), **many), KINDS)
    there = dict(zip(found.names, found.quantities.bodies.present[0], strict=True))
    assert [name for name in many if not there[name]] == [f"car{NEAREST}"]  # the farthest one
    far = drawn(ego=([18.0], 0.0, -1.6, {}), other=([19.0 + NOTICED_M], 0.0, -1.6, {}))
    found = game(merge.world, far, KINDS)
    assert (found.bodies.present[0, 2], found.quantities.bodies.present[0, 2]) == (True, False)


def test_drove__what_is_after_the_end_is_not_driven(merge: OpenScene) -> None:
    ego, other = {1: "rail", 2: "rail"}, {1: "goal"}
    trace = drawn(ego=([20.0, 21.0, 22.0], 10.0, -1.6, ego), non_ego=([40.0, 41.0], 10.0, -4.8, other))
    found = game(merge.world, trace)
    assert found.drove.tolist() == [[True, True], [True, True], [False, False]]
    assert found.outcomes == (Outcome.RAIL, Outcome.GOAL)
    assert (found.last_step(0), found.last_step(1)) == (1, 1)


def test_bodies__names_kinds_and_the_nearest_by_the_distance_of_boxes(merge: OpenScene) -> None:
    world = replace(merge.world, hiding=Hiding(obstacles=np.array([False])))
    ego, truck = along(20.0, -1.6, 0.0, 10.0, 2), along(33.0, -1.6, 0.0, 0.0, 2)
    parts = rows("ego", ego), rows("lorry", truck, "truck"), rows("obstacle_1", along(31.0, -4.8, 0.0, 0.0, 2))
    found = game(world, pd.DataFrame([row for part in parts for row in part]), KINDS)
    assert found.names == ("ego", "non_ego", "lorry", "obstacle_1")
    assert [kind.vehicle_class for kind in found.body_kinds] == ["passenger", "passenger", "truck", "passenger"]
    # the ego's front is at 22.5 m, the truck's rear at 27 m (centre 33), the obstacle's at 28.5 m (centre 31)
    assert found.nearest(0, 0) == 2
    assert found.nearest(0, 2) == 3
