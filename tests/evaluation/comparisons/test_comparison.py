from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.evaluation.comparisons.comparison import compare, holm
from harness.evaluation.competence import Question, Verdict

RQ1 = Question(question="RQ1", persona="speedy", seed=1, baseline="naive_alone", treatment="naive_vs_speedy")
RQ2 = Question(question="RQ2", persona="speedy", seed=1, baseline="naive_vs_speedy", treatment="retrained_vs_speedy")

p_value_lists = st.lists(st.floats(0, 1) | st.just(math.nan), max_size=12)


def games(arm, failed, speed=None, seed=1, first_episode=0, person=None, braking=None):
    """Games of one arm; None is an empty cell. `person` and `braking`: failures of people, and the follower's strongest
    braking."""
    count = len(failed)
    return pd.DataFrame(
        {
            "arm": arm,
            "seed": seed,
            "episode": range(first_episode, first_episode + count),
            "ego_outcome": ["collision" if cell else "goal" for cell in failed],
            "ego_failed": pd.array(failed, dtype="Int64"),
            "ego_mean_speed_mps": np.array([20.0] * count if speed is None else speed, dtype=float),
            "person_failed": pd.array([None] * count if person is None else person, dtype="Int64"),
            "bystander_failed": pd.array([None] * count, dtype="Int64"),
            "follower_max_deceleration_mps2": np.array([np.nan] * count if braking is None else braking, dtype=float),
            "error": "",
        }
    )


def both_metrics(question, *arms, significance=0.01):
    failure, mean_speed = compare([question], pd.concat(arms), significance).to_dict("records")
    return failure, mean_speed


def same(value, expected):
    return value == pytest.approx(expected, rel=1e-12, nan_ok=True)


def test_compare__agrees_with_the_arithmetic_on_paper():
    # failure differences, treatment - baseline: 1, 1, 0, 1, 0, 1, 0, -1 (n = 8)
    # mean = (4 - 1) / 8 = 0.375; squares sum to 5; variance = (5 - 8 * 0.375**2) / 7 = 3.875 / 7
    baseline = games("naive_alone", [0, 0, 0, 0, 1, 0, 0, 1])
    treatment = games("naive_vs_speedy", [1, 1, 0, 1, 1, 1, 0, 0])
    row, _ = both_metrics(RQ1, baseline, treatment)
    deviation = math.sqrt(3.875 / 7)
    assert (row["pairs"], row["pairs_left_out"]) == (8, 0)
    assert same(row["mean_difference"], 0.375)
    assert same(row["effect_size"], 0.375 / deviation)
    assert same(row["t"], 0.375 / (deviation / math.sqrt(8)))  # 1.42557
    assert row["t"] == pytest.approx(1.42557, abs=1e-5)
    # Student's t with 7 degrees of freedom: 97.5 % quantile 2.364624 (printed tables: 2.365)
    assert row["ci_low"] == pytest.approx(0.375 - 2.364624 * deviation / math.sqrt(8), abs=1e-6)
    assert row["ci_high"] == pytest.approx(0.375 + 2.364624 * deviation / math.sqrt(8), abs=1e-6)
    # McNemar: 5 discordant pairs, 4 for H1; P(X >= 4 | 5, 1/2) = (5 + 1) / 32
    assert same(row["mcnemar_p"], 6 / 32)
    assert not row["rejects_h0"]
    assert row["verdict"] == "not significant"


def test_compare__p_value_of_two_degrees_of_freedom_has_its_closed_form():
    # speeds 1, 2, 6 slower: mean 3, variance (4 + 1 + 9)/2 = 7, t = 3 / sqrt(7/3); for 2 degrees of freedom
    # P(T > t) = 1/2 - t / (2 sqrt(2 + t**2))
    baseline = games("naive_alone", [0, 0, 0], speed=[20, 20, 20])
    treatment = games("naive_vs_speedy", [0, 0, 0], speed=[19, 18, 14])
    _, row = both_metrics(RQ1, baseline, treatment)
    t = 3 / math.sqrt(7 / 3)
    assert same(row["t"], t)
    assert row["p_value"] == pytest.approx(0.5 - t / (2 * math.sqrt(2 + t**2)), rel=1e-9)
    assert math.isnan(row["mcnemar_p"])


