"""Searches of starts: where their points come from, what they minimise, and that they start games there."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest

from harness.assessment.falsification import FIRST_EPISODE, NOT_CLOSE_S, Searcher, falsify, generations, loss_of
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
    searched = arm(open_scene("paper_merge"), Steady(), RANDOM)
    games = [game for _, game in falsify(searched, Searcher.RANDOM, games=20, repeats=1)]
    for game in games:
        time_s = game.record["ego_min_ttc_s"]
        far = NOT_CLOSE_S if time_s is None else min(time_s, NOT_CLOSE_S)
        assert loss_of(game) == (0.0 if game.record["ego_failed"] else far)
    assert {game.record["ego_failed"] for game in games} == {0, 1}


def test_ordinary_driver__has_the_ends_of_the_ranges_at_the_corners_of_the_cube() -> None:
    for corner in (0, 1):
        driver = ordinary_driver_at(np.full(len(RANGES), float(corner)))
        assert tuple(vars(driver).values()) == tuple(bounds[corner] for bounds in RANGES)


@pytest.mark.parametrize("searcher", Searcher)
def test_falsify__generations_of_several_searches_side_by_side_have_the_games_of_their_points(
    searcher: Searcher, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The last generation is cut off; the games do not depend on those that are played beside them."""
    assessed = arm(open_scene("paper_merge"), RANDOM, RANDOM)
    together = list(falsify(assessed, searcher, games=25, repeats=2))
    monkeypatch.setattr("harness.assessment.rollout.side_by_side", lambda drivers, walks, with_sumo: None)
    alone = list(falsify(assessed, searcher, games=25, repeats=2))
    assert [repr((number, game.record, game.trace)) for number, game in together] == [
        repr((number, game.record, game.trace)) for number, game in alone
    ]
    assert len({repr(game.trace) for _, game in together}) == 50
    for repeat in (0, 1):
        first = FIRST_EPISODE + 25 * repeat
        episodes = [game.played["episode"] for number, game in together if number == repeat]
        assert episodes == list(range(first, first + 25))


def test_falsify__a_search_does_not_depend_on_the_others() -> None:
    assessed = arm(open_scene("paper_merge"), RANDOM, RANDOM)
    one, several = (
        [
            repr(game.trace)
            for number, game in falsify(assessed, Searcher.CMA_ES, games=25, repeats=repeats)
            if not number
        ]
        for repeats in (1, 3)
    )
    assert one == several


def test_falsify__where_sumo_drives_the_generations_are_one_batch(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("harness.assessment.rollout._Rollout.play_alone", None)  # no game is played alone
    searched = arm(open_scene("paper_merge"), RANDOM, SumoDriver())
    first, again = (
        [repr(game.trace) for _, game in falsify(searched, Searcher.RANDOM, games=20, repeats=2)] for _ in range(2)
    )
    assert first == again
    assert len({*first}) == 40


def test_falsify__games_start_within_the_ranges_of_the_scene_and_sumo_drives_as_told(straight: OpenScene) -> None:
    searched = arm(straight, Steady(), SumoDriver())
    games = [game for _, game in falsify(searched, Searcher.RANDOM, games=6, repeats=1)]
    again = [game for _, game in islice(falsify(searched, Searcher.RANDOM, games=6, repeats=1), 3)]
    assert [game.record for game in games[:3]] == [game.record for game in again]
    assert len({game.played["episode"] for game in games}) == 6
    low, high = straight.places[1].speed_mps
    first_mps = [trace(game).query("step == 0 and player == 'non_ego'")["speed_mps"].item() for game in games]
    assert all(low <= speed <= high for speed in first_mps)
    last_mps = [trace(game).query("player == 'non_ego'")["speed_mps"].max() for game in games]
    shares = np.array(last_mps) / float(straight.world.road.routes.speed_limit_mps[0])
    assert ((shares > SPEED_FACTORS[0] - 0.05) & (shares < SPEED_FACTORS[1] + 0.05)).all()
    assert np.ptp(shares) > 0.1
