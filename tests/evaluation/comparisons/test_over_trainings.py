"""What is said about trainings like those of a campaign: interval, test and verdict over trainings and starts."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
import scipy.stats
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.evaluation.comparisons.over_trainings import compare_over_trainings, crossed_mean
from harness.evaluation.competence import Question
from harness.game.arrays import FloatArray

RQ1 = Question(question="RQ1", persona="speedy", seed=1, baseline="naive_alone", treatment="naive_vs_speedy")
RQ2 = Question(question="RQ2", persona="speedy", seed=1, baseline="naive_vs_speedy", treatment="retrained_vs_speedy")


def random_of(seed: int) -> np.random.Generator:
    return np.random.default_rng(seed)


def arm(name: str, seed: int, failed: FloatArray) -> pd.DataFrame:
    """Games of one arm; NaN is a game that could not be played."""
    errored = np.isnan(failed)
    return pd.DataFrame(
        {
            "arm": name,
            "seed": seed,
            "episode": range(len(failed)),
            "ego_outcome": np.where(errored, "error", np.where(failed > 0, "rail", "goal")),
            "ego_failed": pd.array(np.where(errored, 0, failed).astype(int), dtype="Int64"),
            "ego_mean_speed_mps": 12.0,
            "error": np.where(errored, "it died", ""),
        }
    )


def compared(failed: FloatArray, *questions: Question, alone: FloatArray | None = None) -> dict[Any, Any]:
    """RQ1's row where the naive ego fails so against the person [R, K], and alone so, or never."""
    without = np.zeros_like(failed) if alone is None else alone
    seeds = range(1, len(failed) + 1)
    games = [arm("naive_alone", seed, row) for seed, row in zip(seeds, without, strict=True)]
    games += [arm("naive_vs_speedy", seed, row) for seed, row in zip(seeds, failed, strict=True)]
    asked = questions or [replace(RQ1, seed=seed) for seed in seeds]
    (row,) = compare_over_trainings(list(asked), pd.concat(games), 0.01).to_dict("records")
    return row


def failing(*counts: int, of: int = 100) -> FloatArray:
    """[R, K] where each training fails the first so many starts."""
    return np.array([[1.0] * count + [0.0] * (of - count) for count in counts])


# --- the arithmetic ---------------------------------------------------------------------------------------------------


def test_crossed_mean__of_trainings_that_differ_and_starts_that_do_not_is_students_t_of_the_trainings() -> None:
    """Each training has one value for all starts: the classical interval of three values, on paper."""
    of_each = np.array([0.1, 0.2, 0.6])
    found = crossed_mean(np.repeat(of_each[:, None], 50, axis=1))
    assert found is not None
    error = of_each.std(ddof=1) / math.sqrt(3)
    assert found.mean == pytest.approx(0.3)
    assert found.standard_error == pytest.approx(error, rel=1e-12)
    assert found.degrees == pytest.approx(2.0)
    assert found.interval == pytest.approx((0.3 - 4.30265 * error, 0.3 + 4.30265 * error), rel=1e-5)
    assert found.p_value == pytest.approx(scipy.stats.ttest_1samp(of_each, 0.0, alternative="greater").pvalue)


def test_crossed_mean__of_starts_that_differ_and_trainings_that_do_not_is_that_of_the_starts() -> None:
    """Three equal trainings are no more than one: what they share is sampled once."""
    one = np.array([1.0] * 12 + [0.0] * 88)
    found = crossed_mean(np.tile(one, (3, 1)))
    assert found is not None
    assert found.standard_error == pytest.approx(one.std() / 10)
    assert found.degrees == pytest.approx(99.0)


def test_crossed_mean__without_a_spread_is_none() -> None:
    assert crossed_mean(np.zeros((3, 10))) is None
    assert crossed_mean(np.ones((3, 10))) is None


# --- properties -------------------------------------------------------------------------------------------------------


