"""Which trainings made a player that can drive the scene: the manifest's judgement of each training.

A training ends when its curve is flat or its budget is used. Neither says that something was learned. What was learned
shows in the arm in which the player is assessed alone, without exploration and over the starts of every other arm. The
curve can't show it: its games explore, some are played against the opponent, and their failures may be the opponent's.
Of further roads, on which no arm is played, the last games alone of the training tell whether most of them fail.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from harness.campaign.plan.alone_bounds import bound_of
from harness.campaign.plan.stages import ConditioningStage, Stage, TrainingStage, stage_id
from harness.config.campaign import Campaign
from harness.evaluation.competence import DID_NOT_LEARN, Goals

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

    `goals` are those of the arms by the id of their stage. An entry gets `goals`, `played` and `goal_share_asked`; the
    reason in `stopped` becomes `DID_NOT_LEARN` where the goals do not suffice, and where most games on a road fail.
    """
    found = {name: dict(entry) for name, entry in entries.items()}
    for stage in stages:
        entry = found.get(stage.id, {})
        if not isinstance(stage, TrainingStage | ConditioningStage) or entry.get("status") != "done":
            continue
        if entry.get("steps") is None:  # it was trained in another run
            continue
        bound = bound_of(campaign, stage)
        if bound is not None and entry.get("failing_roads"):
            found[stage.id]["stopped"] = DID_NOT_LEARN
        alone = goals.get(stage_id(bound.arm, stage.seed)) if bound is not None else None
        if bound is None or alone is None or not alone.played:
            continue
        found[stage.id] |= alone.record() | {"goal_share_asked": bound.goal_share}
        if not alone.suffice(bound.goal_share):
            found[stage.id]["stopped"] = DID_NOT_LEARN
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
        alone, asked = Goals.recorded(entry), entry["goal_share_asked"]
        if not alone.suffice(asked):
            yield alone.below(asked)
    if roads := entry.get("failing_roads"):
        yield f"at the end of its training most games alone fail on {', '.join(roads)}"
