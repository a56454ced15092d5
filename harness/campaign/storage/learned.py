"""Which trainings made a player that can drive the scene: the manifest's judgement of each training.

A training ends when its curve is flat or its budget is used. Neither says that something was learned. What was learned
shows in the arms in which the player is assessed alone, or beside SUMO's driver if it learned beside it, without
exploration and over the starts of every other arm. The curve can't show it: its games explore, some are played against
the opponent, and their failures may be the opponent's. Of further roads, on which no arm is played, the last games
alone of the training tell whether most of them fail.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from harness.campaign.plan.alone_bounds import bounds_of
from harness.campaign.plan.stages import ConditioningStage, Stage, TrainingStage
from harness.config.campaign import Campaign
from harness.evaluation.competence import ALONE, DID_NOT_LEARN, Goals
from harness.evaluation.strategies import stage_id

_JUDGEMENT = ("goals", "played", "goal_share_asked")

Entries = dict[str, dict[str, Any]]
"""The entries of stages in a manifest, by id."""


def judged(
    entries: Mapping[str, Mapping[str, Any]],
    campaign: Campaign,
    stages: Iterable[Stage],
    goals: Mapping[str, Goals],
) -> Entries:
    """A manifest's entries, with the judgement of each training that is done and whose player was assessed alone.

    `goals` are those of the arms by the id of their stage. An entry gets `goals`, `played`, `goal_share_asked` and
    `where` of the first arm in which the goals do not suffice, or else of the first one. The reason in `stopped`
    becomes `DID_NOT_LEARN` where they do not suffice, and where most games on a road fail.
    """
    found = {name: dict(entry) for name, entry in entries.items()}
    for stage in stages:
        entry = found.get(stage.id, {})
        if not isinstance(stage, TrainingStage | ConditioningStage) or entry.get("status") != "done":
            continue
        if entry.get("steps") is None:  # it was trained in another run
            continue
        bounds = list(bounds_of(campaign, stage.strategy))
        if bounds and entry.get("failing_roads"):
            found[stage.id]["stopped"] = DID_NOT_LEARN
        reached = [(each, goals.get(stage_id(each.arm, stage.seed))) for each in bounds]
        played = [(each, of_arm) for each, of_arm in reached if of_arm is not None and of_arm.played]
        missed = [(each, of_arm) for each, of_arm in played if not of_arm.suffice(each.goal_share)]
        if missed:
            found[stage.id]["stopped"] = DID_NOT_LEARN
        for each, of_arm in (missed or played)[:1]:
            found[stage.id] |= of_arm.record() | {"goal_share_asked": each.goal_share, "where": each.where}
    return found


def recorded_goals(entries: Mapping[str, Mapping[str, Any]]) -> dict[str, Goals]:
    """The goals of the arms that their entries in a manifest record, by id."""
    return {
        name: Goals.recorded(entry)
        for name, entry in entries.items()
        if entry["kind"] == "assessment" and entry.get("goals") is not None and entry.get("played") is not None
    }


def did_not_learn(entries: Mapping[str, Mapping[str, Any]]) -> dict[str, str]:
    """The trainings that made no player that can drive, by id, each with its share of goals and the bound, or with the
    roads on which it fails."""
    reasons = {
        name: "; ".join(_shortfalls(each)) for name, each in entries.items() if each.get("stopped") == DID_NOT_LEARN
    }
    return {name: reason for name, reason in reasons.items() if reason}


def _shortfalls(entry: Mapping[str, Any]) -> Iterator[str]:
    if None not in (entry.get(key) for key in _JUDGEMENT):
        goals, asked = Goals.recorded(entry), entry["goal_share_asked"]
        if not goals.suffice(asked):
            yield goals.below(asked, entry.get("where", ALONE))
    if roads := entry.get("failing_roads"):
        yield f"at the end of its training most games alone fail on {', '.join(roads)}"
