from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from harness.evaluation.columns import TABLES
from harness.evaluation.competence import AloneBound
from harness.evaluation.game_theory.best_response_gap import OWN, Response, gaps, nothing_to_gain
from harness.evaluation.gap_verdict import GapVerdict
from tests.support.game_tables import arm, table

EGO = Response(
    seed=1,
    role="ego",
    persona="speedy",
    round=2,
    pair_arm="pair",
    response_arm="best_ego",
    ego="retrained_speedy",
    non_ego="speedy",
    search_steps=600_000,
    search_starts=2,
)
NON_EGO = replace(EGO, role="non_ego", response_arm="best_non_ego")


def one(response, *arms, significance=0.01):
    (row,) = gaps([response], table(*arms), significance).to_dict("records")
    return row


def test_gap__agrees_with_the_arithmetic_on_paper():
    # the ego's payoffs 10, 12, 8, 10 (mean 10) become 11, 15, 10, 12: differences 1, 3, 2, 2, mean 2, variance 2/3
    pair = arm("pair", ego_failed=[0, 0, 1, 0], ego_payoff=[10, 12, 8, 10])
    best = arm("best_ego", ego_failed=[0, 0, 0, 0], ego_payoff=[11, 15, 10, 12])
    row = one(EGO, pair, best)
    assert (row["pairs"], row["pairs_left_out"]) == (4, 0)
    assert (row["payoff"], row["payoff_best_response"], row["gap"], row["gap_share"]) == (10, 12, 2, 0.2)
    # Student's t with 3 degrees of freedom: 97.5 % quantile 3.182446
    half = 3.182446 * math.sqrt(2 / 3) / 2
    assert (row["ci_low"], row["ci_high"]) == (pytest.approx(2 - half, abs=1e-5), pytest.approx(2 + half, abs=1e-5))
    assert row["p_value"] == pytest.approx(float(stats.t.sf(2 / (math.sqrt(2 / 3) / 2), 3)))
    assert row["p_holm"] == row["p_value"]
    assert (row["ego_failure_rate"], row["ego_failure_rate_best_response"]) == (0.25, 0)
    assert row["failure_difference"] == -0.25


def test_gap__of_the_non_ego_has_its_own_payoff_and_the_egos_failures():
    games = 40
    pair = arm("pair", ego_failed=[1] + [0] * (games - 1), non_ego_payoff=np.linspace(9, 11, games))
    best = arm("best_non_ego", ego_failed=[1] * 10 + [0] * (games - 10), non_ego_payoff=np.linspace(9, 11, games) * 1.3)
    row = one(NON_EGO, pair, best)
    assert row["gap"] == pytest.approx(3)
    assert row["gap_share"] == pytest.approx(0.3)
    assert row["verdict"] == GapVerdict.DISTINGUISHABLE.value
    assert (row["ego_failure_rate"], row["ego_failure_rate_best_response"]) == (0.025, 0.25)
    assert row["ego_failure_rate_best_response_low"] < 0.25 < row["ego_failure_rate_best_response_high"]
    assert row["failure_difference"] == pytest.approx(9 / 40)
    assert row["failure_difference_low"] < 9 / 40 < row["failure_difference_high"]


def test_gap__is_a_share_of_the_payoffs_size_also_where_the_payoff_is_negative_or_zero():
    pair = arm("pair", ego_failed=[0, 0], ego_payoff=[-10, -10])
    best = arm("best_ego", ego_failed=[0, 0], ego_payoff=[-9, -8])
    assert one(EGO, pair, best)["gap_share"] == pytest.approx(0.15)
    nothing = arm("pair", ego_failed=[0, 0], ego_payoff=[-1, 1])
    assert math.isnan(one(EGO, nothing, best)["gap_share"])


