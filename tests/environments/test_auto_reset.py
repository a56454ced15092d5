"""Automatic resets: a game drawn in advance is the same as one drawn at its reset."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.environments.arena import Arena
from harness.environments.auto_reset import AutoReset
from harness.game.human_factors import HumanFactors
from harness.game.initial_state import InitialState, draw_initial_state
from harness.road.demand.route_file import Departure
from harness.road.scene.open_scene import OpenScene
from tests.support.scenes import build_scene

TILES = 4
FLOW = '<flow id="van" type="van" begin="0" end="20" probability="0.3"><route edges="road"/></flow>'
Open = Callable[..., Arena]


class _RecordingArena:
    """Stands in for an arena and records its resets."""

    games = TILES

    def __init__(self, scene: OpenScene) -> None:
        self.scene = scene
        self.resets: list[tuple[int, InitialState, list[Departure]]] = []

    def reset(self, starts: Mapping[int, InitialState], departures: Mapping[int, list[Departure]]) -> None:
        self.resets += [(tile, start, departures[tile]) for tile, start in starts.items()]


@pytest.fixture(scope="module", params=["", FLOW], ids=["alone", "with_traffic"])
def scene(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> OpenScene:
    return build_scene(tmp_path_factory.mktemp("scenes") / "road", others=request.param)


@given(order=st.lists(st.sets(st.integers(0, TILES - 1), min_size=1), max_size=12))
def test_games__of_a_tile_do_not_depend_on_other_tiles(scene: OpenScene, order: list[set[int]]) -> None:
    start_distribution = scene.start_distribution([HumanFactors(), HumanFactors()], [1.0, 0.5])
    arena = _RecordingArena(scene)
    games = AutoReset(arena, start_distribution, "a", 1)  # type: ignore[arg-type]
    for tiles in order:
        games.reset(tiles)
    assert [tile for tile, *_ in arena.resets] == [tile for tiles in order for tile in tiles]
    counts = [0] * TILES
    for tile, start, departures in arena.resets:
        parts = ("a", 1, tile, counts[tile])
        counts[tile] += 1
        alone = draw_initial_state(start_distribution, *parts)
        assert start.parts == parts
        assert np.array_equal(start.position_m, alone.position_m)
        assert np.array_equal(start.present, alone.present)
        assert np.array_equal(start.noise, alone.noise)
        assert departures == (scene.departures(*parts))


class _Replays:
    """Replays one start in tile 1, and nothing in the others."""

    def __init__(self, start: InitialState) -> None:
        self.start = start
        self.told: list[tuple[int, float]] = []

    def replay(self, tile: int, drawn: InitialState) -> InitialState | None:
        return self.start if tile == 1 else None

    def ended(self, tile: int, payoff: float) -> None:
        self.told.append((tile, payoff))


def test_games__a_replay_takes_the_place_of_a_drawn_game_and_changes_no_other(scene: OpenScene) -> None:
    start_distribution = scene.start_distribution([HumanFactors(), HumanFactors()], [1.0, 0.5])
    replays = _Replays(draw_initial_state(start_distribution, "pool", 3))
    plain, arena = _RecordingArena(scene), _RecordingArena(scene)
    drawn = AutoReset(plain, start_distribution, "a", 1)  # type: ignore[arg-type]
    games = AutoReset(arena, start_distribution, "a", 1, replays=replays)  # type: ignore[arg-type]
    drawn.ended(1, 2.5)
    for tiles in ({0, 1}, {1, 2}, {0, 1}):
        games.ended(1, 2.5)
        drawn.reset(tiles)
        games.reset(tiles)
    assert replays.told == [(1, 2.5)] * 3
    departures = scene.departures("pool", 3)
    for (tile, start, departing), (_, alone, as_drawn) in zip(arena.resets, plain.resets, strict=True):
        assert (start is replays.start) == (tile == 1)
        assert departing == (departures if tile == 1 else as_drawn)
        assert tile == 1 or start.parts == alone.parts


def test_games__start_in_the_arena(scene: OpenScene, arena_of: Open) -> None:
    arena = arena_of(scene, TILES)
    AutoReset(arena, scene.start_distribution([HumanFactors(), HumanFactors()], [1.0, 1.0]), "a").reset([2])
    assert arena.state.present.tolist() == [[game == 2] * 2 for game in range(TILES)]
