"""The sentences on gaps of the report and the terminal match the rows of the table."""

from __future__ import annotations

from dataclasses import replace

import pandas as pd
import pytest

from harness.evaluation.game_theory.best_response_gap import Response, gaps
from harness.evaluation.gap_verdict import GapVerdict
from harness.reports.game import MEANINGS, NEAR, NO, OPEN, gap_verdicts
from tests.support.game_tables import arm, table
from tests.support.pages import plain

EGO, NON_EGO = (
    Response(
        seed=1,
        role=role,
        persona="speedy",
        round=3,
        pair_arm="pair",
        response_arm=f"best_{role}",
        ego="retrained_speedy",
        non_ego="speedy",
        search_steps=600_000,
        search_starts=2,
    )
    for role in ("ego", "non_ego")
)


def verdict_texts(ego_gain, non_ego_gain, responses=(EGO, NON_EGO), failing=0, games=100):
    """The verdict on a pair of which the ego earns 10, the speedy driver 20; gains alternate a little around a mean."""
    wave = [0.01 * (-1) ** place for place in range(games)]

    def arm_of(name, ego=0.0, non_ego=0.0, failed=0):
        sides = (
            [10 + (each + ego if ego else 0) for each in wave],
            [20 + (each + non_ego if non_ego else 0) for each in wave],
        )
        return arm(name, 1, [1] * failed + [0] * (games - failed), *sides)

    episodes = table(
        arm_of("pair", failed=3), arm_of("best_ego", ego_gain), arm_of("best_non_ego", 0, non_ego_gain, failing)
    )
    ((persona, verdict),) = gap_verdicts(gaps(responses, episodes, 0.01))
    assert persona == "speedy"
    return verdict.label, plain(verdict.sentence), plain(verdict.speed), verdict.tone


FAILS = "A speedy driver newly trained against this ego makes it fail in 12 of 100 games (12 %; 95 %: 6.4–20 %) instead"


@pytest.mark.parametrize(
    ("gains", "given", "label", "sentence", "induced", "tone"),
    [
        (
            (0.2, 6.2),
            {"failing": 12},
            "no",
            f"The ego could still gain 2 % of its payoff; the speedy driver 31 %: {MEANINGS[NO]}.",
            f"{FAILS} of 3.",
            "harm",
        ),
        (
            (-0.2, -0.4),
            {"failing": 12},
            "not decided",
            "The search for the ego lacks power: 600,000 steps from 2 starts end 2 % below its own strategy; "
            "the search for the speedy driver lacks power: 600,000 steps from 2 starts end 2 % below its own strategy: "
            f"{MEANINGS[OPEN]}.",
            "Nothing is known by which a speedy driver earns more against this ego than it does.",
            "open",  # the ego fails more against what the search found, which a selfish driver does not play
        ),
        (
            (-0.0005, -0.0005),
            {},
            "not refuted",
            "600,000 steps from 2 starts found nothing better for the ego; "
            f"600,000 steps from 2 starts found nothing better for the speedy driver: {MEANINGS[NEAR]}.",
            # in one half of the games the search earned more, so that it is taken in the other half
            "A speedy driver newly trained against this ego makes it fail in 2 of 100 games (2 %; 95 %: 0.2–7 %) "
            "instead of 3, but this driver does not earn more by it.",
            "open",
        ),
        (
            (-0.0005, 0),
            {"responses": (EGO,)},
            "not decided",
            "600,000 steps from 2 starts found nothing better for the ego; "
            f"no best response of the speedy driver was trained: {MEANINGS[OPEN]}.",
            "",
            "open",
        ),
    ],
)
def test_words__of_gains(gains, given, label, sentence, induced, tone):
    assert verdict_texts(*gains, **given) == (label, sentence, induced, tone)


def test_words__a_gain_not_distinguishable_from_0_has_its_interval():
    row = gaps([EGO, NON_EGO], table(arm("pair", ego_failed=[0, 0])), 0.01)
    row = row.assign(verdict=GapVerdict.NOT_DISTINGUISHABLE.value, payoff=-20.0, gap=6.0, gap_share=0.3)
    ((_, answer),) = gap_verdicts(row.assign(ci_low=-1.0, ci_high=13.0))
    assert answer.tone == "open"  # nothing is shown, neither way
    assert plain(answer.sentence).startswith(
        "After 600,000 steps from 2 starts a gain of 30 % was measured for the ego, which is not distinguishable from "
        "0 (95 %: −5 to 65 %); after 600,000 steps"
    )
    ((_, answer),) = gap_verdicts(row.assign(best_known="robust"))
    assert "a gain of 30 % by playing robust was measured for the ego" in plain(answer.sentence)


