"""Which trainings made a player that can drive: the judgement in the manifest."""

from __future__ import annotations

from typing import Any

import pytest

from harness.campaign.plan.plan import plan
from harness.campaign.storage.learned import did_not_learn, judged, recorded_goals
from harness.campaign.storage.manifest import StageEntry
from harness.config.campaign import Campaign
from harness.evaluation.competence import DID_NOT_LEARN, Goals
from tests.support.plans import campaign_of


def entries(document: Campaign, stopped: str = "converged") -> dict[str, dict[str, Any]]:
    """The manifest's entries of a finished run, without goals."""
    found = {}
    for stage in plan(document, ["anna"]):
        about = {"kind": stage.kind, "name": stage.name, "persona": stage.persona, "seed": stage.seed}
        done = {"steps": 9, "budget_steps": 9, "stopped": stopped} if stage.kind == "training" else {"episodes": 4}
        found[stage.id] = {**about, "status": "done", **done}
    return found


def judge(goals: dict[str, Goals], stopped: str = "converged", **changes: Any) -> dict[str, dict[str, Any]]:
    document = campaign_of("anna", **changes)
    once = judged(entries(document, stopped), document, plan(document, ["anna"]), goals)
    assert judged(once, document, plan(document, ["anna"]), goals) == once  # again is the same
    return once


@pytest.mark.parametrize("stopped", ["converged", "budget"])
def test_judged__a_player_that_cannot_drive_did_not_learn_whatever_stopped_its_training(stopped: str) -> None:
    goals = {"naive_alone-seed1": Goals(goals=97, played=100), "anna_alone-seed1": Goals(goals=79, played=100)}
    found = judge(goals, stopped)
    naive = found["naive-seed1"]
    assert (naive["stopped"], naive["goals"], naive["played"], naive["goal_share_asked"]) == (stopped, 97, 100, 0.97)
    assert StageEntry.model_validate(naive).goals == 97
    assert found["anna-seed1"]["stopped"] == DID_NOT_LEARN
    assert found["retrained_anna-seed1"]["stopped"] == stopped  # not assessed alone yet
    assert did_not_learn(found) == {"anna-seed1": "alone it reaches its goal in 79 of 100 games (79 %), below 80 %"}


def test_judged__a_naive_ego_that_stands_beside_an_ordinary_driver_did_not_learn() -> None:
    goals = {"naive_alone-seed1": Goals(goals=100, played=100), "naive_vs_sumo-seed1": Goals(goals=45, played=100)}
    found = judge(goals)
    assert found["naive-seed1"]["stopped"] == DID_NOT_LEARN
    words = "beside an ordinary road user it reaches its goal in 45 of 100 games (45 %), below 97 %"
    assert did_not_learn(found) == {"naive-seed1": words}
    assert StageEntry.model_validate(found["naive-seed1"]).where == "beside an ordinary road user"


def test_judged__an_ego_that_fails_on_a_further_road_did_not_learn() -> None:
    document = campaign_of("anna")
    before, goals = entries(document), {"naive_alone-seed1": Goals(goals=100, played=100)}
    before["naive-seed1"]["failing_roads"] = ["roundabout"]
    found = judged(before, document, plan(document, ["anna"]), goals)
    assert found["naive-seed1"]["stopped"] == DID_NOT_LEARN
    words = "at the end of its training most games alone fail on roundabout"
    assert did_not_learn(found) == {"naive-seed1": words}


def test_judged__by_the_bounds_of_the_campaign() -> None:
    goals = {"naive_alone-seed1": Goals(goals=0, played=100)}
    assert judge(goals, competence={"ego_goal_share": 0.0})["naive-seed1"]["stopped"] == "converged"


def test_judged__an_arm_of_which_no_game_could_be_played_shows_nothing() -> None:
    assert judge({"anna_alone-seed1": Goals(goals=0, played=0)})["anna-seed1"]["stopped"] == "converged"


def test_judged__best_responses_and_trainings_that_are_not_done_are_left_alone() -> None:
    document = campaign_of("anna", best_response={"steps": 1000, "starts": 1})
    before = entries(document)
    before["anna-seed1"]["status"] = "failed"
    after = judged(before, document, plan(document, ["anna"]), {"anna_alone-seed1": Goals(goals=0, played=4)})
    assert after == before


def test_goals__are_those_that_arms_record() -> None:
    arm = {"kind": "assessment", "status": "done", "goals": 3, "played": 4}
    training = {"kind": "training", "status": "done", "goals": 3, "played": 4}
    found = recorded_goals({"a": arm, "b": training, "c": {"kind": "assessment", "status": "pending"}})
    assert found == {"a": Goals(goals=3, played=4)}
    assert did_not_learn({"naive-seed1": {"kind": "training", "stopped": DID_NOT_LEARN}}) == {}
