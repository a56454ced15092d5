"""Fixtures of the tests of the game."""

from __future__ import annotations

import pytest

from harness.game.world import World
from harness.road.scene.open_scene import OpenScene


@pytest.fixture(scope="session")
def world(merge: OpenScene) -> World:
    """The constants of games on the merge road."""
    return merge.world
