"""Who follows the ego: drawn for a share of the games, apart from all other draws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from harness.game.follower import REACTIONS_S, TIME_GAPS_S, Follower, draw_follower
from harness.game.initial_state import InitialState, draw_initial_state
from harness.road.scene.open_scene import open_scene

GAMES = 1000


@pytest.fixture(scope="module")
def followed() -> list[InitialState]:
    starts = replace(open_scene("merge").usual_starts, followed_share=0.3)
    return [draw_initial_state(starts, "game", k) for k in range(GAMES)]


def test_draw_follower__follows_in_a_share_of_the_games(followed: list[InitialState]) -> None:
    count = sum(each.follower is not None for each in followed)
    assert count == pytest.approx(0.3 * GAMES, abs=4.0 * (0.3 * 0.7 * GAMES) ** 0.5)
    assert draw_follower(0.0, "a") is None
    assert all(draw_follower(1.0, "a", k) is not None for k in range(20))


def test_draw_follower__spans_the_published_ranges() -> None:
    drawn = [draw_follower(1.0, k) for k in range(GAMES)]
    time_gaps_s, reactions_s = np.array([(each.time_gap_s, each.reaction_s) for each in drawn if each]).T
    for values, (low, high) in ((time_gaps_s, TIME_GAPS_S), (reactions_s, REACTIONS_S)):
        assert (low <= values.min(), values.max() <= high) == (True, True)
        assert values.min() == pytest.approx(low, abs=0.01 * high)
        assert values.max() == pytest.approx(high, abs=0.01 * high)


def test_draw_follower__other_draws_do_not_change(followed: list[InitialState]) -> None:
    starts = open_scene("merge").usual_starts
    for k, start in enumerate(followed[:20]):
        alone = draw_initial_state(replace(starts, followed_share=0.0), "game", k)
        assert alone.follower is None
        for name in ("x_m", "speed_mps", "present", "noise"):
            np.testing.assert_array_equal(getattr(start, name), getattr(alone, name))
        assert start.seed == alone.seed


def test_draw_follower__the_same_episode_has_the_same_follower_in_every_arm(followed: list[InitialState]) -> None:
    """Whether a person takes part or not."""
    starts = replace(open_scene("merge").usual_starts, followed_share=0.3, present_share=[1.0, 0.0])
    assert [draw_initial_state(starts, "game", k).follower for k in range(50)] == [
        each.follower for each in followed[:50]
    ]


def test_draw_follower__nobody_follows_a_person_alone() -> None:
    starts = replace(open_scene("merge").usual_starts, followed_share=1.0, present_share=[0.0, 1.0])
    assert [draw_initial_state(starts, "game", k).follower for k in range(20)] == [None] * 20


def test_follower__its_gap_grows_with_the_speed() -> None:
    assert Follower(time_gap_s=1.5, reaction_s=1.25).gap_m(10.0) == 17.5