def resampled_means(differences: FloatArray, random: np.random.Generator, resamples: int) -> FloatArray:
    """The means of a two-level bootstrap of differences [R, K], by drawing."""
    trainings, starts = differences.shape
    drawn = (
        differences[np.ix_(random.integers(trainings, size=trainings), random.integers(starts, size=starts))].mean()
        for _ in range(resamples)
    )
    return np.array(list(drawn))


def test_standard_error__is_that_of_a_bootstrap_of_both_margins() -> None:
    """The part of the trainings has the factor n / (n - 1), which the means of a bootstrap lack."""
    random = random_of(3)
    differences = (random.random((4, 40)) < np.array([0.1, 0.2, 0.4, 0.7])[:, None]).astype(float)
    found = crossed_mean(differences)
    assert found is not None
    lacking = differences.mean(axis=1).var() / 4 / 3  # n / (n - 1) - 1 = 1 / 3 of the variance of the trainings' mean
    variance = resampled_means(differences, random, 20_000).var() + lacking
    assert found.standard_error == pytest.approx(np.sqrt(variance), rel=0.03)


@given(counts=st.lists(st.integers(0, 30), min_size=3, max_size=6).filter(any))
@settings(max_examples=20, deadline=None, derandomize=True)
def test_crossed_mean__does_not_depend_on_the_order(counts: list[int]) -> None:
    differences = failing(*counts, of=30) - failing(*[1] * len(counts), of=30)
    if np.ptp(differences) == 0:
        return
    found, turned = crossed_mean(differences), crossed_mean(differences[::-1, ::-1])
    assert found is not None
    assert turned is not None
    assert found.interval == pytest.approx(turned.interval)
    low, high = found.interval
    assert -1.0 <= low <= differences.mean() <= high <= 1.0


@given(spread=st.integers(5, 12))
@settings(max_examples=15, deadline=None, derandomize=True)
def test_interval__is_wider_where_trainings_vary(spread: int) -> None:
    """The same failures in all, in trainings that agree and in trainings that do not."""
    widths = []
    for counts in ((12, 12, 12), (12 - spread, 12, 12 + spread)):
        found = crossed_mean(failing(*counts))
        assert found is not None
        widths.append(found.interval[1] - found.interval[0])
    assert widths[1] > 1.2 * widths[0]


@pytest.mark.parametrize(
    ("trainings", "spread", "shared"), [(3, 0.0, 0.0), (3, 0.0, 0.7), (3, 0.08, 0.5), (3, 0.2, 0.5), (6, 0.12, 0.5)]
)
def test_interval__has_the_true_difference_in_it_nearly_as_often_as_it_says(
    trainings: int, spread: float, shared: float
) -> None:
    """In campaigns whose trainings fail a start with a chance of their own, 30 % on average; a share of starts is as
    hard for one training as for the next. At least 90 % of the 95 % intervals hold: chances that are cut off at 0 are
    not normal, as Student's t has them."""
    random, campaigns, hits = random_of(7), 300, 0
    chances_of_many = np.clip(0.3 + spread * random.standard_normal(200_000), 0, 1)
    for _ in range(campaigns):
        chances = random.choice(chances_of_many, trainings)[:, None]
        own, of_start = random.random((trainings, 100)), random.random(100)
        failed = np.where(random.random(100) < shared, of_start, own) < chances
        found = crossed_mean(failed.astype(float))
        if found is not None:  # else no training failed any start, and the true difference is missed
            low, high = found.interval
            hits += low <= chances_of_many.mean() <= high
    assert hits / campaigns >= 0.9


# --- rows -------------------------------------------------------------------------------------------------------------


def test_row__says_what_holds_for_trainings_like_this() -> None:
    row = compared(failing(14, 13, 9))
    assert (row["question"], row["persona"], row["about"]) == ("RQ1", "speedy", "trainings like this")
    assert (row["trainings"], row["trainings_left_out"], row["starts"], row["starts_left_out"]) == (3, 0, 100, 0)
    assert row["mean_difference"] == pytest.approx(0.12)
    assert (row["least"], row["most"]) == (0.09, 0.14)
    assert 0.04 < row["ci_low"] < 0.07 < 0.17 < row["ci_high"] < 0.20
    assert (row["planned_tests"], row["p_holm"], row["verdict"]) == (1, row["p_value"], "significant")