def with_robust(ego_gain, robust_gain, known=("robust",)):
    """The sentence on the ego alone, which earns 10; the search and the known strategies gain in alternation a little
    more and a little less than given."""
    wave = [0.01 * (-1) ** (place // 2) for place in range(100)]
    played = {"best_ego": ego_gain, **dict.fromkeys(known, robust_gain)}
    arms = [arm(name, 1, [0] * 100, [10 + gain + each for each in wave]) for name, gain in played.items()]
    asked = replace(EGO, known_arms={name: name for name in known})
    ((_, answer),) = gap_verdicts(gaps([asked], table(arm("pair", 1, [0] * 100, [10.0] * 100), *arms), 0.01))
    return plain(answer.sentence).partition("; no best response of")[0]


def test_words__name_the_known_strategy_by_which_a_player_could_gain():
    assert with_robust(0.1, 0.5) == "The ego could still gain 5 % of its payoff by playing robust"
    assert with_robust(0.5, 0.1) == "The ego could still gain 5 % of its payoff"


def test_words__count_the_known_strategies_that_earn_no_more():
    nothing = "600,000 steps from 2 starts found nothing better for the ego"
    assert with_robust(-0.001, -1) == f"{nothing}, nor does 1 other strategy of this campaign earn more"
    several = ("naive", "robust", "adas")
    assert with_robust(-0.001, -1, several) == f"{nothing}, nor do 3 other strategies of this campaign earn more"


def test_words__a_search_below_its_own_strategy_lacks_power_and_is_never_beside_a_not_refuted():
    assert with_robust(-1.34, -2) == (
        "The search for the ego lacks power: 600,000 steps from 2 starts end 13.4 % below its own strategy"
    )
    assert "end 0.03 % below its own" in with_robust(-0.003, -2)
    found = gaps([EGO, NON_EGO], table(arm("pair", ego_failed=[0, 0])), 0.01)
    found = pd.concat([found.assign(seed=seed, verdict=GapVerdict.NONE_FOUND.value) for seed in (1, 2, 3)])
    ((_, answer),) = gap_verdicts(found)
    assert answer.label == "not refuted in 3 of 3 seeds"
    found.iloc[-1, found.columns.get_loc("verdict")] = GapVerdict.LACKS_POWER.value
    ((_, answer),) = gap_verdicts(found)
    assert answer.label == "not decided"
    assert answer.sentence.startswith("In 2 of 3 seeds no gain")


@pytest.mark.parametrize(
    ("robust", "sentence"),
    [
        (
            [12.0, 10.5] * 2,  # over 10, the odd games gain 0.5 by robust and the even ones 1 by the search
            "The ego could still gain 7.5 % of its payoff by playing the newly trained strategy or robust;",
        ),
        (
            [14.0, 8.0] * 2,  # the odd games lose 2, the even ones gain 1; the search alone gains 1 in all
            "For the ego the best of 600,000 steps from 2 starts and 1 other strategy of this campaign earns no more "
            "in games that did not choose it;",
        ),
    ],
)
def test_words__of_halves_that_took_different_strategies(robust, sentence):
    pair, search = arm("pair", ego_failed=[0] * 4), arm("best_ego", ego_failed=[0] * 4, ego_payoff=[11.0] * 4)
    played = table(pair, search, arm("robust", ego_failed=[0] * 4, ego_payoff=robust))
    ((_, answer),) = gap_verdicts(gaps([replace(EGO, known_arms={"robust": "robust"})], played, 0.01))
    assert plain(answer.sentence).startswith(sentence)


def test_words__failures_by_a_known_strategy_are_not_those_of_a_new_training():
    games = [0] * 4
    arms = [arm("pair", ego_failed=games), arm("best_non_ego", ego_failed=games)]
    arms += [arm("speedy_round3", ego_failed=[1, 1, 0, 0], non_ego_payoff=[22.0, 23.0, 22.0, 23.0])]
    asked = replace(NON_EGO, known_arms={"speedy_round3": "speedy_round3"})
    ((_, answer),) = gap_verdicts(gaps([asked], table(*arms), 0.01))
    assert plain(answer.speed).startswith("A speedy driver with its best known response makes this ego fail in 2 of 4")


@pytest.mark.parametrize("verdict", list(GapVerdict))
def test_words__state_a_gain_only_where_it_is_distinguishable_from_0(verdict):
    row = gaps([EGO, NON_EGO], table(arm("pair", ego_failed=[0, 0])), 0.01)
    reason = "the speedy driver can't drive this scene" if verdict is GapVerdict.NOT_ANSWERED else ""
    row = row.assign(verdict=verdict.value, gap_share=0.1, gap=1.0, p_holm=0.2, reason=reason)
    ((_, answer),) = gap_verdicts(row)
    assert ("could still gain" in answer.sentence) == (verdict is GapVerdict.DISTINGUISHABLE)
    assert (answer.label == "no") == (verdict is GapVerdict.DISTINGUISHABLE)
    assert answer.sentence.endswith(".") or "left out" in answer.sentence


def test_words__games_that_could_not_be_compared_are_counted_not_rated():
    episodes = table(arm("pair", ego_failed=[0, 0]), arm("best_ego", ego_failed=[None, 0]))
    ((_, verdict),) = gap_verdicts(gaps([EGO, NON_EGO], episodes, 0.01))
    assert verdict.label == "not decided"
    assert "1 of 2 pairs is left out: not played or not measured." in verdict.sentence
    assert verdict.speed == "The effect of a speedy driver newly trained against this ego was not measured."
    assert "%" not in verdict.sentence
