"""Games with a player on foot: an ordinary walker in place of SUMO, what it touches, and what counts for it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from harness.drivers.ordinary_walker import OrdinaryWalker
from harness.drivers.sumo import SumoDriver
from harness.environments.arena import Arena, Seat
from harness.game.human_factors import HumanFactors
from harness.game.initial_state import InitialState, draw_initial_state
from harness.game.outcome import Outcome
from harness.game.roles import NON_EGO
from harness.road.scene.open_scene import OpenScene, open_scene
from tests.support.repository import REPOSITORY

Open = Callable[..., Arena]


@pytest.fixture(scope="module")
def crossing() -> OpenScene:
    return open_scene(REPOSITORY / "networks" / "crossing")


def start_of(scene: OpenScene, k: int, present: tuple[float, float] = (1.0, 1.0)) -> InitialState:
    return draw_initial_state(scene.start_distribution([HumanFactors()] * 2, present), "on foot", k)


def played(scene: OpenScene, games: int, present: tuple[float, float]) -> Iterator[Arena]:
    """Games of SUMO's ego and an ordinary walker, after each step."""
    arena = Arena(scene, 1, [Seat(SumoDriver())] * 2)
    try:
        for k in range(games):
            arena.reload(k)
            arena.reset({0: start_of(scene, k, present)})
            for _ in range(scene.world.steps):
                arena.step()
                yield arena
                if not arena.state.running.any():
                    break
    finally:
        arena.close()


def test_ordinary_walker__takes_the_place_of_sumo(crossing: OpenScene) -> None:
    arena = Arena(crossing, 1, [Seat(SumoDriver())] * 2)
    arena.close()
    (ego,), (walker,) = arena.seats
    assert isinstance(ego.driver, SumoDriver)
    assert isinstance(walker.driver, OrdinaryWalker)


def test_ordinary_walker__reaches_its_goal_on_an_empty_road(crossing: OpenScene) -> None:
    steps, speeds = 0, []
    for arena in played(crossing, 1, (0.0, 1.0)):
        steps, speeds = steps + 1, [*speeds, float(arena.state.speed_mps[0, NON_EGO])]
    assert Outcome(arena.state.outcome[0, NON_EGO]) is Outcome.GOAL
    assert max(speeds) == pytest.approx(1.36, abs=0.05)
    assert min(speeds[10:-1]) > 1.2  # it stops for no one


def test_ordinary_walker__and_sumos_ego_meet_without_harm(crossing: OpenScene) -> None:
    outcomes: Counter[str] = Counter()
    for arena in played(crossing, 3, (1.0, 1.0)):
        if not arena.state.running.any():
            outcomes.update(Outcome(each).name for each in arena.state.outcome[0])
    assert outcomes == {"GOAL": 6}


def test_walker__is_hit_as_its_body_is(crossing: OpenScene, arena_of: Open) -> None:
    """The ego's left side is 0.9 m beside its line at y = -1.75, a walker reaches 0.25 m to the side."""
    start = start_of(crossing, 0)
    arena = arena_of(crossing, 1)
    for beside_m, outcome in ((1.14, Outcome.COLLISION), (1.2, Outcome.RUNNING)):
        start.x_m[:], start.y_m[:] = (100.0, 101.0), (-1.75, -1.75 + beside_m)
        start.heading_rad[:], start.speed_mps[:], start.station_m[:] = (0.0, np.pi / 2.0), 0.0, (100.0, 24.0)
        arena.reset({0: start})
        step = arena.step(np.zeros((1, 2, 2)))
        assert arena.state.outcome[0].tolist() == [outcome, outcome]
        assert step.quantities.on_carriageway[0].tolist() == [0.0, 1.0]
        assert step.quantities.stands[0].tolist() == [1.0, 1.0]
