"""Fixtures of the tests of environments."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import libsumo
import pytest

from harness.environments.arena import Arena, Seat
from harness.road.scene.open_scene import OpenScene
from tests.support.scenes import build_scene

Open = Callable[..., Any]


@pytest.fixture(scope="session")
def short(tmp_path_factory: pytest.TempPathFactory) -> OpenScene:
    """A straight road with a time limit of 3 s."""
    return build_scene(tmp_path_factory.mktemp("scenes") / "short", time_limit_s=3.0)


@pytest.fixture
def opened() -> Iterator[Open]:
    """Makes environments, and closes them."""
    environments = []

    def opened(make: Open, *arguments: Any, **named: Any) -> Any:
        environments.append(make(*arguments, **named))
        return environments[-1]

    yield opened
    for each in environments:
        each.close()
    assert not libsumo.isLoaded()


@pytest.fixture
def arena_of(opened: Open) -> Open:
    """Opens arenas of the given drivers, or of learners, and closes them."""

    def arena_of(scene: OpenScene, games: int = 1, *drivers: Any, payoff: Any = None, recorded: bool = False) -> Arena:
        seats = [Seat(each, payoff) for each in drivers or [None] * len(scene.world.roles)]
        arena: Arena = opened(Arena, scene, games, seats, seed=1, recorded=recorded)
        return arena

    return arena_of