def test_compare__worse_is_positive_for_rq1_and_better_is_positive_for_rq2():
    calm = [0] * 10, np.linspace(20, 22, 10)
    hurt = [1, 0, 1, 1, 0, 1, 0, 1, 1, 0], np.linspace(15, 19, 10)
    arms = games("naive_alone", *calm), games("naive_vs_speedy", *hurt), games("retrained_vs_speedy", *calm)
    table = compare([RQ1, RQ2], pd.concat(arms), 0.05)
    assert list(zip(table["question"], table["metric"], strict=True)) == [
        ("RQ1", "failure"),
        ("RQ1", "mean_speed"),
        ("RQ2", "failure"),
        ("RQ2", "mean_speed"),
        ("RQ2", "person_failure"),
        ("RQ2", "bystander_failure"),
        ("RQ2", "follower_braking"),
    ]
    asked = table[:4]
    assert asked["mean_difference"].tolist() == pytest.approx([0.6, 4.0, 0.6, 4.0])
    assert asked["rejects_h0"].all()
    assert (table["verdict"][4:] == "not enough pairs").all()


def test_compare__pairs_with_an_error_an_empty_value_or_one_side_only_are_left_out_and_counted():
    baseline = games("naive_alone", [0, 0, 0, 0, 0, 0], speed=[20, 20, np.nan, 20, 20, 20])
    treatment = games("naive_vs_speedy", [1, 0, 1, None, 1, 1], speed=[18, 17, 16, 15, 14, 13])
    treatment.loc[0, "ego_outcome"] = "error"  # its values must not count, whatever they are
    baseline.loc[1, "error"] = "the simulator died"
    treatment.loc[5, "episode"] = 6  # episodes 5 and 6 are in one arm only
    failure, mean_speed = both_metrics(RQ1, baseline, treatment)
    assert (failure["pairs"], failure["pairs_left_out"]) == (2, 5)  # 2 and 4 of 0..6
    assert (mean_speed["pairs"], mean_speed["pairs_left_out"]) == (2, 5)  # 3 and 4
    assert failure["mean_difference"] == 1
    assert mean_speed["mean_difference"] == 5.5


def test_compare__pairs_by_episode_whatever_the_order_of_rows():
    baseline = games("naive_alone", [0, 0, 0, 0], speed=[20, 21, 22, 23])
    treatment = games("naive_vs_speedy", [0, 0, 0, 0], speed=[19, 19, 19, 19])
    in_order = compare([RQ1], pd.concat([baseline, treatment]), 0.01)
    reversed_order = compare([RQ1], pd.concat([baseline, treatment.iloc[::-1]]).reset_index(drop=True), 0.01)
    pd.testing.assert_frame_equal(in_order, reversed_order)


def test_compare__training_seeds_are_not_mixed():
    episodes = pd.concat(
        [
            games("naive_alone", [0, 0, 0]),
            games("naive_vs_speedy", [1, 0, 0]),
            games("naive_alone", [0, 0, 0], seed=2),
            games("naive_vs_speedy", [1, 1, 0], seed=2),
        ]
    )
    table = compare([RQ1, replace(RQ1, seed=2)], episodes, 0.01)
    failures = table[table["metric"] == "failure"]
    assert failures["mean_difference"].tolist() == pytest.approx([1 / 3, 2 / 3])


def test_compare__less_than_two_pairs_are_not_enough():
    for row in both_metrics(RQ1, games("naive_alone", [0, 0, 1])):
        assert (row["pairs"], row["pairs_left_out"]) == (0, 3)
        assert math.isnan(row["mean_difference"])
        assert (row["rejects_h0"], row["verdict"]) == (False, "not enough pairs")
    failure, _ = both_metrics(RQ1, games("naive_alone", [0]), games("naive_vs_speedy", [1]))
    assert (failure["pairs"], failure["mean_difference"]) == (1, 1)
    assert all(math.isnan(failure[column]) for column in ("t", "p_value", "ci_low", "mcnemar_p"))
    assert failure["verdict"] == "not enough pairs"


def test_compare__of_failures_that_differ_alike_in_all_pairs_the_exact_test_counts():
    arms = games("naive_alone", [0] * 10, [20.0] * 10), games("naive_vs_speedy", [1] * 10, [19.0] * 10)
    failure, mean_speed = both_metrics(RQ1, *arms)
    for row in (failure, mean_speed):
        assert row["mean_difference"] == 1
        assert math.isnan(row["t"])
    assert all(same(failure[name], 2.0**-10) for name in ("mcnemar_p", "p_value", "p_holm"))
    assert (failure["rejects_h0"], failure["verdict"]) == (True, "significant")
    assert math.isnan(mean_speed["p_value"])
    assert (mean_speed["rejects_h0"], mean_speed["verdict"]) == (False, "no t statistic: all differences equal")


def test_compare__failures_that_all_go_the_other_way_are_not_significant():
    failure, _ = both_metrics(RQ1, games("naive_alone", [1] * 10), games("naive_vs_speedy", [0] * 10))
    assert (failure["p_value"], failure["verdict"]) == (1.0, "not significant")


