"""Names of strategies and arms: derived from records, each as the tables have always had it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from harness.evaluation.strategies import (
    ATTENTIVE,
    Arm,
    BestResponse,
    NaiveEgo,
    OtherEgo,
    PersonaNonEgo,
    ReconfiguredEgo,
    RetrainedEgo,
    RobustEgo,
    Strategy,
    SumoNonEgo,
    is_named_of_a_trait,
    is_named_of_the_naive_ego,
    name_and_seed,
    persona_alone,
    player_of,
    round_of,
    stage_id,
    strategy_name,
)
from harness.game.roles import EGO, NON_EGO

SPEEDY = PersonaNonEgo(persona="speedy")
RETRAINED = RetrainedEgo(against="speedy")
LATER = RetrainedEgo(against="speedy", round=4)
RESPONSE = Arm(ego=NaiveEgo(), non_ego=SPEEDY, best_response_of=NON_EGO)


@pytest.mark.parametrize(
    ("strategy", "name", "player", "round_"),
    [
        (NaiveEgo(), "naive", EGO, 0),
        (RETRAINED, "retrained_speedy", EGO, 2),
        (LATER, "retrained_speedy_round4", EGO, 4),
        (ReconfiguredEgo(against="speedy"), "reconfigured_speedy", EGO, 2),
        (RobustEgo(), "robust", EGO, 0),
        (OtherEgo(driver="adas"), "adas", EGO, 0),
        (SumoNonEgo(), "sumo", NON_EGO, 0),
        (SPEEDY, "speedy", NON_EGO, 1),
        (PersonaNonEgo(persona="speedy", round=3), "speedy_round3", NON_EGO, 3),
        (PersonaNonEgo(persona="speedy", borrowed=ATTENTIVE), "speedy_attentive", NON_EGO, 1),
        (BestResponse(arm=RESPONSE, start=2), "naive_vs_speedy_non_ego_response2", NON_EGO, 0),
    ],
)
def test_strategy__name_player_and_round(strategy: Strategy, name: str, player: int, round_: int) -> None:
    assert (strategy_name(strategy), player_of(strategy), round_of(strategy)) == (name, player, round_)


@pytest.mark.parametrize(
    ("arm", "name"),
    [
        (Arm(ego=NaiveEgo()), "naive_alone"),
        (Arm(ego=NaiveEgo(), non_ego=SumoNonEgo()), "naive_vs_sumo"),
        (Arm(ego=NaiveEgo(), non_ego=SPEEDY), "naive_vs_speedy"),
        (Arm(non_ego=SPEEDY), "speedy_alone"),
        (Arm(non_ego=PersonaNonEgo(persona="speedy", round=3)), "speedy_round3_alone"),
        (persona_alone("speedy", ATTENTIVE), "speedy_attentive_alone"),
        (Arm(ego=RETRAINED), "retrained_alone_speedy"),
        (Arm(ego=LATER), "retrained_speedy_round4_alone"),
        (Arm(ego=ReconfiguredEgo(against="speedy")), "reconfigured_alone_speedy"),
        (Arm(ego=RobustEgo()), "robust_alone"),
        (Arm(ego=RETRAINED, non_ego=SPEEDY), "retrained_vs_speedy"),
        (Arm(ego=ReconfiguredEgo(against="speedy"), non_ego=SPEEDY), "reconfigured_vs_speedy"),
        (Arm(ego=RETRAINED, non_ego=PersonaNonEgo(persona="distracted")), "retrained_speedy_vs_distracted"),
        (Arm(ego=RETRAINED, non_ego=PersonaNonEgo(persona="speedy", round=3)), "retrained_speedy_vs_speedy_round3"),
        (Arm(ego=LATER, non_ego=SPEEDY), "retrained_speedy_round4_vs_speedy"),
        (Arm(ego=OtherEgo(driver="adas"), non_ego=SPEEDY), "adas_vs_speedy"),
        (RESPONSE, "naive_vs_speedy_non_ego_response"),
    ],
)
def test_arm__name(arm: Arm, name: str) -> None:
    assert arm.name == name


def test_arm__a_best_response_belongs_to_its_pair() -> None:
    pair = Arm(ego=NaiveEgo(), non_ego=SPEEDY)
    assert RESPONSE.pair == pair.pair == pair


@pytest.mark.parametrize(
    ("arm", "persona", "of_a_trait", "of_the_naive"),
    [
        (Arm(ego=NaiveEgo()), "", False, True),
        (Arm(ego=NaiveEgo(), non_ego=SumoNonEgo()), "", False, True),
        (Arm(ego=OtherEgo(driver="naive_seed1"), non_ego=SPEEDY), "speedy", False, False),
        (Arm(ego=RETRAINED, non_ego=SPEEDY), "speedy", False, False),
        (RESPONSE, "speedy", False, True),
        (replace(RESPONSE, best_response_of=EGO), "speedy", False, False),
        (Arm(ego=LATER, non_ego=PersonaNonEgo(persona="speedy", round=3)), "speedy", False, False),
        (persona_alone("speedy", ATTENTIVE), "speedy", False, False),
        (Arm(ego=NaiveEgo(), non_ego=PersonaNonEgo(persona="speedy", borrowed=ATTENTIVE)), "speedy", True, True),
        (Arm(ego=NaiveEgo(), non_ego=PersonaNonEgo(persona="speedy_attentive")), "speedy_attentive", False, True),
    ],
)
def test_name_of_an_arm__says_what_the_arm_does(arm: Arm, persona: str, of_a_trait: bool, of_the_naive: bool) -> None:
    assert is_named_of_a_trait(arm.name, persona) == arm.is_of_a_trait == of_a_trait
    assert is_named_of_the_naive_ego(arm.name) == of_the_naive


@pytest.mark.parametrize("name", ["naive", "retrained_speedy_round4", "on-seeds"])
def test_stage_id__is_read_as_it_is_derived(name: str) -> None:
    assert name_and_seed(stage_id(name, 11)) == (name, 11)


@pytest.mark.parametrize("text", ["", "naive", "-seed1", "naive-seed", "naive-seed1b", "naive-seed-1"])
def test_stage_id__other_text_has_no_name_and_no_seed(text: str) -> None:
    assert name_and_seed(text) == ("", None)
