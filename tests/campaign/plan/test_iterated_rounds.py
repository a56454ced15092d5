"""The plan after the paper's rounds: opponents, best responses, and the cross-play."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

from harness.campaign.plan.paper_rounds import plan_paper_rounds
from harness.campaign.plan.planned_drivers import (
    BestOf,
    EquilibriumMixture,
    FixedMixture,
    Side,
    Trained,
    TrainedBefore,
    description,
    members_of,
)
from harness.campaign.plan.stages import EquilibriumGate, RejectionGate, SelectionStage, TrainingStage
from harness.campaign.plan.strategy_stages import SeedStages, crossplay_name, training_settings
from harness.campaign.preflight import open_campaign
from harness.errors import UsageError
from harness.game.roles import EGO, NON_EGO
from tests.support.plans import campaign_of, planned, stages_of
from tests.support.repository import REPOSITORY
from tests.support.tiny import CAREFUL, write_campaign, write_persona

RESPONSE: dict[str, Any] = {"steps": 2048, "starts": 2}
TOWN = {"name": "town", "shares": {"anna": 1.0, "bert": 3.0}}
BOTH = ("anna", "bert")


def names_of(side: Side) -> list[str]:
    return [description(each).removesuffix("-seed1") for each in members_of(*side)]


# --- rounds ---------------------------------------------------------------


def test_plan__two_rounds_are_the_papers() -> None:
    of = SeedStages(campaign=campaign_of(*BOTH), seed=1)
    assert list(stages_of(*BOTH).values()) == plan_paper_rounds(of, BOTH)


def test_plan__in_odd_rounds_the_non_ego_answers_and_in_even_ones_the_ego() -> None:
    stages = stages_of("anna", rounds={"count": 5})
    names = ("anna_round3_answer", "retrained_anna_round4_answer", "anna_round5_answer")
    assert [stages[name].learner for name in names] == [NON_EGO, EGO, NON_EGO]
    assert "retrained_anna_round6" not in stages
    assert names_of(stages["retrained_anna_round4_vs_anna_round3"].ego) == ["retrained_anna_round4"]
    assert {"anna_round3_alone", "retrained_anna_round4_alone"} <= set(stages)


@pytest.mark.parametrize(
    ("against", "kind"), [("latest", Trained), ("all", FixedMixture), ("equilibrium", EquilibriumMixture)]
)
def test_plan__a_player_answers_the_opponent_that_the_campaign_names(against: str, kind: type) -> None:
    stages = stages_of("anna", rounds={"count": 5, "against": against})
    names = ("anna_round3_answer", "retrained_anna_round4_answer", "anna_round5_answer")
    opponents = [stages[name].opponent for name in names]
    egos = ["naive", "retrained_anna", "retrained_anna_round4"]
    all_before = [egos[:2], ["anna", "anna_round3"], egos]
    expected = [each[-1:] for each in all_before] if against == "latest" else all_before
    assert [names_of(each) for each in opponents] == expected
    for (opponent,) in opponents:
        assert isinstance(opponent, kind)
        if isinstance(opponent, FixedMixture):
            assert opponent.shares == (1.0,) * len(opponent.members)


def test_plan__an_equilibrium_is_of_all_strategies_before_the_round() -> None:
    training = stages_of("anna", rounds={"count": 4, "against": "equilibrium"})["retrained_anna_round4_answer"]
    (opponent,) = training.opponent
    assert opponent.arms == (
        ("naive_vs_anna-seed1", "naive_vs_anna_round3-seed1"),
        ("retrained_vs_anna-seed1", "retrained_anna_vs_anna_round3-seed1"),
    )
    assert {arm for row in opponent.arms for arm in row} <= set(training.needs)


def test_plan__rounds_may_go_on_with_some_people_only() -> None:
    stages = stages_of(*BOTH, rounds={"count": 4, "personas": ["bert"]}, best_response=RESPONSE)
    assert {stage.persona for name, stage in stages.items() if "_round" in name} == {"bert"}
    assert not any(stage.gates for stage in stages.values() if stage.persona == "anna")
    assert "retrained_vs_anna_ego_response" in stages  # what could still be gained is measured of both


@pytest.mark.parametrize(
    "changes",
    [
        {"ego": {"driver": "sumo"}},
        *(
            {
                "rounds": {"count": 6, "against": against},
                "best_response": RESPONSE,
                "crossplay": {"egos": ["sumo"]},
                "retraining": {"against": ["anna"]},
            }
            for against in ("latest", "all", "equilibrium")
        ),
    ],
)
def test_plan__what_a_stage_needs_stands_before_it(changes: dict[str, Any]) -> None:
    before: set[str] = set()
    for stage in stages_of(*BOTH, **changes).values():
        assert set(stage.needs) <= before, stage.id
        assert len(set(stage.needs)) == len(stage.needs)
        before.add(stage.id)


# --- selections ---------------------------------------------------------------


@pytest.mark.parametrize("against", ["latest", "all", "equilibrium"])
def test_plan__a_player_goes_on_with_the_best_of_all_its_policies(against: str) -> None:
    """It is selected by games against what its answer was trained against, with the same share alone on the road."""
    stages = stages_of("anna", rounds={"count": 6, "against": against})
    candidates = {
        "anna_round3": ["anna", "anna_round3_answer"],
        "retrained_anna_round4": ["naive", "retrained_anna", "retrained_anna_round4_answer"],
        "anna_round5": ["anna", "anna_round3_answer", "anna_round5_answer"],
        "retrained_anna_round6": [
            *("naive", "retrained_anna", "retrained_anna_round4_answer", "retrained_anna_round6_answer"),
        ],
    }
    selections = {name: stage for name, stage in stages.items() if isinstance(stage, SelectionStage)}
    assert {name: names_of(each.candidates) for name, each in selections.items()} == candidates
    for name, selection in selections.items():
        training = stages[f"{name}_answer"]
        assert (selection.opponent, selection.alone_share) == (training.opponent, training.alone_share)
        assert training.id == selection.candidates[-1].stage
        assert training.id in selection.needs
    assert {each.alone_share for each in selections.values()} == {0.25, 0.5}


def test_plan__the_papers_rounds_select_nothing() -> None:
    assert not any(isinstance(stage, SelectionStage) for stage in stages_of(*BOTH, crossplay={}).values())


def test_plan__policies_of_another_run_are_the_players_of_their_rounds() -> None:
    stages = stages_of("anna", policies="policies", rounds={"count": 4}, crossplay={})
    assert not any(isinstance(stage, SelectionStage) for stage in stages.values())
    assert not any("rejected" in name or "answer" in name for name in stages)
    assert stages["retrained_anna_round4_alone"].ego == (TrainedBefore(stage="retrained_anna_round4-seed1"),)


def test_plan__a_rejected_answer_meets_everyone_of_the_cross_play() -> None:
    stages = stages_of("anna", rounds={"count": 4}, crossplay={"egos": ["sumo"]})
    rejected = {name: stage for name, stage in stages.items() if "rejected" in name}
    non_egos = ("anna", "anna_round3", "anna_round3_rejected")
    assert set(rejected) == {
        *(f"retrained_anna_round4_rejected_vs_{each}" for each in non_egos),
        *(f"{ego}_vs_anna_round3_rejected" for ego in ("naive", "retrained_anna", "retrained_anna_round4", "sumo")),
    }
    arm = rejected["retrained_anna_round4_rejected_vs_anna_round3_rejected"]
    assert (names_of(arm.ego), names_of(arm.non_ego)) == (["retrained_anna_round4_answer"], ["anna_round3_answer"])
    assert arm.gates == (
        RejectionGate(selection="retrained_anna_round4-seed1", answer="retrained_anna_round4_answer-seed1"),
        RejectionGate(selection="anna_round3-seed1", answer="anna_round3_answer-seed1"),
    )
    assert {gate.selection for gate in arm.gates} <= set(arm.needs)


# --- best responses ---------------------------------------------------------------


def test_plan__a_best_response_learns_from_its_own_policy_and_from_nothing() -> None:
    stages = stages_of("anna", best_response=RESPONSE)
    first, second = (stages[f"retrained_vs_anna_non_ego_response{k}"] for k in (1, 2))
    assert (first.initial, second.initial) == (Trained(stage="anna-seed1", persona="anna"), None)
    assert first.learner == second.learner == NON_EGO
    assert first.alone_share == 0.0  # the pair's game is the one in which both take part
    assert names_of(first.opponent) == ["retrained_anna"]
    ego = stages["retrained_vs_anna_ego_response1"]
    assert (ego.learner, ego.initial, names_of(ego.opponent)) == (EGO, Trained(stage="retrained_anna-seed1"), ["anna"])


def test_plan__the_best_of_the_starts_replaces_its_player() -> None:
    response = stages_of("anna", best_response=RESPONSE)["retrained_vs_anna_non_ego_response"]
    (best,) = response.non_ego
    assert isinstance(best, BestOf)
    assert names_of(response.non_ego) == [f"retrained_vs_anna_non_ego_response{k}" for k in (1, 2)]
    assert best.persona == "anna"
    assert names_of(response.ego) == ["retrained_anna"]


def test_plan__further_arms_are_measured_by_name() -> None:
    stages = stages_of("anna", best_response={**RESPONSE, "arms": ["naive_vs_anna"]})
    assert {"naive_vs_anna_ego_response", "retrained_vs_anna_ego_response"} <= set(stages)


def test_plan__rounds_may_end_after_each_answer_of_the_ego() -> None:
    """Where the players of the pair were assessed alone."""
    changes = {"rounds": {"count": 6}, "best_response": RESPONSE}
    stages = stages_of("anna", **changes, competence={"ego_goal_share": 0.0, "non_ego_goal_share": 0.0})
    second = EquilibriumGate(
        pair="retrained_vs_anna-seed1",
        ego_response="retrained_vs_anna_ego_response-seed1",
        non_ego_response="retrained_vs_anna_non_ego_response-seed1",
    )
    assert stages["retrained_anna"].gates == ()
    assert stages["anna_round3"].gates == stages["anna_round3_answer"].gates == (second,)
    first, last = stages["anna_round5"].gates
    assert first == second
    assert last.pair == "retrained_anna_round4_vs_anna_round3-seed1"
    assert stages["retrained_anna_round6_vs_anna_round5_ego_response"].gates[-1].pair.startswith("retrained_anna_r")

    stages = stages_of("anna", **changes)
    first, last = stages["anna_round5"].gates
    assert first.alone == ("retrained_alone_anna-seed1", "anna_alone-seed1")
    assert last.alone == ("retrained_anna_round4_alone-seed1", "anna_round3_alone-seed1")
    assert [bound.goal_share for bound in first.bounds] == [0.97, 0.8]
    assert set(first.alone) <= set(stages["anna_round3"].needs)


def test_plan__rounds_are_played_to_the_end_where_that_is_asked() -> None:
    stages = stages_of("anna", rounds={"count": 6, "stop_early": False}, best_response=RESPONSE)
    assert not any(stage.gates for stage in stages.values())
    assert "retrained_vs_anna_ego_response" not in stages  # only the last arm is measured


def test_plan__best_responses_learn_where_the_players_were_trained_before() -> None:
    stages = stages_of("anna", policies="policies", best_response=RESPONSE)
    trainings = {name for name, stage in stages.items() if isinstance(stage, TrainingStage)}
    assert trainings == {f"retrained_vs_anna_{role}_response{k}" for role in ("ego", "non_ego") for k in (1, 2)}
    first = stages["retrained_vs_anna_ego_response1"]
    assert first.initial == TrainedBefore(stage="retrained_anna-seed1")
    assert set(first.reads) == {"retrained_anna-seed1", "anna-seed1"}


# --- budgets ---------------------------------------------------------------


def test_settings__a_best_response_has_its_own_budget() -> None:
    campaign, stages = campaign_of("anna", best_response=RESPONSE), stages_of("anna", best_response=RESPONSE)
    assert training_settings(campaign, stages["retrained_vs_anna_ego_response1"]).steps == RESPONSE["steps"]
    assert training_settings(campaign, stages["naive"]).steps == campaign.training.steps


def test_settings__several_people_in_one_place_multiply_the_budget() -> None:
    crowd = {"name": "crowd", "personas": ["anna", "bert", "anna"]}
    changes = {"population": [TOWN], "crowd": [crowd], "retraining": {"against": ["anna", "bert"]}}
    changes["rounds"] = {"count": 4, "against": "all"}
    campaign, stages = campaign_of(*BOTH, **changes), stages_of(*BOTH, **changes)
    once = campaign.training
    for name in ("robust", "retrained_town"):
        settings = training_settings(campaign, stages[name])
        assert (settings.steps, settings.segment_steps) == (2 * once.steps, 2 * once.segment_steps)
    for name in ("naive", "retrained_anna", "retrained_anna_round4_answer", "retrained_crowd"):
        assert training_settings(campaign, stages[name]) == once  # of one person's strategies it meets one


# --- other egos ---------------------------------------------------------------


@pytest.mark.parametrize(
    ("written", "name"),
    [
        ("../policies/mine/naive-seed1", "naive_seed1"),
        ("egos/my ego (2).toml", "my_ego_2_"),
        ("egos/v1.2.toml", "v1_2"),
        ("egos/2nd.toml", "ego_2nd"),
        ("sumo", "sumo"),
    ],
)
def test_crossplay__names_of_drivers_are_names_of_files_and_stages(written: str, name: str) -> None:
    """A manifest with other names is refused as damaged."""
    assert crossplay_name(written) == name


def test_plan__the_robust_ego_meets_the_others_as_well() -> None:
    stages = stages_of(*BOTH, retraining={"against": ["bert"]})
    assert names_of(stages["robust"].opponent) == ["bert"]
    assert {"robust_vs_anna", "robust_vs_bert", "robust_alone"} <= set(stages)


def test_plan__a_population_is_met_as_a_persona_is(tmp_path: Path) -> None:
    personas = [str(write_persona(tmp_path, name)) for name in BOTH]
    stages, keys = planned(tmp_path, personas=personas, population=[TOWN])
    training = stages["retrained_town-seed1"]
    assert isinstance(training, TrainingStage)
    (opponent,) = training.opponent
    assert isinstance(opponent, FixedMixture)
    assert (names_of((opponent,)), opponent.shares) == (["anna", "bert"], (1.0, 3.0))
    assert "town-seed1" not in stages
    _, turned = planned(tmp_path, personas=personas, population=[{**TOWN, "shares": {"anna": 2.0, "bert": 2.0}}])
    changed = {name for name in keys if keys[name] != turned[name]}
    assert changed == {
        f"{name}-seed1" for name in ("retrained_town", "naive_vs_town", "retrained_vs_town", "retrained_alone_town")
    }


# --- what can't be ---------------------------------------------------------------


@pytest.mark.parametrize("name", ["sumo", "shipped"])
def test_campaign__a_persona_with_the_name_of_other_drivers_is_refused(name: str, tmp_path: Path) -> None:
    personas = [str(write_persona(tmp_path, name))]
    with pytest.raises(UsageError, match=f"retraining.against: '{name}' is the name of a persona, too"):
        open_campaign(write_campaign(tmp_path, personas=personas, retraining={"against": [name]}))


@pytest.mark.parametrize(
    ("changes", "key", "words"),
    [
        ({"population": [{"name": "town", "shares": {"anna": 1.0, "bret": 1.0}}]}, "population[0].shares", "'bret'"),
        ({"population": [{"name": "anna", "shares": {"anna": 1.0, "bert": 1.0}}]}, "population[0].name", "'anna'"),
        ({"population": [{"name": "town", "shares": {"anna": 1.0}}]}, "population[0].shares", "at least 2"),
        ({"retraining": {"against": ["bret"]}}, "retraining.against", "'bret'"),
        ({"retraining": {"against": ["anna", "anna"]}}, "retraining.against", "twice"),
        ({"rounds": {"count": 4, "personas": ["bret"]}}, "rounds.personas", "'bret'"),
        ({"rounds": {"count": 0}}, "rounds.count", "greater than or equal to 1"),
        ({"rounds": {"count": 3, "stop_early": True}}, "rounds.stop_early", "best_response"),
        ({"best_response": {"arms": ["naive_vs_bret"]}}, "best_response.arms", "naive_vs_b"),
        ({"best_response": {"arms": ["naive_alone"]}}, "best_response.arms", "no arm of an ego and a persona"),
        ({"crossplay": {"egos": ["nobody.toml"]}}, "crossplay.egos", "nobody.toml"),
        ({"crossplay": {"egos": [f"{'x' * 41}.toml"]}}, "crossplay.egos", f"'{'x' * 40}'… is longer than 40 letters"),
        ({"crossplay": {"egos": ["sumo", "sumo"]}}, "crossplay.egos", "two drivers"),
        ({"crossplay": {"egos": ["learned"]}}, "crossplay.egos", "always take part"),
        ({"ego": {"driver": "sumo", "persona": str(CAREFUL)}, "rounds": {"count": 4}}, "rounds.count", "not learn"),
        (
            {"ego": {"driver": "sumo", "persona": str(CAREFUL)}, "retraining": {"starts": "regret"}},
            "retraining.starts",
            "not learn",
        ),
        ({"personas": [], "retraining": {"starts": "regret"}}, "retraining.starts", "no ego is retrained"),
        ({"retraining": {"starts": "regret", "alone_share": 1.0}}, "retraining.starts", "no game is played against"),
        ({"retraining": {"starts": "regrets"}}, "retraining.starts", "'regrets' is not possible"),
        ({"ego": {"driver": "sumo", "persona": str(CAREFUL), "shield": "rss"}}, "ego.shield", "SUMO drives this ego"),
        (
            {"ego": {"driver": "sumo", "persona": str(CAREFUL)}, "crossplay": {"egos": ["sumo"]}},
            "crossplay",
            "always takes part",
        ),
    ],
)
def test_campaign__names_without_a_meaning_are_refused(
    changes: dict[str, Any], key: str, words: str, tmp_path: Path
) -> None:
    both = [str(write_persona(tmp_path, name)) for name in BOTH]
    shutil.copy(REPOSITORY / "egos" / "adas.toml", tmp_path / f"{'x' * 41}.toml")
    with pytest.raises(UsageError) as error:
        open_campaign(write_campaign(tmp_path, **{"personas": both, **changes}))
    assert key in str(error.value)
    assert words in str(error.value)
