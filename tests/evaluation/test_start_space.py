"""Starts as points of a plane: their quantities, how their games end, and the two quantities that tell it."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from harness.evaluation.start_space import best_pair, endings, explained_share, start_quantities
from harness.game.start_range import ArrivesAfterEgo, BesideEgo, OnLine, StartRange

LINE = np.array([[0.0, 0.0], [100.0, 0.0]])


def starting(place):
    return StartRange(line=LINE, place=place, speed_mps=(8.0, 12.0))


def test_start_quantities__a_person_is_placed_as_the_scene_draws_it():
    places = [
        starting(OnLine((20.0, 40.0))),
        starting(BesideEgo((-5.0, 5.0))),
        starting(ArrivesAfterEgo(after_s=(-1.0, 1.0), meeting_m=80.0, ego_meeting_m=60.0)),
        starting(OnLine((0.0, 9.0))),
    ]
    position_m, speed_mps = np.array([[30.0, 27.0, 50.0, 4.0]]), np.array([[10.0, 11.0, 6.0, 1.5]])
    found = start_quantities(places, position_m, speed_mps)
    assert found.iloc[0].to_dict() == pytest.approx(
        {
            "non_ego_ahead_m": -3.0,
            "non_ego_faster_mps": 1.0,
            "non_ego_speed_mps": 11.0,
            "non_ego_2_after_s": 2.0,  # 30 m at 6 m/s take 5 s; the ego's 30 m at 10 m/s take 3 s
            "non_ego_2_faster_mps": -4.0,
            "non_ego_2_speed_mps": 6.0,
            "non_ego_3_position_m": 4.0,
            "non_ego_3_faster_mps": -8.5,
            "non_ego_3_speed_mps": 1.5,
            "ego_position_m": 30.0,
            "ego_speed_mps": 10.0,
        }
    )


def test_endings__a_failure_is_no_near_miss():
    games = pd.DataFrame({"ego_failed": [1, 1, 0, 0, None], "near_miss": [0, 1, 1, 0, None]})
    assert endings(games.astype("Int64")).tolist() == ["failure", "failure", "near_miss", "fine", "fine"]


def test_explained_share__of_two_far_groups_is_all_and_a_point_does_not_predict_itself():
    groups = np.repeat([0.0, 100.0], 20)
    points = np.stack([groups, np.zeros(40) + np.arange(40) % 3], axis=1)
    assert explained_share(points, (groups > 0.0).astype(float)) == pytest.approx(1.0)
    equal = np.repeat([[0.0, 0.0], [1.0, 1.0]], 20, axis=0)  # of 20 equal points one fails: its neighbours do not
    alone = np.zeros(40)
    alone[0] = 1.0
    assert explained_share(equal, alone) < 0.0


@pytest.mark.parametrize(("games", "scores"), [(40, 0.0), (10, None)])
def test_explained_share__is_not_known_without_variance_or_with_few_starts(games, scores):
    points = np.random.default_rng(1).normal(size=(games, 2))
    values = np.arange(games) % 2.0 if scores is None else np.full(games, scores)
    assert np.isnan(explained_share(points, values))


def test_best_pair__is_the_one_that_decides():
    starts = pd.DataFrame(np.random.default_rng(5).uniform(size=(200, 4)), columns=["a", "b", "c", "d"])
    fails = (np.hypot(starts["b"] - 0.5, starts["d"] - 0.5) < 0.3).to_numpy(float)
    assert best_pair(starts, fails) == ("b", "d")
    assert best_pair(starts, np.zeros(200)) == ("a", "b")
