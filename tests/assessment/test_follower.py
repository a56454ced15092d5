"""Assessment of an ego that is followed: the same follower in every arm, and contact from behind in the records."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from harness.drivers.sumo import SumoDriver
from harness.game.arrays import FloatArray, IntArray
from harness.game.follower import FOLLOWER
from harness.road.scene.open_scene import OpenScene, open_scene
from tests.support.rollouts import Steady, arm, assess, play, trace

EPISODES = 6
EPISODE_OF_A_CONTACT = 33
POSE = ["x_m", "y_m", "heading_rad", "speed_mps"]


class StopsHard(Steady):
    """Keeps its speed for a time, then brakes with all its might."""

    def __init__(self, after_steps: int) -> None:
        super().__init__()
        self._after, self._step = after_steps, 0

    def reset(self, games: IntArray) -> None:
        self._step = 0

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        self._step += 1
        return np.tile((-1.0 if self._step > self._after else 0.0, 0.0), (len(games), 1))


@pytest.fixture(scope="module")
def merge() -> OpenScene:
    return open_scene("merge")


def always(scene: OpenScene) -> OpenScene:
    return replace(scene, document=scene.document.model_copy(update={"followed_share": 1.0}))


def followers(scene: OpenScene, *drivers: Any) -> dict[int, list[float]]:
    """The follower's motion at the start of each episode that has one."""
    first = [
        trace(game).query(f"step == 0 and player == {FOLLOWER!r}") for game in play(arm(scene, *drivers), EPISODES)
    ]
    return {episode: rows[POSE].iloc[0].tolist() for episode, rows in enumerate(first) if len(rows)}


def test_assess__an_episode_has_the_same_follower_in_every_arm(merge: OpenScene) -> None:
    found = [followers(merge, *pair) for pair in ((Steady(), None), (Steady(0.3), SumoDriver()))]
    assert found[0] == found[1]
    assert 0 < len(found[0]) < EPISODES
    assert followers(merge, None, Steady()) == {}


def test_assess__contact_from_behind_is_a_collision_of_the_ego(merge: OpenScene) -> None:
    (game,) = assess(arm(always(merge), StopsHard(27), None), [EPISODE_OF_A_CONTACT])
    record = game.record
    assert (record["ego_outcome"], record["impact_side"]) == ("collision", "rear")
    assert record["closing_speed_mps"] > 0.0
    assert record["bystander_failed"] == 0  # a contact with the ego is the ego's
    assert 0.0 < record["follower_max_deceleration_mps2"] <= 6.1
