"""Starts by regret: what it is, which starts are replayed, and that a training replays them and can be interrupted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import harness.environments.vector_env
import harness.training.regret_starts
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.drivers.mixture import mixture_of
from harness.drivers.policy_file import LearnedDriver, write_policy
from harness.game.initial_state import InitialState
from harness.game.roles import EGO
from harness.road.scene.open_scene import OpenScene
from harness.training.paired_rollouts import SeededStarts, seeded_starts
from harness.training.ppo import TrainingResult
from harness.training.regret_starts import REPLAY_SHARE, RegretReplays, first_scores, replay_weights, scores_of
from harness.training.training_games import TrainingSpec
from tests.support.policies import some_policy
from tests.support.rollouts import Steady
from tests.support.tiny import SPEEDY, settings
from tests.support.trainings import beside, in_one_go, naive_ego

POOL = 12
regrets = st.lists(st.one_of(st.floats(0.0, 50.0), st.just(np.inf)), min_size=1, max_size=12)


# --- the regret of a start ---


def test_regret__is_the_best_payoff_minus_the_latest_and_at_least_zero() -> None:
    payoffs = np.array([[3.0, -5.0, 4.0], [1.0, -2.0, 9.0]])
    failed = np.array([[False, True, True], [True, True, False]])
    scores = scores_of(payoffs, failed)
    assert scores.best_payoffs == [3.0, -2.0, 9.0]
    assert scores.preventable == [True, False, True]
    assert scores.regrets.tolist() == [np.inf] * 3
    assert scores.mean_regret is None
    after = scores.after(0, 2.5).after(2, -1.0)
    assert after.regrets.tolist() == [0.5, np.inf, 10.0]
    assert after.mean_regret == 5.25
    assert (after.replays, after.last_replays) == (2, [1, 0, 2])
    better = after.after(2, 11.0)  # the latest payoff counts, and nothing is owed for one that is better than the best
    assert better.regrets.tolist() == [0.5, np.inf, 0.0]
    assert scores.latest_payoffs == [None] * 3


def test_mean_regret__is_over_preventable_starts_alone() -> None:
    scores = scores_of(np.array([[3.0, 7.0]]), np.array([[False, True]])).after(0, 1.0).after(1, -9.0)
    assert scores.regrets.tolist() == [2.0, 16.0]
    assert scores.mean_regret == 2.0


# --- which start is next ---


def test_weights__are_by_rank_and_staleness() -> None:
    """Ranks 2, 1 and 3: by rank 2^-10, 1 and 3^-10 of their sum; by age 1, 0 and 3 fourths."""
    found = replay_weights(np.array([2.0, 5.0, 0.0]), np.array([1.0, 0.0, 3.0]))
    of_ranks = 2.0**-10 + 1.0 + 3.0**-10
    expected = [0.9 * 2.0**-10 / of_ranks + 0.1 / 4, 0.9 / of_ranks, 0.9 * 3.0**-10 / of_ranks + 0.1 * 3 / 4]
    assert found == pytest.approx(expected, rel=1e-12)


def test_weights__of_equal_regrets_are_equal_and_starts_without_a_replay_come_first() -> None:
    new, ages = replay_weights(np.array([np.inf, 50.0, np.inf]), np.zeros(3)), np.array([2.0, 0.0, 2.0])
    assert new == pytest.approx([1 / (2 + 3.0**-10), 3.0**-10 / (2 + 3.0**-10), 1 / (2 + 3.0**-10)])
    assert replay_weights(np.zeros(3), np.zeros(3)) == pytest.approx([1 / 3] * 3)
    assert replay_weights(np.zeros(3), ages) == pytest.approx([0.3 + 0.05, 0.3, 0.3 + 0.05])


@given(regret=regrets, age=st.integers(0, 1000), seed=st.integers(0, 99))
def test_weights__sum_to_one_and_do_not_fall_with_regret(regret: list[float], age: int, seed: int) -> None:
    of_starts = np.array(regret)
    ages = np.random.default_rng(seed).integers(0, 100, len(regret)).astype(float)
    assert replay_weights(of_starts, ages).sum() == pytest.approx(1.0)
    rising = np.sort(of_starts)
    weights = replay_weights(rising, np.full(len(regret), float(age)))
    assert (weights > 0.0).all()
    np.testing.assert_array_equal(weights[1:] > weights[:-1], rising[1:] > rising[:-1])
    assert (weights[1:] >= weights[:-1]).all()


@pytest.fixture
def opposed(merge: OpenScene) -> SeededStarts:
    """Seeded starts against a speedy person."""
    other = mixture_of(Steady(), read_document(SPEEDY, Persona))
    return seeded_starts(merge, naive_ego(merge).personas[0], (other,), 0.0, "test", "pool")


def drawn(opposed: SeededStarts, count: int) -> list[InitialState]:
    """Starts as a training draws them, with other random numbers than those of the pool."""
    return [replace(opposed, parts=("test", "drawn")).start(number) for number in range(count)]


def test_replays__are_half_of_the_games_beside_others_by_seeded_draws(opposed: SeededStarts) -> None:
    scores = scores_of(np.array([[5.0, 5.0, 5.0]]), np.array([[False, False, True]])).after(1, 4.0).after(0, 1.0)

    def replayed() -> list[InitialState | None]:
        return [RegretReplays(opposed, scores).replay(0, each) for each in drawn(opposed, 200)]

    found = [each.parts[-1] for each in replayed() if each is not None]
    assert len(found) / 200 == pytest.approx(REPLAY_SHARE, abs=0.1)
    assert set(found) == {0, 1}  # 1 by its age; 2 is unpreventable
    assert found.count(0) / len(found) == pytest.approx(0.9, abs=0.08)  # by its rank
    assert [each and each.parts for each in replayed()] == [each and each.parts for each in replayed()]
    alone = [replace(each, present=np.array([True, False])) for each in drawn(opposed, 50)]
    assert not any(RegretReplays(opposed, scores).replay(0, each) for each in alone)


def test_replays__a_start_is_in_one_game_at_a_time_and_its_payoff_is_entered(opposed: SeededStarts) -> None:
    replays = RegretReplays(opposed, scores_of(np.array([[5.0, 7.0]]), np.array([[False, False]])))
    tiles: dict[int, Any] = {}
    for tile, each in enumerate(drawn(opposed, 40)):
        if (start := replays.replay(tile, each)) is not None:
            tiles[tile] = start.parts[-1]
    assert sorted(tiles.values()) == [0, 1]  # all others are drawn
    for tile in range(40):
        replays.ended(tile, 1.0 + tile)
    latest = {start: 1.0 + tile for tile, start in tiles.items()}
    assert replays.scores.latest_payoffs == [latest[0], latest[1]]
    assert replays.scores.replays == 2
    assert sorted(replays.scores.last_replays) == [1, 2]
    before = replays.scores
    replays.ended(next(iter(tiles)), 99.0)  # of a game that is no replay any more
    assert replays.scores == before


# --- in a training ---


@pytest.fixture
def by_regret(merge: OpenScene, monkeypatch: pytest.MonkeyPatch) -> TrainingSpec:
    """A training of two segments by regret, with a pool of a few starts."""
    monkeypatch.setattr(harness.training.regret_starts, "POOL", POOL)
    other = mixture_of(Steady(), read_document(SPEEDY, Persona))
    known = LearnedDriver(some_policy(seed=1), sampled=False)
    short_games = settings(initial_deviation=0.5, demonstration_steps=0)  # most of them end at the rail
    return beside(naive_ego(merge), EGO, other, alone_share=0.25, best_known=known, settings=short_games)


@pytest.fixture
def resets(monkeypatch: pytest.MonkeyPatch) -> list[InitialState]:
    """The starts of all games of a training, in their order."""
    begun: list[InitialState] = []
    reset = harness.environments.vector_env.Arena.reset

    def recording(arena: Any, starts: Any, departures: Any = None) -> None:
        begun.extend(starts.values())
        reset(arena, starts, departures)

    monkeypatch.setattr(harness.environments.vector_env.Arena, "reset", recording)
    return begun


def in_training(starts: list[InitialState]) -> list[InitialState]:
    """Those of the training itself: the pool is played before it."""
    first = next(number for number, each in enumerate(starts) if "segment" in each.parts)
    return starts[first:]


def stop_after(segments: int) -> Callable[[int, int], None]:
    """An `on_progress` that ends the training, as a killed process would, in the segment after `segments`."""

    def report(done: int, total: int) -> None:
        if done > segments * 1024:
            raise KeyboardInterrupt

    return report


def written(result: TrainingResult, folder: Path) -> bytes:
    write_policy(result.policy, folder)
    return (folder / "policy.safetensors").read_bytes()


def test_train__replays_starts_and_an_interruption_changes_nothing(
    by_regret: TrainingSpec, resets: list[InitialState], tmp_path: Path
) -> None:
    (tmp_path / "whole").mkdir()
    whole = in_one_go(by_regret, tmp_path / "whole")
    scores = whole.progress.regret
    assert scores is not None
    assert len(scores.best_payoffs) == POOL
    assert any(scores.preventable)
    played = [start for start, payoff in enumerate(scores.latest_payoffs) if payoff is not None]
    assert played
    assert all(scores.preventable[start] for start in played)
    assert whole.progress.curve[-1].mean_regret == scores.mean_regret
    games = in_training(resets)
    replays = [each for each in games if "pool" in each.parts]
    assert {each.parts[-1] for each in replays} >= set(played)
    assert all(each.present.all() for each in replays)
    assert len(replays) >= scores.replays > 0  # some were still running at the end of a segment
    assert 0 < len(replays) < 0.6 * len(games)

    with pytest.raises(KeyboardInterrupt):
        in_one_go(by_regret, tmp_path, on_progress=stop_after(1))
    resets.clear()
    resumed = in_one_go(by_regret, tmp_path)
    assert not [each for each in resets if "segment" not in each.parts and "pool" not in each.parts]
    assert resumed.progress == whole.progress
    assert written(resumed, tmp_path / "resumed") == written(whole, tmp_path / "whole")
    assert "segment" in next(each.parts for each in resets if "pool" not in each.parts)


def test_scores__of_a_pool_are_the_best_of_all_drivers(
    by_regret: TrainingSpec, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same games for each driver: the starts are those that the learner replays."""
    found = first_scores(by_regret)
    assert found is not None
    assert found == first_scores(by_regret)
    monkeypatch.setattr(harness.training.regret_starts, "PERSONS", ())
    of_known = first_scores(by_regret)
    assert of_known is not None
    assert (np.array(found.best_payoffs) >= np.array(of_known.best_payoffs)).all()
    assert found.best_payoffs != of_known.best_payoffs  # an untrained ego is not the best of them
    assert first_scores(replace(by_regret, best_known=None)) is None


def test_train__without_a_best_known_ego_draws_every_game(
    by_regret: TrainingSpec, resets: list[InitialState], tmp_path: Path
) -> None:
    uniform = in_one_go(replace(by_regret, best_known=None, settings=settings(steps=1024)), tmp_path)
    assert uniform.progress.regret is None
    assert [point.mean_regret for point in uniform.progress.curve] == [None]
    assert not [each for each in resets if "pool" in each.parts]