def test_compare__rounding_errors_are_no_spread():
    speed = np.random.default_rng(1).uniform(10, 30, 50)
    arms = games("naive_alone", [0] * 50, speed), games("naive_vs_speedy", [0] * 50, speed - 0.1)
    assert np.ptp(speed - (speed - 0.1)) > 0
    _, row = both_metrics(RQ1, *arms)
    assert math.isnan(row["t"])
    assert row["verdict"] == "no t statistic: all differences equal"


def test_compare__verdict_says_when_only_the_uncorrected_p_value_is_significant():
    arms = games("naive_alone", [0] * 40), games("naive_vs_speedy", [1, 1, 1] + [0] * 37)
    failure = compare([RQ1], pd.concat(arms), 0.05, planned=2).to_dict("records")[0]
    assert 0.025 < failure["p_value"] < 0.05
    assert same(failure["p_holm"], 2 * failure["p_value"])
    assert (failure["rejects_h0"], failure["verdict"]) == (True, "significant before Holm's correction only")
    alone = compare([RQ1], pd.concat(arms), 0.05, planned=1).to_dict("records")[0]
    assert (alone["p_holm"], alone["verdict"]) == (alone["p_value"], "significant")


def test_compare__tests_of_speed_are_secondary_and_not_corrected():
    random = np.random.default_rng(5)
    arms = games("naive_alone", [0] * 40, 20 + random.random(40)), games("naive_vs_speedy", [0] * 40, [15.0] * 40)
    failure, speed = both_metrics(RQ1, *arms)
    assert (failure["planned_tests"], failure["verdict"]) == (1, "no difference")
    assert speed["p_value"] < 1e-6
    assert speed["rejects_h0"]
    assert pd.isna(speed["planned_tests"])
    assert math.isnan(speed["p_holm"])
    assert speed["verdict"] == "significant without correction (secondary test)"


def test_compare__holm_is_over_all_planned_questions_whatever_comes_of_them():
    """Of four planned questions one shows no difference, and one is not played at all."""
    failing = {1: 12, 2: 8, 3: 0}
    episodes = pd.concat(
        games(arm, [1] * count + [0] * (20 - count), seed=seed)
        for seed, failures in failing.items()
        for arm, count in (("naive_alone", 0), ("naive_vs_speedy", failures))
    )
    questions = [replace(RQ1, seed=seed) for seed in failing]
    table = compare(questions, episodes, 0.05, planned=4)
    first, second, none = table[table["metric"] == "failure"].to_dict("records")
    assert same(first["p_holm"], 4 * first["p_value"])
    assert same(second["p_holm"], 3 * second["p_value"])
    assert (none["verdict"], none["planned_tests"]) == ("no difference", 4)
    assert math.isnan(none["p_holm"])
    assert set(table["about"]) == {"this trained pair"}


def test_compare__harm_to_others_is_what_grows_and_a_family_of_its_own():
    # of 100 persons 2 fail beside the naive ego, and 22 beside the retrained one: 20 pairs differ, all to the worse
    naive = games(RQ2.baseline, [1] * 30 + [0] * 70, person=[1] * 2 + [0] * 98, braking=[2.0, np.nan] * 50)
    retrained = games(RQ2.treatment, [0] * 100, person=[1] * 22 + [0] * 78, braking=[3.0, 1.0] * 50)
    table = compare([RQ2], pd.concat([naive, retrained]), 0.01).set_index("metric")
    person, braking, failure = (table.loc[name] for name in ("person_failure", "follower_braking", "failure"))
    assert (person["pairs"], person["mean_difference"]) == (100, pytest.approx(0.2))
    assert person["mcnemar_p"] == pytest.approx(0.5**20)
    # mean 0.2, variance (20 * 0.8**2 + 80 * 0.2**2) / 99 = 16 / 99, t = 0.2 / sqrt(16 / 9900) = 4.975
    assert person["t"] == pytest.approx(0.2 / math.sqrt(16 / 9900))
    assert person["verdict"] == "significant"
    # three tests of harm, of which one could be made; and one planned test
    assert (person["p_holm"], failure["p_holm"]) == (pytest.approx(3 * person["p_value"]), failure["p_value"])
    # games without a follower are left out; where it is, it brakes harder by 1 m/s2 each time
    assert (braking["pairs"], braking["pairs_left_out"], braking["mean_difference"]) == (50, 50, 1.0)
    assert braking["verdict"] == "no t statistic: all differences equal"
    assert math.isnan(braking["mcnemar_p"])


def test_compare__refuses_two_games_of_one_episode():
    with pytest.raises(ValueError, match="more than once"):
        compare([RQ1], pd.concat([games("naive_alone", [0]), games("naive_alone", [1])]), 0.01)


