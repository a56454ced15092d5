"""The place of the vehicle that follows the ego."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.errors import UsageError
from harness.game.follower import FOLLOWER, Follower
from harness.game.initial_state import InitialState
from harness.road.demand.route_file import CAR_SIZE_M
from harness.road.scene.following import FOLLOWER_TYPE
from harness.road.scene.open_scene import OpenScene, open_scene
from tests.support.repository import REPOSITORY
from tests.support.scenes import CROSSING, CROSSING_EDGES, CROSSING_NODES, LEFT_Y, RIGHT_Y, build_scene, placed

DRIVER = Follower(time_gap_s=1.2, reaction_s=1.3)
GAP_M = 2.5 + 1.2 * 10.0
CAR_M = 4.6


def start_at(scene: OpenScene, x_m: float, y_m: float = RIGHT_Y, speed_mps: float = 10.0) -> InitialState:
    return replace(placed(scene, (x_m, y_m, 0.0, speed_mps), None), follower=DRIVER)


@pytest.fixture(scope="module")
def straight(tmp_path_factory: pytest.TempPathFactory) -> OpenScene:
    return build_scene(tmp_path_factory.mktemp("straight"), followed_share=1.0)


@pytest.mark.parametrize(("y_m", "lane"), [(RIGHT_Y, "road_0"), (LEFT_Y + 0.5, "road_1")])
def test_follower__keeps_its_gap_behind_the_ego_in_its_lane(straight: OpenScene, y_m: float, lane: str) -> None:
    found = straight.road_behind.follower(start_at(straight, 100.0, y_m), CAR_M)
    assert found is not None
    assert (found.name, found.vehicle_type, found.lane, found.edges) == (FOLLOWER, FOLLOWER_TYPE, lane, ("road",))
    assert float(found.position) == pytest.approx(100.0 - 0.5 * CAR_M - GAP_M)
    assert found.motion is not None
    assert (found.motion.x_m, found.motion.speed_mps) == pytest.approx((float(found.position), 10.0))
    assert found.motion.heading_rad == pytest.approx(0.0)


def test_follower__nobody_follows_where_the_road_behind_is_too_short(straight: OpenScene) -> None:
    least_m = 0.5 * CAR_M + GAP_M + CAR_SIZE_M[0]
    assert straight.road_behind.follower(start_at(straight, least_m + 0.1), CAR_M) is not None
    assert straight.road_behind.follower(start_at(straight, least_m - 0.1), CAR_M) is None


def test_follower__nobody_follows_an_ego_beside_the_road_or_without_a_driver(straight: OpenScene) -> None:
    assert straight.road_behind.follower(start_at(straight, 100.0, -9.0), CAR_M) is None
    assert straight.road_behind.follower(replace(start_at(straight, 100.0), follower=None), CAR_M) is None


def test_follower__may_be_on_the_edge_before_the_ego_s_or_inside_the_junction(tmp_path: Path) -> None:
    scene = build_scene(tmp_path, CROSSING_NODES, CROSSING_EDGES, CROSSING, goal_m=60.0, followed_share=1.0)
    lanes = {}
    for x_m in np.arange(40.0, 160.0, 2.0).tolist():
        found = scene.road_behind.follower(start_at(scene, x_m, 98.4), CAR_M)
        assert found is not None
        assert found.motion is not None
        assert found.motion.x_m == pytest.approx(x_m - 0.5 * CAR_M - GAP_M, abs=0.2)
        lanes[found.lane] = True
    assert list(lanes) == ["wc_0", next(each for each in lanes if each.startswith(":")), "ce_0"]


def test_open_scene__a_vehicle_with_the_follower_s_name_is_refused(tmp_path: Path) -> None:
    others = f'<vehicle id="{FOLLOWER}" type="van" depart="0"><route edges="road"/></vehicle>'
    with pytest.raises(UsageError, match="follower: is the name of the vehicle that follows the ego"):
        build_scene(tmp_path / "a", others=others, followed_share=0.5)
    assert not build_scene(tmp_path / "b", others=others).road_behind.lanes


def test_shipped_scenes__somebody_follows_in_half_of_their_games() -> None:
    """Not where a person walks, follows, or waits inside the junction, nor in the paper with two cars; always where a
    scene is about it."""
    scenes = {each.name: open_scene(each) for each in sorted((REPOSITORY / "networks").iterdir()) if each.is_dir()}
    others = {name: share for name, scene in scenes.items() if (share := scene.document.share_followed) != 0.5}
    without = ("crossing", "merge_convoy", "oncoming_bypass", "paper_merge", "zebra")
    assert others == {"brake": 1.0} | dict.fromkeys(without, 0.0)
