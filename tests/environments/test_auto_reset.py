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
from harness.game.seeding import generator_of
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
        assert departures == (scene.departures(generator_of(*parts, "others")) if scene.has_background_traffic else [])


def test_games__start_in_the_arena(scene: OpenScene, arena_of: Open) -> None:
    arena = arena_of(scene, TILES)
    AutoReset(arena, scene.start_distribution([HumanFactors(), HumanFactors()], [1.0, 1.0]), "a").reset([2])
    assert arena.state.present.tolist() == [[game == 2] * 2 for game in range(TILES)]