def test_row__of_trainings_that_contradict_each_other_is_not_significant() -> None:
    """Two of three pairs are significant by themselves."""
    row = compared(failing(0, 20, 40))
    assert row["mean_difference"] == pytest.approx(0.2)
    assert row["ci_low"] < 0 < row["ci_high"]
    assert row["verdict"] == "not significant"


def test_row__fewer_failures_support_rq2() -> None:
    seeds = (1, 2, 3)
    games = [arm("naive_vs_speedy", seed, failing(20)[0]) for seed in seeds]
    games += [arm("retrained_vs_speedy", seed, failing(2)[0]) for seed in seeds]
    (row,) = compare_over_trainings([replace(RQ2, seed=seed) for seed in seeds], pd.concat(games), 0.01).to_dict(
        "records"
    )
    assert row["mean_difference"] == pytest.approx(0.18)
    assert row["verdict"] == "significant"


def test_row__no_difference_is_no_interval() -> None:
    row = compared(failing(0, 0, 0))
    assert (row["mean_difference"], row["verdict"]) == (0.0, "no difference")
    assert all(math.isnan(row[name]) for name in ("ci_low", "ci_high", "p_value", "p_holm"))
    assert compared(failing(100, 100, 100))["verdict"] == "no t statistic: all differences equal"


def test_row__starts_that_one_training_could_not_play_are_left_out_and_counted() -> None:
    failed = failing(14, 13, 9, 12)
    failed[1, :2] = np.nan
    row = compared(failed)
    assert (row["trainings"], row["starts"], row["starts_left_out"]) == (4, 98, 2)
    assert row["mean_difference"] == pytest.approx((12 + 11 + 7 + 10) / 4 / 98)


def test_row__trainings_whose_question_is_not_answered_are_left_out_with_the_reason() -> None:
    asked = [replace(RQ1, seed=seed) for seed in (1, 2, 3, 4)]
    asked[1] = replace(asked[1], unlike_people="the speedy driver is unlike people")
    row = compared(failing(14, 90, 13, 9), *asked)
    assert (row["trainings"], row["trainings_left_out"], row["reason"]) == (3, 1, "")
    assert row["most"] == 0.14
    failed = failing(14, 90, 13, 9)
    failed[3, 1:] = np.nan
    row = compared(failed, *asked)
    assert (row["trainings"], row["verdict"], row["planned_tests"]) == (2, "not enough trainings", 1)
    assert row["reason"] == (
        "training seed 2: the speedy driver is unlike people; training seed 4: fewer than two pairs of games"
    )
    assert math.isnan(row["p_value"])


def test_rows__with_fewer_than_three_training_seeds_there_is_none() -> None:
    asked = [replace(RQ1, seed=seed) for seed in (1, 2)]
    games = [arm(name, seed, failing(5)[0]) for name in ("naive_alone", "naive_vs_speedy") for seed in (1, 2)]
    assert compare_over_trainings(asked, pd.concat(games), 0.01).empty


def test_rows__are_corrected_for_all_planned_tests_also_for_those_that_were_not_made() -> None:
    seeds = (1, 2, 3)
    games = [
        arm(name, seed, failed)
        for seed in seeds
        for name, failed in (("naive_alone", failing(0)[0]), ("naive_vs_speedy", failing(8 + seed)[0]))
    ]
    others = [replace(RQ1, persona=name, treatment=f"naive_vs_{name}") for name in ("anna", "bert")]
    asked = [replace(each, seed=seed) for each in (RQ1, *others) for seed in seeds]
    row, *absent = compare_over_trainings(asked, pd.concat(games), 0.01).to_dict("records")
    assert row["p_holm"] == 3 * row["p_value"]
    assert [each["verdict"] for each in absent] == ["not enough trainings"] * 2
    assert {each["planned_tests"] for each in (row, *absent)} == {3}