@pytest.mark.parametrize(
    ("better_by", "verdict"),
    [
        ([3.0, 2.9, 3.1, 3.0, 3.05, 2.95], GapVerdict.DISTINGUISHABLE),
        ([3.0, 2.0, -1.0, -0.5, 1.0, 0.5], GapVerdict.NOT_DISTINGUISHABLE),
        ([3.0, -2.9, 3.1, -3.0, 3.05, -2.95], GapVerdict.NONE_FOUND),
        ([-3.0, -2.9, -3.1, -3.0, -3.05, -2.95], GapVerdict.LACKS_POWER),
        ([1.0, -1.0, 2.0, -2.0, 3.0, -3.0], GapVerdict.NONE_FOUND),
        ([0.0] * 6, GapVerdict.NO_DIFFERENCE),
        ([2.0] * 6, GapVerdict.ALL_EQUAL),
        ([-2.0] * 6, GapVerdict.LACKS_POWER),
        ([2.0], GapVerdict.NOT_ENOUGH_PAIRS),
    ],
)
def test_verdict__of_each_gain(better_by, verdict):
    count = len(better_by)
    payoffs = np.arange(1.0, count + 1)
    pair = arm("pair", ego_failed=[0] * count, ego_payoff=payoffs)
    best = arm("best_ego", ego_failed=[0] * count, ego_payoff=payoffs + better_by)
    row = one(EGO, pair, best)
    assert row["verdict"] == verdict.value
    if verdict in (GapVerdict.NO_DIFFERENCE, GapVerdict.ALL_EQUAL) or len(set(better_by)) == 1:
        assert all(math.isnan(row[name]) for name in ("p_value", "p_holm", "ci_low", "ci_high"))


