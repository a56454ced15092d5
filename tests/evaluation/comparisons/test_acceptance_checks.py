"""Acceptance: which ego is judged, by which numbers, and when a bound is kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import pandas as pd
import pytest

from harness.evaluation.comparisons.acceptance_checks import (
    Evidence,
    judge,
    judged_ego,
    worst_of_each,
)
from harness.evaluation.comparisons.summary import summarise
from harness.evaluation.gap_verdict import GapVerdict
from harness.evaluation.strategies import (
    NAIVE_ALONE,
    Arm,
    Borrowed,
    NaiveEgo,
    PersonaNonEgo,
    RetrainedEgo,
    RobustEgo,
    against_persona,
)
from harness.evaluation.tables import table_of
from harness.reports.acceptance_wording import TITLES, sentence
from harness.reports.numbers import NO_SPACE
from tests.support.game_tables import arm, table

RETRAINED = RetrainedEgo(against="speedy")
NAIVE_VS, RETRAINED_VS = against_persona(NaiveEgo(), "speedy"), against_persona(RETRAINED, "speedy")
ALONE = Arm(ego=RETRAINED)


def evidence(games: Mapping[Arm, Sequence[int]], speeds: Mapping[Arm, float] | None = None) -> Evidence:
    """A run of one persona with these games: 1 is a failure."""
    rows = [
        arm(each.name, ego_failed=failed, persona="speedy", speed=(speeds or {}).get(each, 13.0))
        for each, failed in games.items()
    ]
    episodes = table(*rows)
    return Evidence(
        arms={each.name: each for each in games},
        episodes=episodes,
        summary=summarise(episodes),
        comparisons=table_of("comparisons"),
        gaps=table_of("gaps"),
    )


def hundred(failures: int) -> list[int]:
    return [1] * failures + [0] * (100 - failures)


def test_bound__of_players_that_cannot_drive_the_scene_is_not_kept() -> None:
    run = evidence({NAIVE_VS: hundred(0), RETRAINED_VS: hundred(0)})
    asked = pd.DataFrame({"persona": ["speedy", "calm"], "seed": [1, 1], "reason": ["speedy can't drive it", ""]})
    run = replace(run, comparisons=asked)
    (check,) = judge({"failure_rate": 0.5}, "last", ["speedy"], [1], run)
    assert (check.measured, check.passed, check.detail) == (False, False, "speedy can't drive it")
    assert run.unanswered("calm", 1) == ""


def test_failure_rate__covers_opponents_of_later_rounds() -> None:
    later = Arm(ego=RETRAINED, non_ego=PersonaNonEgo(persona="speedy", round=3))
    run = evidence({RETRAINED_VS: hundred(0), later: hundred(45)})
    checks = judge({"failure_rate": 0.1}, "last", ["speedy"], [1], run)
    assert [(check.arm, check.passed) for check in checks] == [(RETRAINED_VS.name, True), (later.name, False)]
    assert [check.arm for check in worst_of_each(checks)] == [later.name]


@pytest.mark.parametrize("bound", TITLES)
def test_bound__that_was_not_measured_is_not_kept(bound: str) -> None:
    run = evidence({NAIVE_ALONE: hundred(0)})
    run = replace(run, arms=run.arms | {RETRAINED_VS.name: RETRAINED_VS})
    (check,) = judge({bound: 1.0}, "last", ["speedy"], [1], run)
    assert (check.measured, check.passed) == (False, False)


def test_failure_rate__is_not_that_against_a_person_with_another_persons_trait() -> None:
    person = PersonaNonEgo(persona="speedy", borrowed=Borrowed(trait="reaction", of="careful"))
    run = evidence({NAIVE_VS: hundred(0), Arm(ego=NaiveEgo(), non_ego=person): hundred(90)})
    (check,) = judge({"failure_rate": 0.1}, "naive", ["speedy"], [1], run)
    assert (check.arm, check.passed) == (NAIVE_VS.name, True)


def test_judged_ego__is_that_of_the_last_round_that_was_played() -> None:
    later = Arm(ego=RetrainedEgo(against="speedy", round=4), non_ego=PersonaNonEgo(persona="speedy", round=3))
    played = evidence({NAIVE_VS: [0], RETRAINED_VS: [0], later: [0]})
    settled = replace(played, summary=played.summary[:2])
    assert judged_ego("last", "speedy", 1, played) == RetrainedEgo(against="speedy", round=4)
    assert judged_ego("last", "speedy", 1, settled) == RETRAINED
    assert judged_ego("last", "distracted", 1, played) == NaiveEgo()
    assert judged_ego("naive", "speedy", 1, played) == NaiveEgo()
    assert judged_ego("robust", "speedy", 1, played) == RobustEgo()


def test_judged_ego__is_that_of_the_last_round_also_if_one_of_its_arms_was_left_out() -> None:
    last = RetrainedEgo(against="speedy", round=4)
    met, settled = (Arm(ego=last, non_ego=PersonaNonEgo(persona="speedy", round=round_)) for round_ in (3, 5))
    run = evidence({RETRAINED_VS: [0], met: [0]})
    run = replace(run, arms=run.arms | {settled.name: settled})
    assert judged_ego("last", "speedy", 1, run) == last


RUN = evidence({RETRAINED_VS: hundred(0)})
CLOSE = RUN.episodes.assign(near_miss=hundred(95), near_miss_ttc=hundred(90), near_miss_pet=0, near_miss_headway=0)
CLOSE.loc[90:94, "near_miss_headway"] = 1
NEAR_MISSES = replace(RUN, summary=summarise(CLOSE))
HARMED = evidence({NAIVE_VS: hundred(0), RETRAINED_VS: hundred(0)})
HARM = HARMED.episodes.assign(person_failed=hundred(2) + hundred(22), bystander_failed=0)
HARMED = replace(HARMED, summary=summarise(HARM.assign(harm_to_others=HARM["person_failed"])))
FORGOTTEN = evidence({NAIVE_ALONE: hundred(0), RETRAINED_VS: hundred(0), ALONE: hundred(20)})
SLOW = evidence({NAIVE_VS: hundred(0), RETRAINED_VS: hundred(0)}, {NAIVE_VS: 13.5, RETRAINED_VS: 12.0})
PAIR = {"role": "ego", "ego": "retrained_speedy", "non_ego": "speedy", "persona": "speedy", "seed": 1}
GAP = PAIR | {"payoff": -20.0, "gap": 2.0, "ci_high": 3.0, "pairs": 50, "verdict": "not distinguishable from 0"}
GAPS = replace(RUN, gaps=pd.DataFrame([GAP]))
REGULATION = {"driver": "careful_and_competent", "from_start_rate": 0.02, "from_start_rate_high": 0.07}
OF_ARM = {"arm": RETRAINED_VS.name, "seed": 1}
JUDGED = replace(
    evidence({RETRAINED_VS: hundred(7)}),
    preventability=pd.DataFrame([OF_ARM | {"driver": "rss", "from_start_rate": 0.01}, OF_ARM | REGULATION]),
)
UNFAILING = replace(RUN, preventability=pd.DataFrame(columns=["arm", "seed", "driver"]))


@pytest.mark.parametrize(
    ("run", "name", "bounds", "value", "limit", "games"),
    [
        # a bound that is not kept and one that is; the limit is the end of the interval that is judged
        (RUN, "failure_rate", (0.03, 0.04), 0.0, 0.0362, 100),  # 0 of 100 shows no less than 3.6 %
        (JUDGED, "failure_rate", (0.1, 0.14), 0.07, 0.1389, 100),
        (NEAR_MISSES, "near_miss_rate", (0.5, 0.99), 0.95, 0.9836, 100),
        (HARMED, "harm_to_others_rate", (0.3, 0.32), 0.22, 0.3139, 100),
        (FORGOTTEN, "failure_rate_alone", (0.25, 0.3), 0.2, 0.2918, 100),
        (SLOW, "speed_loss_mps", (1.0, 2.0), 1.5, 1.5, 100),
        (GAPS, "gap_share", (0.12, 0.15), 0.1, 0.15, 50),
        (JUDGED, "preventable_failure_rate", (0.05, 0.08), 0.02, 0.07, 100),
        (UNFAILING, "preventable_failure_rate", (0.03, 0.05), 0.0, 0.0362, 100),  # that of failures
    ],
)
def test_bound__is_kept_by_the_end_of_the_interval(
    run: Evidence, name: str, bounds: tuple[float, float], value: float, limit: float, games: int
) -> None:
    checks = [judge({name: bound}, "last", ["speedy"], [1], run)[0] for bound in bounds]
    assert [check.passed for check in checks] == [False, True]
    assert {(check.value, check.games) for check in checks} == {(value, games)}
    assert checks[0].limit == pytest.approx(limit, abs=1e-4)
    assert (checks[0].arm == ALONE.name) == (name == "failure_rate_alone")


def test_gap__of_a_search_that_lacks_power_keeps_no_bound() -> None:
    below = GAP | {"gap": -3.0, "ci_high": -2.0, "verdict": GapVerdict.LACKS_POWER.value}
    (check,) = judge({"gap_share": 1.0}, "last", ["speedy"], [1], replace(RUN, gaps=pd.DataFrame([below])))
    assert not check.passed
    assert sentence(check) == "not measured: the search ends below the ego's own strategy"


def test_near_misses__are_told_by_criterion() -> None:
    (check,) = judge({"near_miss_rate": 0.5}, "last", ["speedy"], [1], NEAR_MISSES)
    assert sentence(check).replace(NO_SPACE, " ") == (
        "95 % in 100 games of retrained_vs_speedy; with 95 % confidence at most 98.4 %; allowed: 50 %; 90 by time to "
        "collision of at most 1.5 s, 5 by time headway of at most 0.5 s"
    )


def test_harm_to_others__is_told_beside_that_of_the_naive_ego() -> None:
    (check,) = judge({"harm_to_others_rate": 0.1}, "last", ["speedy"], [1], HARMED)
    assert check.detail == (
        "a person fails in 22 of 100 games beside this ego, and in 2 of 100 beside the naive ego; "
        "a bystander fails in 0 of 100 games beside this ego, and in 0 of 100 beside the naive ego"
    )
    (check,) = judge({"harm_to_others_rate": 0.1}, "naive", ["speedy"], [1], HARMED)
    assert check.value == 0.02
    assert "naive" not in check.detail
