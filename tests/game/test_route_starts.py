"""Starts anywhere along the players' routes: on a lane, apart from one another, in a share of the games."""

from __future__ import annotations

import numpy as np
import pytest

from harness.game.arrays import FloatArray
from harness.game.human_factors import HumanFactors
from harness.game.initial_state import InitialState, draw_initial_state
from harness.game.lapses import Attention
from harness.game.placed_obstacles import NO_OBSTACLES
from harness.game.road import Routes
from harness.game.start_range import draw_along_route
from harness.road.scene.open_scene import OpenScene
from tests.support.roads import arc, straight

LENGTH_M = np.array([4.6, 4.6])
MAX_SPEED_MPS = np.array([40.0, 8.0])  # a car and a bicycle
BEND = Routes.of([arc(25.0, length=60.0), straight(0.0, length=80.0, y0=40.0)])


def draws(routes: Routes, count: int, share: float = 1.0) -> list[tuple[FloatArray, ...] | None]:
    """The draws of `count` games."""
    generators = (np.random.default_rng(seed) for seed in range(count))
    return [
        draw_along_route(
            routes,
            each,
            length_m=LENGTH_M,
            max_speed_mps=MAX_SPEED_MPS,
            present=np.array([True, True]),
            share=share,
            obstacles=NO_OBSTACLES.boxes(),
        )
        for each in generators
    ]


def placed(routes: Routes, count: int) -> FloatArray:
    """[count, 5, P] x_m, y_m, heading_rad, speed_mps and station_m of games in which there was a place."""
    return np.array([each for each in draws(routes, count) if each is not None])


def test_starts__are_on_the_route_between_its_begin_and_10_m_before_the_goal() -> None:
    x, y, heading, speed, station = placed(BEND, 300).transpose(1, 0, 2)
    assert len(x) == 300
    located, offset = BEND.locate(x, y, station)
    assert located == pytest.approx(station, abs=0.5)
    assert np.abs(offset).max() < 1.0  # five standard deviations of 0.2 m
    assert np.abs(offset).std() > 0.05
    goals = BEND.goal_m  # 55 and 75 m
    for player in range(2):
        assert station[:, player].min() >= 2.3, "the whole car is on the route"
        assert station[:, player].max() <= goals[player] - 10.0
        assert np.ptp(station[:, player]) > 0.95 * (goals[player] - 10.0 - 2.3)
    turned = heading - BEND.heading_rad[BEND.rows(station)]
    assert np.abs(turned).max() < 0.15  # five of 0.03 rad
    assert speed.min() >= 0.0
    assert speed[:, 0].max() <= 13.0  # the limit
    assert speed[:, 1].max() <= 8.0  # the bicycle's own
    assert np.ptp(speed[:, 0]) > 12.0
    assert np.ptp(speed[:, 1]) > 7.0


def test_starts__are_on_all_lanes() -> None:
    lanes = np.array([0.0, -3.2, np.nan])
    wide = straight(0.0, lanes=3)
    wide.lane_offset_m[:] = lanes
    _, y, *_ = placed(Routes.of([wide, straight(0.0, y0=40.0)]), 300).transpose(1, 0, 2)
    on_lane = np.abs(y[:, 0, None] - lanes[:2]) < 1.0
    assert on_lane.any(axis=1).all()
    assert on_lane.mean(axis=0) == pytest.approx([0.5, 0.5], abs=4 * 0.029)  # sqrt(0.25 / 300)


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_starts__along_the_route_are_a_share_of_the_games(share: float) -> None:
    found = [each is not None for each in draws(BEND, 500, share=share)]
    assert np.mean(found) == pytest.approx(share, abs=4 * np.sqrt(share * (1.0 - share) / 500))


# --- in the initial states of a scene --------------------------------------------------------------------------------

TEXTING = HumanFactors(
    attention=Attention(mean_attentive_s=2.0, lapse_s=(1.0, 2.0)),
    delay_s=(0.2, 0.9),
)


def states(merge: OpenScene, share: float, games: int = 60) -> list[InitialState]:
    start_distribution = merge.start_distribution((HumanFactors(), TEXTING), (1.0, 0.3), along_route_share=share)
    return [draw_initial_state(start_distribution, "test", 1, "episode", k) for k in range(games)]


def test_initial_state__along_the_route_changes_no_other_draw(merge: OpenScene) -> None:
    plain, along = states(merge, 0.0), states(merge, 0.5)
    moved = [np.isnan(each.position_m).all() for each in along]
    assert 10 < sum(moved) < 35
    for one, other, is_moved in zip(plain, along, moved, strict=True):
        names = ["present", "shoulder_glance", "member", "noise", "seed", "signal_place"]
        if not is_moved:
            names += ["x_m", "y_m", "heading_rad", "speed_mps", "position_m", "station_m"]
        for name in names:
            assert np.array_equal(getattr(one, name), getattr(other, name)), name
        assert (one.lapses[1].lapsed == other.lapses[1].lapsed).all()
        assert one.limits[1].delay_steps == other.limits[1].delay_steps
        assert (one.x_m != other.x_m).all() == is_moved


def test_initial_state__players_that_meet_start_in_their_places(merge: OpenScene) -> None:
    starts = merge.start_distribution((HumanFactors(), HumanFactors()), (1.0, 0.5), along_route_share=1.0)
    drawn = [draw_initial_state(starts, "test", k) for k in range(60)]
    assert 15 < sum(each.present[1] for each in drawn) < 45
    assert all(np.isnan(each.position_m).all() != each.present[1] for each in drawn)


def test_initial_state__a_start_in_the_range_of_the_scene_knows_its_station(merge: OpenScene) -> None:
    routes = merge.world.road.routes
    for each in states(merge, 0.0, 20):
        station, _ = routes.locate(each.x_m[None], each.y_m[None], each.station_m[None])
        assert station[0] == pytest.approx(each.station_m, abs=1e-6)
        assert each.station_m == pytest.approx(each.position_m - 2.3)
