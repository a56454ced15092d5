"""The plan after the paper's rounds: opponents, best responses, the cross-play, and the matchups that follow."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from harness.campaign.plan.paper_rounds import plan_paper_rounds
from harness.campaign.plan.plan import plan
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
from harness.campaign.plan.stages import AssessmentStage, EquilibriumGate, Stage, TrainingStage
from harness.campaign.plan.strategy_stages import SeedStages, crossplay_name, training_settings
from harness.campaign.preflight import QUICK_RESPONSE_STEPS, open_campaign
from harness.campaign.results.matchups import matchups_of
from harness.drivers.policy_file import Policy, write_policy
from harness.errors import UsageError
from harness.game.roles import EGO, NON_EGO
from tests.support.plans import planned
from tests.support.policies import some_policy
from tests.support.repository import REPOSITORY
from tests.support.tiny import CAREFUL, write_campaign, write_persona

RESPONSE: dict[str, Any] = {"steps": 2048, "starts": 2}


@pytest.fixture
def anna(tmp_path: Path) -> list[str]:
    return [str(write_persona(tmp_path, "anna"))]


@pytest.fixture
def both(tmp_path: Path) -> list[str]:
    return [str(write_persona(tmp_path, name)) for name in ("anna", "bert")]


def training(stages: dict[str, Stage], name: str) -> TrainingStage:
    stage = stages[f"{name}-seed1"]
    assert isinstance(stage, TrainingStage)
    return stage


def arm(stages: dict[str, Stage], name: str) -> AssessmentStage:
    stage = stages[f"{name}-seed1"]
    assert isinstance(stage, AssessmentStage)
    return stage


def names_of(side: Side) -> list[str]:
    return [description(each).removesuffix("-seed1") for each in members_of(*side)]


# --- rounds ---------------------------------------------------------------


def test_plan__two_rounds_are_the_papers(tmp_path: Path, both: list[str]) -> None:
    stages, _ = planned(tmp_path, personas=both)
    of = SeedStages(campaign=open_campaign(tmp_path / "tiny.toml").document, seed=1)
    assert list(stages.values()) == plan_paper_rounds(of, ["anna", "bert"])


def test_plan__in_odd_rounds_the_non_ego_answers_and_in_even_ones_the_ego(tmp_path: Path, anna: list[str]) -> None:
    stages, _ = planned(tmp_path, personas=anna, rounds={"count": 5})
    learners = {
        name: training(stages, name).learner for name in ("anna_round3", "retrained_anna_round4", "anna_round5")
    }
    assert learners == {"anna_round3": NON_EGO, "retrained_anna_round4": EGO, "anna_round5": NON_EGO}
    assert "retrained_anna_round6-seed1" not in stages
    assert names_of(arm(stages, "retrained_anna_round4_vs_anna_round3").ego) == ["retrained_anna_round4"]
    assert {"anna_round3_alone-seed1", "retrained_anna_round4_alone-seed1"} <= set(stages)


@pytest.mark.parametrize(
    ("against", "round3", "round4", "round5"),
    [
        ("latest", ["retrained_anna"], ["anna_round3"], ["retrained_anna_round4"]),
        (
            "all",
            ["naive", "retrained_anna"],
            ["anna", "anna_round3"],
            ["naive", "retrained_anna", "retrained_anna_round4"],
        ),
        (
            "equilibrium",
            ["naive", "retrained_anna"],
            ["anna", "anna_round3"],
            ["naive", "retrained_anna", "retrained_anna_round4"],
        ),
    ],
)
def test_plan__a_player_answers_whom_the_campaign_says(
    against: str, round3: list[str], round4: list[str], round5: list[str], tmp_path: Path, anna: list[str]
) -> None:
    stages, _ = planned(tmp_path, personas=anna, rounds={"count": 5, "against": against})
    opponents = [training(stages, name).opponent for name in ("anna_round3", "retrained_anna_round4", "anna_round5")]
    assert [names_of(each) for each in opponents] == [round3, round4, round5]
    kinds = {"latest": Trained, "all": FixedMixture, "equilibrium": EquilibriumMixture}
    for (opponent,) in opponents:
        assert isinstance(opponent, kinds[against])
        if isinstance(opponent, FixedMixture):
            assert opponent.shares == (1.0,) * len(opponent.members)


def test_plan__an_equilibrium_is_of_all_strategies_before_the_round(tmp_path: Path, anna: list[str]) -> None:
    stages, _ = planned(tmp_path, personas=anna, rounds={"count": 4, "against": "equilibrium"})
    (opponent,) = training(stages, "retrained_anna_round4").opponent
    assert isinstance(opponent, EquilibriumMixture)
    assert opponent.arms == (
        ("naive_vs_anna-seed1", "naive_vs_anna_round3-seed1"),
        ("retrained_vs_anna-seed1", "retrained_anna_vs_anna_round3-seed1"),
    )
    assert {arm for row in opponent.arms for arm in row} <= set(training(stages, "retrained_anna_round4").needs)


def test_plan__an_exchange_may_go_on_with_some_people_only(tmp_path: Path, both: list[str]) -> None:
    stages, _ = planned(tmp_path, personas=both, rounds={"count": 4, "personas": ["bert"]}, best_response=RESPONSE)
    later = {name for name, stage in stages.items() if "_round" in name}
    assert later
    assert {stages[name].persona for name in later} == {"bert"}
    assert not any(stage.gates for stage in stages.values() if stage.persona == "anna")
    assert "retrained_vs_anna_ego_response-seed1" in stages  # what could still be gained is measured of both


@pytest.mark.parametrize("against", ["latest", "all", "equilibrium"])
def test_plan__what_a_stage_needs_stands_before_it(against: str, tmp_path: Path, both: list[str]) -> None:
    stages, _ = planned(
        tmp_path,
        personas=both,
        rounds={"count": 6, "against": against},
        best_response=RESPONSE,
        crossplay={"egos": ["sumo"]},
        retraining={"against": ["anna"]},
    )
    before: set[str] = set()
    for name, stage in stages.items():
        assert set(stage.needs) <= before, name
        before.add(name)


# --- best responses ---------------------------------------------------------------


def test_plan__a_best_response_learns_from_its_own_policy_and_from_nothing(tmp_path: Path, anna: list[str]) -> None:
    stages, _ = planned(tmp_path, personas=anna, best_response=RESPONSE)
    first, second = (training(stages, f"retrained_vs_anna_non_ego_response{k}") for k in (1, 2))
    assert (first.initial, second.initial) == (Trained(stage="anna-seed1", persona="anna"), None)
    assert first.learner == second.learner == NON_EGO
    assert first.alone_share == 0.0  # the pair's game is the one in which both take part
    assert names_of(first.opponent) == ["retrained_anna"]
    ego = training(stages, "retrained_vs_anna_ego_response1")
    assert (ego.learner, ego.initial, names_of(ego.opponent)) == (EGO, Trained(stage="retrained_anna-seed1"), ["anna"])


def test_plan__the_best_of_the_starts_replaces_its_player(tmp_path: Path, anna: list[str]) -> None:
    stages, _ = planned(tmp_path, personas=anna, best_response=RESPONSE)
    response = arm(stages, "retrained_vs_anna_non_ego_response")
    (best,) = response.non_ego
    assert isinstance(best, BestOf)
    assert names_of(response.non_ego) == [f"retrained_vs_anna_non_ego_response{k}" for k in (1, 2)]
    assert best.persona == "anna"
    assert names_of(response.ego) == ["retrained_anna"]


def test_plan__further_arms_are_measured_by_name(tmp_path: Path, anna: list[str]) -> None:
    stages, _ = planned(tmp_path, personas=anna, best_response={**RESPONSE, "arms": ["naive_vs_anna"]})
    assert {"naive_vs_anna_ego_response-seed1", "retrained_vs_anna_ego_response-seed1"} <= set(stages)


def test_settings__a_best_response_has_its_own_budget(tmp_path: Path, anna: list[str]) -> None:
    stages, _ = planned(tmp_path, personas=anna, best_response={**RESPONSE, "steps": 4096})
    campaign = open_campaign(tmp_path / "tiny.toml").document
    assert training_settings(campaign, training(stages, "retrained_vs_anna_ego_response1")).steps == 4096
    assert training_settings(campaign, training(stages, "naive")).steps == campaign.training.steps
    quick = open_campaign(write_campaign(tmp_path, personas=anna, best_response={"steps": 10**6}), quick=True).document
    assert training_settings(quick, training(stages, "retrained_vs_anna_ego_response1")).steps == QUICK_RESPONSE_STEPS


def test_settings__who_meets_several_people_has_the_budget_of_as_many_trainings(
    tmp_path: Path, both: list[str]
) -> None:
    town = {"name": "town", "shares": {"anna": 1.0, "bert": 3.0}}
    stages, _ = planned(
        tmp_path,
        personas=both,
        population=[town],
        retraining={"against": ["anna", "bert"]},
        rounds={"count": 4, "against": "all"},
    )
    campaign = open_campaign(tmp_path / "tiny.toml").document
    once = campaign.training
    for name in ("robust", "retrained_town"):
        settings = training_settings(campaign, training(stages, name))
        assert (settings.steps, settings.segment_steps) == (2 * once.steps, 2 * once.segment_steps)
    for name in ("naive", "retrained_anna", "retrained_anna_round4"):  # of one person's strategies it meets one
        assert training_settings(campaign, training(stages, name)) == once


@pytest.mark.parametrize("imitation", [False, True])
def test_settings__a_person_has_a_demonstrator_only_if_the_campaign_says_so(
    imitation: bool, tmp_path: Path, anna: list[str]
) -> None:
    stages, _ = planned(tmp_path, personas=anna, non_ego_training={"imitation": imitation}, rounds={"count": 4})
    campaign = open_campaign(tmp_path / "tiny.toml").document
    steps = {
        name: training_settings(campaign, training(stages, name)).demonstration_steps for name in ("naive", "anna")
    }
    assert steps == {"naive": 38_400, "anna": 38_400 if imitation else 0}


def test_plan__an_exchange_may_end_after_each_answer_of_the_ego(tmp_path: Path, anna: list[str]) -> None:
    stages, _ = planned(tmp_path, personas=anna, rounds={"count": 6}, best_response=RESPONSE)
    second = EquilibriumGate(
        pair="retrained_vs_anna-seed1",
        ego_response="retrained_vs_anna_ego_response-seed1",
        non_ego_response="retrained_vs_anna_non_ego_response-seed1",
    )
    assert training(stages, "retrained_anna").gates == ()
    assert training(stages, "anna_round3").gates == (second,)
    assert training(stages, "anna_round5").gates[0] == second
    assert [gate.pair for gate in training(stages, "anna_round5").gates] == [
        "retrained_vs_anna-seed1",
        "retrained_anna_round4_vs_anna_round3-seed1",
    ]
    assert (
        arm(stages, "retrained_anna_round6_vs_anna_round5_ego_response").gates[-1].pair.startswith("retrained_anna_r")
    )


def test_plan__a_pair_ends_the_rounds_only_if_its_players_were_assessed_alone(tmp_path: Path, anna: list[str]) -> None:
    changes = {"rounds": {"count": 6}, "best_response": RESPONSE, "competence": {}}
    stages, _ = planned(tmp_path, personas=anna, **changes)
    first, second = training(stages, "anna_round5").gates
    assert first.alone == ("retrained_alone_anna-seed1", "anna_alone-seed1")
    assert second.alone == ("retrained_anna_round4_alone-seed1", "anna_round3_alone-seed1")
    assert [bound.goal_share for bound in first.bounds] == [0.97, 0.8]
    assert set(first.alone) <= set(training(stages, "anna_round3").needs)


def test_plan__rounds_are_played_to_the_end_where_that_is_asked(tmp_path: Path, anna: list[str]) -> None:
    stages, _ = planned(tmp_path, personas=anna, rounds={"count": 6, "stop_early": False}, best_response=RESPONSE)
    assert not any(stage.gates for stage in stages.values())
    assert "retrained_vs_anna_ego_response-seed1" not in stages  # only the last arm is measured


# --- everyone against everyone ---------------------------------------------------------------


def test_plan__everyone_meets_everyone(tmp_path: Path, both: list[str]) -> None:
    adas = REPOSITORY / "egos/adas.toml"
    changes = {"crossplay": {"egos": ["sumo", str(adas)]}, "retraining": {"against": ["anna"]}}
    stages, _ = planned(tmp_path, personas=both, rounds={"count": 4}, **changes)
    campaign = open_campaign(tmp_path / "tiny.toml")
    matchups = matchups_of(campaign.document, ["anna", "bert"], set(stages))
    assert matchups is not None
    egos = {"naive", "robust", "sumo", "adas"}
    egos |= {f"retrained_{who}{round_}" for who in ("anna", "bert") for round_ in ("", "_round4")}
    non_egos = {f"{who}{round_}" for who in ("anna", "bert") for round_ in ("", "_round3")}
    assert {(each.ego, each.non_ego) for each in matchups.pairings} == {
        (ego, other) for ego in egos for other in non_egos
    }
    assert matchups.training_personas["robust"] == ["anna"]
    assert matchups.training_personas["retrained_bert_round4"] == ["bert"]


@pytest.mark.parametrize(
    ("written", "name"),
    [
        ("../policies/merge/naive-seed1", "naive_seed1"),
        ("egos/my ego (2).toml", "my_ego_2_"),
        ("egos/v1.2.toml", "v1_2"),
        ("egos/2nd.toml", "ego_2nd"),
        ("sumo", "sumo"),
    ],
)
def test_crossplay__names_of_drivers_are_names_of_files_and_stages(written: str, name: str) -> None:
    """A manifest with other names is refused as damaged."""
    assert crossplay_name(written) == name


def test_crossplay__a_driver_with_a_long_name_is_refused(tmp_path: Path, anna: list[str]) -> None:
    driver = tmp_path / f"{'x' * 41}.toml"
    driver.write_bytes((REPOSITORY / "egos/adas.toml").read_bytes())
    with pytest.raises(UsageError, match=r"crossplay\.egos: 'x{40}'… is longer than 40 letters"):
        open_campaign(write_campaign(tmp_path, personas=anna, crossplay={"egos": [driver.name]}))


@pytest.mark.parametrize(
    ("driver", "egos", "measured"),
    [
        ("sumo", {"naive", "adas"}, "naive_vs_anna"),
        (str(REPOSITORY / "egos/adas.toml"), {"naive", "reconfigured_anna", "sumo"}, "reconfigured_vs_anna"),
    ],
)
def test_plan__an_ego_that_is_given_meets_everyone_as_it_is_and_as_it_was_tuned(
    driver: str, egos: set[str], measured: str, tmp_path: Path, anna: list[str]
) -> None:
    other = "sumo" if driver != "sumo" else str(REPOSITORY / "egos/adas.toml")
    changes = {"ego": {"driver": driver, "persona": str(CAREFUL)}, "crossplay": {"egos": [other]}}
    campaign = open_campaign(write_campaign(tmp_path, personas=anna, best_response=RESPONSE, **changes))
    stages = {stage.id: stage for stage in plan(campaign.document, ["anna"], campaign.tunable)}
    matchups = matchups_of(campaign.document, ["anna"], set(stages), campaign.tunable)
    assert matchups is not None
    assert {each.ego for each in matchups.pairings} == egos
    assert {each.pair_arm for each in matchups.responses} == {measured}
    assert {name for stage in stages.values() for name in stage.needs} <= set(stages)


def test_plan__the_robust_ego_meets_those_it_never_met_as_well(tmp_path: Path, both: list[str]) -> None:
    stages, _ = planned(tmp_path, personas=both, retraining={"against": ["bert"]})
    opponent = training(stages, "robust").opponent
    assert names_of(opponent) == ["bert"]
    assert {"robust_vs_anna-seed1", "robust_vs_bert-seed1", "robust_alone-seed1"} <= set(stages)


def test_plan__a_population_is_met_as_a_persona_is(tmp_path: Path, both: list[str]) -> None:
    town = {"name": "town", "shares": {"anna": 1.0, "bert": 3.0}}
    stages, keys = planned(tmp_path, personas=both, population=[town])
    (opponent,) = training(stages, "retrained_town").opponent
    assert isinstance(opponent, FixedMixture)
    assert (names_of((opponent,)), opponent.shares) == (["anna", "bert"], (1.0, 3.0))
    assert "town-seed1" not in stages
    assert {"naive_vs_town-seed1", "retrained_vs_town-seed1", "retrained_alone_town-seed1"} <= set(stages)
    _, turned = planned(tmp_path, personas=both, population=[{**town, "shares": {"anna": 2.0, "bert": 2.0}}])
    changed = {name for name in keys if keys[name] != turned[name]}
    assert changed == {
        f"{name}-seed1" for name in ("retrained_town", "naive_vs_town", "retrained_vs_town", "retrained_alone_town")
    }


def test_matchups__there_are_none_of_the_papers_rounds(tmp_path: Path, both: list[str]) -> None:
    stages, _ = planned(tmp_path, personas=both)
    assert matchups_of(open_campaign(tmp_path / "tiny.toml").document, ["anna", "bert"], set(stages)) is None


def test_matchups__a_response_has_the_pair_and_round_that_it_belongs_to(tmp_path: Path, anna: list[str]) -> None:
    stages, _ = planned(tmp_path, personas=anna, rounds={"count": 3}, best_response=RESPONSE)
    matchups = matchups_of(open_campaign(tmp_path / "tiny.toml").document, ["anna"], set(stages))
    assert matchups is not None
    found = {(each.role, each.round, each.pair_arm, each.ego, each.non_ego) for each in matchups.responses}
    assert found == {
        (role, last, pair, "retrained_anna", non_ego)
        for role in ("ego", "non_ego")
        for last, pair, non_ego in (
            (2, "retrained_vs_anna", "anna"),
            (3, "retrained_anna_vs_anna_round3", "anna_round3"),
        )
    }


# --- what can't be ---------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "key", "words"),
    [
        ({"population": [{"name": "town", "shares": {"anna": 1.0, "bret": 1.0}}]}, "population[0].shares", "'bret'"),
        ({"population": [{"name": "anna", "shares": {"anna": 1.0, "bert": 1.0}}]}, "population[0].name", "'anna'"),
        ({"population": [{"name": "town", "shares": {"anna": 1.0}}]}, "population[0].shares", "at least 2"),
        ({"retraining": {"against": ["bret"]}}, "retraining.against", "'bret'"),
        ({"retraining": {"against": ["anna", "anna"]}}, "retraining.against", "twice"),
        ({"rounds": {"count": 4, "personas": ["bret"]}}, "rounds.personas", "'bret'"),
        ({"rounds": {"count": 1}}, "rounds.count", "greater than or equal to 2"),
        ({"rounds": {"count": 3, "stop_early": True}}, "rounds.stop_early", "best_response"),
        ({"best_response": {"arms": ["naive_vs_bret"]}}, "best_response.arms", "naive_vs_b"),
        ({"best_response": {"arms": ["naive_alone"]}}, "best_response.arms", "no arm of an ego and a persona"),
        ({"crossplay": {"egos": ["nobody.toml"]}}, "crossplay.egos", "nobody.toml"),
        ({"crossplay": {"egos": ["sumo", "sumo"]}}, "crossplay.egos", "two drivers"),
        ({"crossplay": {"egos": ["learned"]}}, "crossplay.egos", "always take part"),
        ({"ego": {"driver": "sumo", "persona": str(CAREFUL)}, "rounds": {"count": 4}}, "rounds.count", "not learn"),
        (
            {"ego": {"driver": "sumo", "persona": str(CAREFUL)}, "crossplay": {"egos": ["sumo"]}},
            "crossplay",
            "always takes part",
        ),
    ],
)
def test_campaign__names_that_mean_nobody_are_named(
    changes: dict[str, Any], key: str, words: str, tmp_path: Path, both: list[str]
) -> None:
    with pytest.raises(UsageError) as error:
        open_campaign(write_campaign(tmp_path, personas=both, **changes))
    assert key in str(error.value)
    assert words in str(error.value)


def test_campaign__best_responses_learn_where_the_players_were_trained_before(tmp_path: Path, anna: list[str]) -> None:
    for name in ("naive", "anna", "retrained_anna"):
        folder = tmp_path / "policies" / f"{name}-seed1"
        folder.mkdir(parents=True)
        write_policy(Policy(some_policy().tensors, {"stage": folder.name}), folder)
    stages, _ = planned(tmp_path, personas=anna, policies="policies", best_response=RESPONSE)
    trainings = {name.removesuffix("-seed1") for name, stage in stages.items() if isinstance(stage, TrainingStage)}
    assert trainings == {f"retrained_vs_anna_{role}_response{k}" for role in ("ego", "non_ego") for k in (1, 2)}
    first = training(stages, "retrained_vs_anna_ego_response1")
    assert first.initial == TrainedBefore(stage="retrained_anna-seed1")
    assert set(first.reads) == {"retrained_anna-seed1", "anna-seed1"}
