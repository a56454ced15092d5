"""The paper's rounds: which trainings and which arms follow from a campaign, and what each needs first.

| round | stages of each seed |
| --- | --- |
| 0 | train `naive`; assess `naive_alone`, `naive_vs_sumo` |
| 1 | for each persona: train `<persona>` against the naive ego; assess `<persona>_alone`, `naive_vs_<persona>` |
| 2 | for each persona: train `retrained_<persona>`; assess `retrained_vs_<persona>`, `retrained_alone_<persona>` |

A population is met as a persona is, and nobody is trained for it: its members are. The ego that is retrained against
several personas at once is `robust`. An ego that the campaign does not train is searched for better parameters in its
round 2 (`search_rounds`), or has none. A campaign that names a folder of policies has the same arms and no
trainings: what they would have made is read from there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from harness.campaign.plan.stages import AssessmentStage, Drives, Stage, TrainingStage, arm_of, stage_id
from harness.config.campaign import LEARNED, ROBUST, SUMO, Campaign
from harness.evaluation.research_questions import Question
from harness.game.state import EGO, NON_EGO


def learns(campaign: Campaign) -> bool:
    """Whether the campaign's ego is one that learns, or has learned before."""
    return campaign.ego.driver == LEARNED


def ego_of(campaign: Campaign, seed: int) -> Drives:
    """Who the naive ego is."""
    if learns(campaign):
        return learned(campaign, "naive", seed)
    return Drives("sumo" if campaign.ego.driver == SUMO else "given")


def learned(campaign: Campaign, name: str, seed: int, persona: str = "") -> Drives:
    """The driver that a training of this name makes, or has made before."""
    return Drives("policy" if campaign.policies is None else "before", stage_id(name, seed), persona)


def population(campaign: Campaign, shares: Mapping[str, float], seed: int) -> Drives:
    """People by their shares, one of whom a game has."""
    members = tuple(learned(campaign, name, seed, name) for name in shares)
    return Drives("mixture", members=members, shares=tuple(shares.values()))


def plan_rounds(campaign: Campaign, personas: Sequence[str], seed: int) -> list[Stage]:
    """The stages of rounds 0, 1 and 2 for one seed, each after what it needs."""
    naive, ego = stage_id("naive", seed), ego_of(campaign, seed)
    stages: list[Stage] = []
    if learns(campaign):
        stages.append(TrainingStage("naive", seed, "", EGO, None, None, 1.0))
    for persona in personas:
        initial = naive if learns(campaign) and campaign.non_ego_training.warm_start else None
        how = campaign.non_ego_training
        stages.append(
            TrainingStage(persona, seed, persona, NON_EGO, ego, initial, how.alone_share, how.attentive_share)
        )
    stages.append(AssessmentStage("naive_alone", seed, "", ego, None))
    stages.append(AssessmentStage("naive_vs_sumo", seed, "", ego, Drives("sumo")))
    for persona in personas:
        person = learned(campaign, persona, seed, persona)
        retrained = _retraining(campaign, f"retrained_{persona}", persona, person, seed)
        stages += retrained
        stages.append(AssessmentStage(f"{persona}_alone", seed, persona, None, person))
        stages += _arms_of(campaign, persona, person, bool(retrained), seed)
    for each in campaign.population:
        people = population(campaign, each.shares, seed)
        retrained = _retraining(campaign, f"retrained_{each.name}", each.name, people, seed)
        stages += [*retrained, *_arms_of(campaign, each.name, people, bool(retrained), seed)]
    return stages


def plan_robust(campaign: Campaign, personas: Sequence[str], seed: int) -> list[Stage]:
    """One ego retrained against several personas at once, and its arms against them and those it never met."""
    against = campaign.retraining.against
    if not against or not learns(campaign):
        return []
    people = population(campaign, dict.fromkeys(against, 1.0), seed)
    robust = learned(campaign, ROBUST, seed)
    stages = _retraining(campaign, ROBUST, "", people, seed)
    stages.append(AssessmentStage(f"{ROBUST}_alone", seed, "", robust, None))
    for persona in personas:
        person = learned(campaign, persona, seed, persona)
        stages.append(AssessmentStage(arm_of(ROBUST, persona), seed, persona, robust, person))
    return stages


def _retraining(campaign: Campaign, name: str, persona: str, opponent: Drives, seed: int) -> list[Stage]:
    if not learns(campaign):
        return []
    begins = stage_id("naive", seed) if campaign.retraining.warm_start else None
    return [TrainingStage(name, seed, persona, EGO, opponent, begins, campaign.retraining.alone_share)]


def _arms_of(campaign: Campaign, name: str, opponent: Drives, retrained: bool, seed: int) -> list[Stage]:
    """The ego's arms against a persona or population, before and after it was retrained."""
    stages: list[Stage] = [AssessmentStage(f"naive_vs_{name}", seed, name, ego_of(campaign, seed), opponent)]
    if retrained:
        ego = learned(campaign, f"retrained_{name}", seed)
        stages.append(AssessmentStage(f"retrained_vs_{name}", seed, name, ego, opponent))
        stages.append(AssessmentStage(f"retrained_alone_{name}", seed, name, ego, None))
    return stages


def questions(campaign: Campaign, personas: Sequence[str], tunable: bool = False) -> list[Question]:
    """The research questions of a campaign (paper, section 4.2), for each persona or population and seed; `tunable` as
    in `harness.campaign.plan.plan`."""
    asked = []
    for persona in [*personas, *(each.name for each in campaign.population)]:
        for seed in campaign.seeds:
            against, retrained = f"naive_vs_{persona}", f"retrained_vs_{persona}"
            asked.append(Question("RQ1", persona, seed, "naive_alone", against))
            if campaign.ego.driver == LEARNED:
                asked.append(Question("RQ2", persona, seed, against, retrained))
            elif tunable:
                asked.append(Question("RQ2", persona, seed, against, f"reconfigured_vs_{persona}"))
    return asked
