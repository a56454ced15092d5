"""A car that SUMO drives follows the ego: it reacts as a driver, and a contact with it is a collision of the ego."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.environments.arena import Arena, Seat
from harness.game.follower import FOLLOWER, Follower
from harness.game.initial_state import InitialState
from harness.game.outcome import Outcome
from harness.road.scene.following import FOLLOWER_TYPE
from harness.road.scene.open_scene import OpenScene
from tests.support.scenes import LEFT_Y, RIGHT_Y, build_scene, placed

SPEED_MPS, BRAKES_AT = 13.0, 27  # step
CLOSE, FAR = (Follower(time_gap_s=time_gap_s, reaction_s=1.4) for time_gap_s in (1.0, 2.0))


@pytest.fixture(scope="module")
def straight(tmp_path_factory: pytest.TempPathFactory) -> OpenScene:
    return build_scene(tmp_path_factory.mktemp("straight"), followed_share=1.0)


def start(scene: OpenScene, follower: Follower | None, x_m: float = 100.0) -> InitialState:
    return replace(placed(scene, (x_m, RIGHT_Y, 0.0, SPEED_MPS), None), follower=follower)


@contextmanager
def arena_of(scene: OpenScene, *followers: Follower | None, seed: int = 1) -> Iterator[Arena]:
    arena = Arena(scene, len(followers), [Seat(None)] * 2, seed=seed, recorded=True)
    try:
        arena.reset({game: start(scene, each) for game, each in enumerate(followers)})
        yield arena
    finally:
        arena.close()


def pedal(arena: Arena, level: float) -> None:
    actions = np.zeros((arena.games, 2, 2))
    actions[:, 0, 0] = level
    arena.step(actions)


def gaps_m(arena: Arena) -> list[float]:
    assert arena.reading is not None
    fronts_m = arena.reading.x_m[:, 0] + 0.5 * arena.reading.length_m[:, 0]
    gaps: list[float] = (arena.state.x_m[:, 0] - 0.5 * arena.world.length_m[0] - fronts_m).tolist()
    return gaps


def test_follower__is_a_background_vehicle_from_the_start(straight: OpenScene) -> None:
    """In the reading, at its gap and at the speed of the ego; its type is one of the scene."""
    with arena_of(straight, CLOSE, None, FAR) as arena:
        reading = arena.reading
        assert reading is not None
        assert reading.present[:, 0].tolist() == [True, False, True]
        assert reading.names[0, 0] == FOLLOWER
        assert reading.types[0, 0] == FOLLOWER_TYPE
        assert reading.speed_mps[[0, 2], 0] == pytest.approx(SPEED_MPS)
        expected = [2.5 + SPEED_MPS * each.time_gap_s for each in (CLOSE, FAR)]
        assert np.array(gaps_m(arena))[[0, 2]] == pytest.approx(expected)
        pedal(arena, 0.0)
        assert np.array(gaps_m(arena))[[0, 2]] == pytest.approx(expected, abs=0.2)
    kind = straight.routes.types[FOLLOWER_TYPE]
    assert (kind.length_m, kind.width_m) == (reading.length_m[0, 0], reading.width_m[0, 0])


def test_follower__a_hard_stop_is_hit_from_behind_by_one_who_follows_closely(straight: OpenScene) -> None:
    """With a grip of 7.85 m/s2 the ego stops within 10.8 m, the follower with 6 m/s2 within 14.1 m. Its gap of 15.5 or
    28.5 m and the ego's way leave 0.94 or 1.94 s for its reaction, which takes up to 1.4 s."""
    played = [stopped(straight, seed) for seed in (1, 2)]
    assert played[0] == played[1], "SUMO draws no random numbers for it"
    for outcomes, hardest_mps2 in played:
        assert outcomes == [Outcome.COLLISION, Outcome.RUNNING]
        assert hardest_mps2 == pytest.approx(6.0, abs=0.1)


def stopped(scene: OpenScene, seed: int) -> tuple[list[int], float]:
    """The ego's outcomes after it stopped hard before a close and a distant follower, and the hardest braking."""
    with arena_of(scene, CLOSE, FAR, seed=seed) as arena:
        hardest_mps2 = 0.0
        for step in range(90):
            assert arena.reading is not None
            before_mps = arena.reading.speed_mps.copy()
            pedal(arena, -1.0 if step >= BRAKES_AT else 0.0)
            braking_mps2 = (before_mps - arena.reading.speed_mps)[arena.state.running[:, 0], 0] / arena.world.step_s
            hardest_mps2 = max(hardest_mps2, float(braking_mps2.max()))
        return arena.state.outcome[:, 0].tolist(), hardest_mps2


def test_follower__who_brakes_gently_is_not_hit(straight: OpenScene) -> None:
    """By any follower, at half of the brake: 4 m/s2."""
    drivers = [Follower(time_gap_s=t, reaction_s=r) for t in (1.0, 1.5, 2.0) for r in (1.25, 1.4, 1.5)]
    with arena_of(straight, *drivers) as arena:
        for step in range(100):
            pedal(arena, -0.5 if step >= BRAKES_AT else 0.0)
            assert min(gaps_m(arena)) > 0.5
        assert (arena.state.outcome[:, 0] == Outcome.RUNNING).all()


def test_follower__does_not_pass(tmp_path: Path) -> None:
    """A slow ego has a free lane beside it; the follower keeps its lane and its place."""
    scene = build_scene(tmp_path, followed_share=1.0, time_limit_s=30.0)
    with arena_of(scene, CLOSE, FAR) as arena:
        for step in range(200):
            pedal(arena, -0.3 if 10 <= step < 40 else 0.0)
            assert arena.reading is not None
            assert (arena.state.outcome[:, 0] == Outcome.RUNNING).all()
            assert arena.reading.y_m[:, 0] == pytest.approx(RIGHT_Y, abs=0.01)
            assert min(gaps_m(arena)) > 0.0


def test_follower__a_person_in_its_place_follows_instead(straight: OpenScene) -> None:
    """Whether the person takes part or not: arms have the same follower."""
    for x_m, y_m, followed in ((75.0, RIGHT_Y, False), (100.0, LEFT_Y, True), (60.0, RIGHT_Y, False)):
        both = placed(straight, (100.0, RIGHT_Y, 0.0, SPEED_MPS), (x_m, y_m, 0.0, SPEED_MPS))
        arena = Arena(straight, 2, [Seat(None)] * 2, recorded=True)
        alone = replace(both, present=np.array([True, False]))
        arena.reset({game: replace(each, follower=CLOSE) for game, each in enumerate((both, alone))})
        present = arena.reading is not None and bool(arena.reading.present.any())
        assert present == followed
        if arena.reading is not None:
            assert arena.reading.present[0].tolist() == arena.reading.present[1].tolist()
        arena.close()


def test_follower__games_with_and_without_alternate_in_one_tile(straight: OpenScene) -> None:
    """The pose of the ego is SUMO's whatever the game before was; the follower sees the ego of its own game."""
    with arena_of(straight, None, CLOSE) as arena:
        for followers in ((CLOSE, None), (None, None), (None, FAR), (FAR, CLOSE)):
            for _ in range(20):
                pedal(arena, -0.2)
            arena.reset({game: start(straight, each) for game, each in enumerate(followers)})
            pedal(arena, 0.0)
            assert arena.reading is not None
            there = [bool(row[0]) if len(row) else False for row in arena.reading.present]
            assert there == [each is not None for each in followers]
            for game in np.flatnonzero(there).tolist():
                assert gaps_m(arena)[game] == pytest.approx(2.5 + SPEED_MPS * followers[game].time_gap_s, abs=0.2)
