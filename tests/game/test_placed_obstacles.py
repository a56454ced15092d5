"""Obstacles: where they stand in each game, as drawn from its seed."""

from __future__ import annotations

import numpy as np
import pytest

from harness.game.placed_obstacles import AtPoint, Obstacles, OnLane, PlacedObstacle

L_SHAPED = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]])
STILL = (0.0, 0.0)


def obstacle(place: OnLane | AtPoint) -> PlacedObstacle:
    return PlacedObstacle(name="obstacle_1", kind="van", length_m=6.5, width_m=2.16, hides=True, place=place)


def on_lane(position_m: float, offset_m: float = 0.0, turned_rad: float = 0.0, scale: float = 1.0) -> OnLane:
    still = [(each, each) for each in (position_m, offset_m, turned_rad)]
    return OnLane(line=L_SHAPED, position_m=still[0], offset_m=still[1], turned_rad=still[2], scale=scale)


@pytest.mark.parametrize(
    ("place", "pose"),
    [
        (on_lane(4.0), (4.0, 0.0, 0.0)),
        (on_lane(4.0, offset_m=1.5), (4.0, 1.5, 0.0)),  # to the left
        (on_lane(14.0), (10.0, 4.0, np.pi / 2)),  # after the bend
        (on_lane(14.0, offset_m=1.0, turned_rad=0.2), (9.0, 4.0, np.pi / 2 + 0.2)),
        (on_lane(2.0, scale=2.0), (4.0, 0.0, 0.0)),  # SUMO's lane is half as long as its shape
        (AtPoint(x_m=(3.0, 3.0), y_m=(-2.0, -2.0), heading_rad=(1.0, 1.0)), (3.0, -2.0, 1.0)),
    ],
)
def test_place__without_ranges_is_the_same_in_every_game(place: OnLane | AtPoint, pose: tuple[float, ...]) -> None:
    obstacles = Obstacles(each=(obstacle(place),))
    for seed in (1, 2):
        assert obstacles.poses("game", seed)[0] == pytest.approx(pose)


def test_place__is_drawn_uniformly_from_the_games_seed() -> None:
    drawn = OnLane(line=L_SHAPED, position_m=(2.0, 8.0), offset_m=(-1.0, 1.0), turned_rad=STILL)
    obstacles = Obstacles(each=(obstacle(drawn), obstacle(drawn)))
    poses = np.array([obstacles.poses("game", seed) for seed in range(400)])
    assert (obstacles.poses("game", 7) == poses[7]).all()
    assert (poses[:, 0] != poses[:, 1]).any(-1).all()  # each obstacle has draws of its own
    x, y, heading = poses[:, 0].T
    assert (x >= 2.0).all()
    assert (x <= 8.0).all()
    assert np.mean(x) == pytest.approx(5.0, abs=3 * 6.0 / np.sqrt(12 * 400))
    assert np.mean(y) == pytest.approx(0.0, abs=3 * 2.0 / np.sqrt(12 * 400))
    assert (heading == 0.0).all()


def test_walls__close_the_outline_of_a_building() -> None:
    corners = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]])
    walls = Obstacles(outlines=(corners,)).walls
    assert walls.tolist() == [[[0, 0], [4, 0]], [[4, 0], [4, 3]], [[4, 3], [0, 0]]]
