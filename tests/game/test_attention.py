"""Lapses of attention: drawn before the game, with the durations and the frequency of the persona."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.game.arrays import BoolArray
from harness.game.attention import Attention, Lapses, NoBlindSpotCheck, draw_lapses, unseen_behind_m

TEXTING = Attention(mean_attentive_s=10.0, lapse_s=(4.0, 6.0), bumps_rad=0.01)


def runs(lapsed: BoolArray) -> list[tuple[int, int]]:
    """First step and length of every lapse."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], lapsed.astype(int), [0]))))
    return [(int(first), int(end - first)) for first, end in edges.reshape(-1, 2)]


def test_lapses__none_are_no_lapses() -> None:
    lapses = Lapses.none(250)
    assert lapses.lapsed.shape == (250,)
    assert not lapses.lapsed.any()
    assert not lapses.steering_rad.any()


def test_lapses__last_within_their_range() -> None:
    lapses = draw_lapses(TEXTING, 100_000, 0.1, np.random.default_rng(1))
    lengths = np.array([length for first, length in runs(lapses.lapsed) if 0 < first < 100_000 - length])
    assert len(lengths) > 300
    assert lengths.min() >= 40
    assert lengths.max() <= 60
    # uniform over 4..6 s: 50 steps on average, standard error 5.8 / sqrt(n) < 0.35
    assert lengths.mean() == pytest.approx(50.0, abs=5 * 0.35)


def test_lapses__occur_at_the_mean_rate() -> None:
    # an attentive stretch of 10 s on average and a lapse of 5 s: a third of the time, one lapse in 15 s
    lapses = draw_lapses(TEXTING, 200_000, 0.1, np.random.default_rng(2))
    assert lapses.lapsed.mean() == pytest.approx(1.0 / 3.0, abs=0.03)
    assert len(runs(lapses.lapsed)) == pytest.approx(20_000.0 / 15.0, rel=0.1)


def test_lapses__the_first_may_occur_at_any_time_of_a_game() -> None:
    first = []
    for seed in range(400):
        lapsed = draw_lapses(TEXTING, 250, 0.1, np.random.default_rng(seed)).lapsed
        first.append(lapsed.argmax() * 0.1 if lapsed.any() else np.inf)
    # a third of the games starts within a lapse (5 s of every 15 s); of the others, whose first lapse is exponential
    # with mean 10 s, a share of 1 - 1/e = 0.632 has lapsed by 10 s: 0.333 + 0.667 * 0.632 = 0.755, standard error 0.024
    assert np.mean(np.array(first) == 0.0) == pytest.approx(1.0 / 3.0, abs=4 * 0.024)
    assert np.mean(np.array(first) <= 10.0) == pytest.approx(0.755, abs=4 * 0.022)


def test_lapses__each_has_one_steering_angle() -> None:
    lapses = draw_lapses(TEXTING, 50_000, 0.1, np.random.default_rng(3))
    angles = []
    for first, length in runs(lapses.lapsed):
        within = lapses.steering_rad[first : first + length]
        assert (within == within[0]).all()
        angles.append(within[0])
    assert not lapses.steering_rad[~lapses.lapsed].any()
    assert np.std(angles) == pytest.approx(0.01, rel=0.15)
    assert np.mean(angles) == pytest.approx(0.0, abs=0.003)


def test_lapses__are_equal_for_equal_seeds() -> None:
    one, two, other = (draw_lapses(TEXTING, 250, 0.1, np.random.default_rng(seed)) for seed in (7, 7, 8))
    assert (one.lapsed == two.lapsed).all()
    assert (one.steering_rad == two.steering_rad).all()
    assert (one.lapsed != other.lapsed).any() or (one.steering_rad != other.steering_rad).any()


def test_lapses__of_a_longer_game_begin_like_those_of_a_shorter_one() -> None:
    short, long = (draw_lapses(TEXTING, steps, 0.1, np.random.default_rng(4)) for steps in (200, 900))
    assert (short.lapsed == long.lapsed[:200]).all()


@settings(max_examples=60, deadline=None)
@given(
    mean=st.floats(0.11, 50.0),
    shortest=st.floats(0.01, 3.0),
    more=st.floats(0.0, 3.0),
    step=st.sampled_from([0.02, 0.1, 0.5]),
    seed=st.integers(0, 2**32),
)
def test_lapses__are_apart_and_within_the_range(
    mean: float, shortest: float, more: float, step: float, seed: int
) -> None:
    attention = Attention(mean_attentive_s=mean, lapse_s=(shortest, shortest + more))
    lapses = draw_lapses(attention, 400, step, np.random.default_rng(seed))
    for first, length in runs(lapses.lapsed):
        assert length <= max((shortest + more) / step + 0.5 + 1e-9, 1)
        if 0 < first < 400 - length:  # not cut off by the start or the end of the game
            assert length >= max(shortest / step - 0.5 - 1e-9, 1)


def test_blind_spot_check__is_missing_in_its_share_of_the_games() -> None:
    factor = NoBlindSpotCheck(share=0.75, ahead_m=1.0)
    drawn = [unseen_behind_m(factor, draw) for draw in np.random.default_rng(1).random(2000)]
    assert set(drawn) == {1.0, -np.inf}
    # standard error sqrt(0.75 * 0.25 / 2000) = 0.0097
    assert np.mean(np.isfinite(drawn)) == pytest.approx(0.75, abs=4 * 0.0097)


def test_blind_spot_check__is_done_by_default() -> None:
    assert unseen_behind_m(NoBlindSpotCheck(), 0.0) == -np.inf
