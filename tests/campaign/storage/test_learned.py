"""Which trainings made a player that can drive: the judgement in the manifest."""

from __future__ import annotations

from typing import Any

from harness.campaign.plan.plan import plan
from harness.campaign.storage.learned import did_not_learn, judged, recorded_goals
from harness.campaign.storage.manifest import StageEntry
from harness.config.campaign import Campaign
from harness.evaluation.competence import DID_NOT_LEARN, Goals


def campaign(**changes: Any) -> Campaign:
    return Campaign.model_validate({"name": "a", "scene": "b", "personas": ["anna.toml"], **changes})


def entries(document: Campaign, stopped: str = "converged") -> dict[str, dict[str, Any]]:
    """The manifest's entries of a finished run, without goals."""
    found = {}
    for stage in plan(document, ["anna"]):
        about = {"kind": stage.kind, "name": stage.name, "persona": stage.persona, "seed": stage.seed}
        done = {"steps": 9, "budget_steps": 9, "stopped": stopped} if stage.kind == "training" else {"episodes": 4}
        found[stage.id] = {**about, "status": "done", **done}
    return found


def judge(document: Campaign, goals: dict[str, Goals], **options: Any) -> dict[str, dict[str, Any]]:
    return judged(entries(document, **options), document, plan(document, ["anna"]), goals)


def test_judged__a_player_that_cannot_drive_did_not_learn_whatever_stopped_its_training() -> None:
    goals = {"naive_alone-seed1": Goals(goals=97, played=100), "anna_alone-seed1": Goals(goals=79, played=100)}
    for stopped in ("converged", "budget"):
        found = judge(campaign(), goals, stopped=stopped)
        assert found["naive-seed1"]["stopped"] == stopped
        assert found["anna-seed1"]["stopped"] == DID_NOT_LEARN
        assert found["retrained_anna-seed1"]["stopped"] == stopped  # not assessed alone yet
        assert did_not_learn(found) == {"anna-seed1": "alone it reaches its goal in 79 of 100 games (79 %), below 80 %"}


def test_judged__entries_record_the_goals_and_the_bound() -> None:
    found = judge(campaign(), {"naive_alone-seed1": Goals(goals=97, played=100)})["naive-seed1"]
    assert (found["goals"], found["played"], found["goal_share_asked"]) == (97, 100, 0.97)
    assert StageEntry.model_validate(found).goals == 97


def test_judged__by_the_bounds_of_the_campaign() -> None:
    goals = {"naive_alone-seed1": Goals(goals=0, played=100)}
    assert judge(campaign(competence={"ego_goal_share": 0.0}), goals)["naive-seed1"]["stopped"] == "converged"


def test_judged__again_is_the_same() -> None:
    document, goals = campaign(), {"anna_alone-seed1": Goals(goals=0, played=4)}
    once = judge(document, goals)
    assert judged(once, document, plan(document, ["anna"]), goals) == once


def test_judged__an_arm_of_which_no_game_could_be_played_shows_nothing() -> None:
    found = judge(campaign(), {"anna_alone-seed1": Goals(goals=0, played=0)})
    assert found["anna-seed1"]["stopped"] == "converged"


def test_judged__best_responses_and_trainings_that_are_not_done_are_left_alone() -> None:
    document = campaign(best_response={"steps": 1000, "starts": 1})
    before = entries(document)
    before["anna-seed1"]["status"] = "failed"
    after = judged(before, document, plan(document, ["anna"]), {"anna_alone-seed1": Goals(goals=0, played=4)})
    assert after == before


def test_recorded_goals__are_those_of_arms() -> None:
    arm = {"kind": "assessment", "status": "done", "goals": 3, "played": 4}
    training = {"kind": "training", "status": "done", "goals": 3, "played": 4}
    found = recorded_goals({"a": arm, "b": training, "c": {"kind": "assessment", "status": "pending"}})
    assert found == {"a": Goals(goals=3, played=4)}


def test_did_not_learn__a_manifest_without_the_goals_names_none() -> None:
    assert did_not_learn({"naive-seed1": {"kind": "training", "stopped": DID_NOT_LEARN}}) == {}