def test_verdict__before_holm_only_where_the_table_has_many_gaps():
    count = 12
    payoffs = np.linspace(9, 11, count)
    better = payoffs + 1 + np.tile([-0.975, 0.975], count // 2)  # t = sqrt(11) / 0.975 = 3.4, p = 0.003
    arms = [arm("pair", ego_failed=[0] * count, ego_payoff=payoffs)]
    arms += [arm("best_ego", ego_failed=[0] * count, ego_payoff=better)]
    alone = gaps([EGO], table(*arms), 0.01)
    assert alone["verdict"].tolist() == [GapVerdict.DISTINGUISHABLE.value]
    many = gaps([EGO] * 20, table(*arms), 0.01)
    assert set(many["verdict"]) == {GapVerdict.BEFORE_HOLM_ONLY.value}
    assert many["p_holm"].tolist() == pytest.approx([20 * alone["p_value"][0]] * 20)


def test_pairs__an_arm_that_was_never_played_leaves_every_number_empty():
    row = one(EGO, arm("pair", ego_failed=[0, 0]))
    assert (row["pairs"], row["pairs_left_out"]) == (0, 2)
    assert row["verdict"] == GapVerdict.NOT_ENOUGH_PAIRS.value
    assert all(
        math.isnan(row[name]) for name, column in TABLES["gaps"].items() if column.dtype == "float64"
    )  # never 0, and no failure rate


# --- the best known strategy ---


def earning(name, *payoffs, failed=()):
    """Games of the ego, which fails in the first ones as `failed` says."""
    return arm(name, ego_failed=[*failed, *[0] * (len(payoffs) - len(failed))], ego_payoff=payoffs)


KNOWN = replace(EGO, known_arms={"robust": "robust_vs_speedy"})


def test_best_known__a_known_strategy_bounds_the_gap_that_the_search_missed():
    # the search earns 1, 3, 2, 2 more (mean 2), the robust ego 3, 4, 4, 3 more: mean 3.5, variance 1/3. In the even
    # episodes these are means of 1.5 and 3.5, in the odd ones of 2.5 and 3.5: robust is taken in both halves
    pair, search = earning("pair", 10, 12, 8, 10), earning("best_ego", 11, 15, 10, 12)
    row = one(KNOWN, pair, search, earning("robust_vs_speedy", 13, 16, 12, 13, failed=[1]))
    assert (row["best_known"], row["known"], row["pairs"]) == ("robust", 1, 4)
    assert (row["search_steps"], row["search_starts"]) == (600_000, 2)
    assert (row["payoff_best_response"], row["gap"], row["gap_share"]) == (13.5, 3.5, 0.35)
    half = 3.182446 * math.sqrt(1 / 3) / 2  # 97.5 % quantile of t with 3 degrees of freedom
    assert (row["ci_low"], row["ci_high"]) == (pytest.approx(3.5 - half, abs=1e-5), pytest.approx(3.5 + half, abs=1e-5))
    half = 3.182446 * math.sqrt(2 / 3) / 2
    assert row["search_gap"] == 2
    assert row["search_gap_low"] == pytest.approx(2 - half, abs=1e-5)
    assert row["search_gap_high"] == pytest.approx(2 + half, abs=1e-5)
    assert row["ego_failure_rate_best_response"] == 0.25  # that of the robust ego


def test_best_known__each_half_of_the_games_takes_what_is_best_in_the_other_half():
    # even episodes: the search earns 11, the robust ego 13 on average; odd episodes: 11 and 8. So the odd games take
    # the robust ego, the even ones the search: 11, 8, 11, 8
    pair, search = earning("pair", 10, 10, 10, 10), earning("best_ego", 11, 11, 11, 11)
    row = one(KNOWN, pair, search, earning("robust_vs_speedy", 14, 8, 12, 8))
    assert row["best_known"] == "the search + robust"
    assert (row["payoff_best_response"], row["gap"], row["search_gap"]) == (9.5, -0.5, 1)


def test_best_known__a_player_keeps_its_own_strategy_where_nothing_earned_more():
    # the search earns 1 less in the mean of the even games and 2 less in that of the odd ones, the robust ego the same
    # as the player: of equal ones its own strategy comes first
    pair, search = earning("pair", 10, 12, 8, 10), earning("best_ego", 11, 9, 5, 9, failed=[1, 1])
    row = one(KNOWN, pair, search, earning("robust_vs_speedy", 8, 10, 10, 12))
    assert (row["best_known"], row["gap"], row["payoff_best_response"]) == ("its own strategy", 0, row["payoff"])
    assert (row["search_gap"], row["verdict"]) == (-1.5, GapVerdict.NONE_FOUND.value)
    assert row["ego_failure_rate_best_response"] == row["ego_failure_rate"] == 0


def test_best_known__of_equal_ones_it_is_the_search():
    pair, search = earning("pair", 1, 2, 3, 4), earning("best_ego", 3, 2, 4, 5)
    row = one(KNOWN, pair, search, earning("robust_vs_speedy", 4, 5, 3, 2))
    assert (row["best_known"], row["known"]) == ("the search", 1)


def test_best_known__the_choice_does_not_raise_the_gap_of_strategies_that_are_all_alike():
    random, seeds, names = np.random.default_rng(1), range(1, 41), ["best_ego", *"abcdef"]
    played = {seed: {name: random.normal(10, 1, 20) for name in ["pair", *names]} for seed in seeds}
    arms = [arm(name, seed, [0] * 20, payoffs) for seed, of_seed in played.items() for name, payoffs in of_seed.items()]
    asked = [replace(EGO, seed=seed, known_arms={name: name for name in "abcdef"}) for seed in seeds]
    largest = [max(of_seed[name].mean() for name in names) - of_seed["pair"].mean() for of_seed in played.values()]
    assert np.mean(largest) > 0.2
    assert abs(gaps(asked, table(*arms), 0.01)["gap"].mean()) < 0.1  # standard error: sqrt(2 / 20 / 40) = 0.05


def test_best_known__only_games_count_that_every_response_played():
    pair, search = earning("pair", *[10.0] * 6), arm("best_ego", ego_failed=[None, *[0] * 5], ego_payoff=[11.0] * 6)
    robust = arm("robust_vs_speedy", ego_failed=[*[0] * 5, None], ego_payoff=[12.0] * 6)
    row = one(KNOWN, pair, search, robust)
    assert (row["pairs"], row["pairs_left_out"], row["gap"]) == (4, 2, 2)


@pytest.mark.parametrize(
    "robust",
    [
        [],  # the arm is not there
        [arm("robust_vs_speedy", ego_failed=[None] * 6)],
        [arm("robust_vs_speedy", ego_failed=[0] * 3, ego_payoff=[20.0] * 3)],  # of the odd episodes only one
    ],
)
def test_best_known__a_strategy_with_too_few_games_leaves_the_search_alone(robust):
    pair, search = earning("pair", *[10.0] * 6), earning("best_ego", *[11.0] * 6)
    row = one(KNOWN, pair, search, *robust)
    assert (row["best_known"], row["known"], row["pairs"], row["pairs_left_out"]) == ("the search", 0, 6, 0)
    assert row["gap"] == 1


def test_lacks_power__of_a_search_below_its_own_strategy_unless_a_gain_is_known():
    payoffs = np.arange(10.0, 16.0)
    pair, search = (
        earning("pair", *payoffs),
        earning("best_ego", *(payoffs - np.array([3.0, 2.9, 3.1, 3.0, 3.05, 2.95]))),
    )
    below = one(KNOWN, pair, search, earning("robust_vs_speedy", *payoffs))  # exactly as good as the player
    assert (below["verdict"], below["best_known"], below["gap"]) == (GapVerdict.LACKS_POWER.value, OWN, 0)
    assert below["search_gap"] == pytest.approx(-3)
    better = earning("robust_vs_speedy", *(payoffs + np.array([1.0, 1.1, 0.9, 1.05, 0.95, 1.0])))
    assert one(KNOWN, pair, search, better)["verdict"] == GapVerdict.DISTINGUISHABLE.value


# --- when rounds stop ---


def stopping(ego_gain, non_ego_gain, games=30):
    random = np.random.default_rng(2)
    noise = random.normal(0, 1, games)
    pair = arm("pair", ego_failed=[0] * games)
    best_ego = arm("best_ego", ego_failed=[0] * games, ego_payoff=10 + noise + ego_gain)
    best_non_ego = arm("best_non_ego", ego_failed=[0] * games, non_ego_payoff=20 + noise + non_ego_gain)
    return gaps([EGO, NON_EGO], table(pair, best_ego, best_non_ego), 0.01)


@pytest.mark.parametrize(
    ("ego_gain", "non_ego_gain", "nothing"),
    [(0, 0, True), (-0.3, 0, True), (-2, 0, False), (0, -2, False), (2, 0, False), (0, 2, False)],
)
def test_nothing_to_gain__if_neither_gap_is_distinguishable_from_0_after_searches_with_power(
    ego_gain, non_ego_gain, nothing
):
    assert nothing_to_gain(stopping(ego_gain, non_ego_gain)) == nothing


def test_nothing_to_gain__not_without_a_response_or_a_measurement_of_each_side():
    both = stopping(0, 0)
    assert not nothing_to_gain(both[both["role"] == "ego"])
    assert not nothing_to_gain(both[:0])
    assert not nothing_to_gain(gaps([EGO, NON_EGO], table(arm("pair", ego_failed=[0, 0])), 0.01))


# --- pairs that were not shown to drive ------------------------------------------------------


ALONE = (AloneBound(player="ego", words="the retrained ego", arm="retrained_alone_speedy", goal_share=0.97),)


@pytest.mark.parametrize("gain", [5.0, -5.0])
def test_gap__of_a_pair_that_cannot_drive_is_no_answer(gain):
    """Neither "could gain" nor "nothing better was found": no training of such a pair shows anything."""
    payoffs = np.linspace(9, 11, 40)
    pair = arm("pair", ego_failed=[0] * 40)
    best = arm("best_ego", ego_failed=[0] * 40, ego_payoff=payoffs + gain)
    alone = arm("retrained_alone_speedy", ego_failed=[0] * 38 + [1] * 2)
    row = one(replace(EGO, alone=ALONE), pair, best, alone)
    assert row["verdict"] == GapVerdict.NOT_ANSWERED.value
    assert row["reason"] == (
        "the retrained ego can't drive this scene: alone it reaches its goal in 38 of 40 games (95 %), below 97 %"
    )
    assert row["gap"] == pytest.approx(max(gain, 0.0))
    assert all(math.isnan(row[name]) for name in ("ci_low", "ci_high", "p_value", "p_holm"))
    assert not nothing_to_gain(gaps([replace(EGO, alone=ALONE), NON_EGO], table(pair, best, alone), 0.01))
