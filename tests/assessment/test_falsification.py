"""Searches of starts: where their points come from, what they minimise, and that they start games there."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest

from harness.assessment.falsification import NOT_CLOSE_S, Searcher, falsify, generations, loss_of
from harness.drivers.sumo import SumoDriver
from harness.game.arrays import FloatArray
from harness.game.follower import RANGES, SPEED_FACTORS, ordinary_driver_at
from harness.road.scene.open_scene import OpenScene, open_scene
from tests.support.rollouts import RANDOM, Steady, arm, trace

DIMENSIONS, GAMES = 6, 200
TARGET = np.array([0.9, 0.2, 0.6, 0.4, 0.8, 0.1])


def searched(searcher: Searcher, repeat: int = 0, games: int = GAMES) -> list[FloatArray]:
    """The points of a search for the point nearest to the target."""
    search = generations(searcher, DIMENSIONS, "test", repeat)
    found, points = list[FloatArray](), next(search)
    while len(found) < games:
        found += [*points]
        points = search.send(np.sum((points - TARGET) ** 2, axis=1).tolist())
    return found[:games]


@pytest.mark.parametrize("searcher", Searcher)
def test_generations__lie_in_the_cube_and_depend_on_their_parts_alone(searcher: Searcher) -> None:
    found = np.array(searched(searcher))
    assert ((found >= 0.0) & (found <= 1.0)).all()
    assert (found == np.array(searched(searcher))).all()
    assert not (found == np.array(searched(searcher, repeat=1))).all()


@pytest.mark.parametrize("searcher", [Searcher.CROSS_ENTROPY, Searcher.CMA_ES])
def test_generations__of_a_searcher_come_closer_than_those_of_chance(searcher: Searcher) -> None:
    def median_of_last(which: Searcher) -> float:
        last = np.array(searched(which)[-40:])
        return float(np.median(np.linalg.norm(last - TARGET, axis=1)))

    assert median_of_last(searcher) < 0.4 * median_of_last(Searcher.RANDOM)


def test_generations__of_cma_es_go_on_after_it_has_converged() -> None:
    search = generations(Searcher.CMA_ES, 2, "flat")
    generation = next(search)
    for _ in range(400):
        generation = search.send([1.0] * len(generation))
        assert generation.shape[1] == 2
        assert ((generation >= 0.0) & (generation <= 1.0)).all()


def test_loss__is_the_time_to_collision_within_bounds_and_nothing_where_the_ego_fails() -> None:
    assert loss_of({"ego_failed": 0, "ego_min_ttc_s": 1.5}) == 1.5
    assert loss_of({"ego_failed": 0, "ego_min_ttc_s": None}) == NOT_CLOSE_S
    assert loss_of({"ego_failed": 0, "ego_min_ttc_s": 99.0}) == NOT_CLOSE_S
    assert loss_of({"ego_failed": 1, "ego_min_ttc_s": 0.0}) == 0.0


def test_ordinary_driver__has_the_ends_of_the_ranges_at_the_corners_of_the_cube() -> None:
    for corner in (0, 1):
        driver = ordinary_driver_at(np.full(len(RANGES), float(corner)))
        assert tuple(vars(driver).values()) == tuple(bounds[corner] for bounds in RANGES)


@pytest.mark.parametrize("searcher", Searcher)
def test_falsify__a_generation_side_by_side_has_the_games_of_its_points(
    searcher: Searcher, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The last generation is cut off; the games do not depend on those that are played beside them."""
    assessed = arm(open_scene("paper_merge"), RANDOM, RANDOM)
    together = [repr((game.record, game.trace)) for game in falsify(assessed, searcher, games=25, repeat=1)]
    monkeypatch.setattr("harness.assessment.rollout.side_by_side", lambda drivers, walks, with_sumo: None)
    alone = [repr((game.record, game.trace)) for game in falsify(assessed, searcher, games=25, repeat=1)]
    assert together == alone
    assert len(set(together)) == 25


def test_falsify__where_sumo_drives_a_generation_is_one_batch(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("harness.assessment.rollout._Rollout.play_alone", None)  # no game is played alone
    searched = arm(open_scene("paper_merge"), RANDOM, SumoDriver())
    first, again = ([*falsify(searched, Searcher.RANDOM, games=20, repeat=0)] for _ in range(2))
    assert [repr(game.trace) for game in first] == [repr(game.trace) for game in again]
    assert len({repr(game.trace) for game in first}) == 20


def test_falsify__games_start_within_the_ranges_of_the_scene_and_sumo_drives_as_told(straight: OpenScene) -> None:
    games = list(falsify(arm(straight, Steady(), SumoDriver()), Searcher.RANDOM, games=6, repeat=0))
    again = list(islice(falsify(arm(straight, Steady(), SumoDriver()), Searcher.RANDOM, games=6, repeat=0), 3))
    assert [game.record for game in games[:3]] == [game.record for game in again]
    assert len({game.played["episode"] for game in games}) == 6
    low, high = straight.places[1].speed_mps
    first_mps = [trace(game).query("step == 0 and player == 'non_ego'")["speed_mps"].item() for game in games]
    assert all(low <= speed <= high for speed in first_mps)
    last_mps = [trace(game).query("player == 'non_ego'")["speed_mps"].max() for game in games]
    shares = np.array(last_mps) / float(straight.world.road.routes.speed_limit_mps[0])
    assert ((shares > SPEED_FACTORS[0] - 0.05) & (shares < SPEED_FACTORS[1] + 0.05)).all()
    assert np.ptp(shares) > 0.1