@given(
    failed=st.lists(st.sampled_from([0, 1, None]), min_size=1, max_size=20),
    speeds=st.lists(st.floats(0, 60) | st.just(math.nan), min_size=20, max_size=20),
    significance=st.floats(0.001, 0.999),
)
@settings(max_examples=50, deadline=None)
def test_compare__an_arm_against_itself_rejects_nothing(failed, speeds, significance):
    itself = [replace(each, baseline="naive_vs_speedy", treatment="naive_vs_speedy") for each in (RQ1, RQ2)]
    table = compare(itself, games("naive_vs_speedy", failed, speeds[: len(failed)]), significance)
    assert not table["rejects_h0"].any()
    assert set(table["verdict"]) <= {Verdict.NO_DIFFERENCE.value, Verdict.NOT_ENOUGH_PAIRS.value}
    assert (table["pairs"] + table["pairs_left_out"] == len(failed)).all()


def test_compare__rejects_random_arms_without_a_difference_at_the_rate_of_significance():
    random = np.random.default_rng(2024)
    campaigns, count = 600, 60
    arms = []
    for k in range(campaigns):
        start = random.normal(20, 2, count)  # the pair's common start, so that pairs correlate
        for arm in (RQ1.baseline, RQ1.treatment):
            arms.append(games(arm, random.random(count) < 0.2, start + random.normal(0, 1, count), seed=k))
    table = compare([replace(RQ1, seed=k) for k in range(campaigns)], pd.concat(arms), 0.05)
    assert table["planned_tests"].dropna().eq(campaigns).all()
    three_deviations = 3 * math.sqrt(0.05 * 0.95 / campaigns)
    assert table.groupby("metric")["rejects_h0"].mean().max() < 0.05 + three_deviations
    assert (table["p_holm"] < 0.05).sum() == 0
    # a campaign of the paper has 8 tests: at least one false one in at most 5 % of campaigns
    families = table["p_value"].to_numpy().reshape(-1, 8)
    assert np.mean([holm(family).min() < 0.05 for family in families]) < 0.05 + 3 * math.sqrt(
        0.05 * 0.95 / len(families)
    )


@pytest.mark.parametrize(
    ("p_values", "adjusted"),
    [
        # ascending: 0.005 * 4 = 0.02; 0.01 * 3 = 0.03; 0.03 * 2 = 0.06; 0.04 * 1 = 0.04 -> 0.06, it may not fall
        ([0.01, 0.04, 0.03, 0.005], [0.03, 0.06, 0.06, 0.02]),
        # the test that could not be made has p = 1: ascending 0.02 * 3 = 0.06; 0.04 * 2 = 0.08
        ([0.04, math.nan, 0.02], [0.08, math.nan, 0.06]),
        ([0.5, 0.5, 0.5], [1, 1, 1]),
        ([math.nan, math.nan], [math.nan, math.nan]),
        ([], []),
    ],
)
def test_holm__agrees_with_the_arithmetic_on_paper(p_values, adjusted):
    assert holm(np.array(p_values)).tolist() == pytest.approx(adjusted, nan_ok=True)


def test_holm__counts_planned_tests_that_are_absent():
    # 5 planned, 2 made, 1 without a p-value: 0.01 * 5 = 0.05; 0.02 * 4 = 0.08
    assert holm(np.array([0.02, math.nan, 0.01]), 5).tolist() == pytest.approx([0.08, math.nan, 0.05], nan_ok=True)
    assert holm(np.array([0.01]), 1).tolist() == [0.01]


@given(p_value_lists, st.integers(0, 10))
def test_holm__a_test_that_could_not_be_made_is_one_with_p_1(p_values, absent):
    p = np.array([*p_values, *[math.nan] * absent], dtype=float)
    made = ~np.isnan(p)
    np.testing.assert_array_equal(holm(p)[made], holm(np.where(made, p, 1.0))[made])
    np.testing.assert_array_equal(holm(p[made], len(p)), holm(p)[made])


@given(p_value_lists)
def test_holm__is_at_least_the_p_value_and_at_most_one_and_keeps_the_order(p_values):
    p = np.array(p_values, dtype=float)
    adjusted = holm(p)
    tested = ~np.isnan(p)
    assert (np.isnan(adjusted) == ~tested).all()
    assert (adjusted[tested] >= p[tested]).all()
    assert (adjusted[tested] <= 1).all()
    assert (np.diff(adjusted[tested][np.argsort(p[tested])]) >= 0).all()


@given(p_value_lists.flatmap(lambda p: st.tuples(st.just(p), st.permutations(range(len(p))))))
def test_holm__does_not_depend_on_the_order_of_the_tests(p_values_and_order):
    p, order = np.array(p_values_and_order[0], dtype=float), list(p_values_and_order[1])
    np.testing.assert_array_equal(holm(p[order]), holm(p)[order])
