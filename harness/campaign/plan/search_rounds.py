"""Round 2 of an ego that is given and has something to tune: a search against each persona and population.

`reconfigured_<persona>` and its arms have the place that `retrained_<persona>` and its have for an ego that learns.
"""

from __future__ import annotations

from collections.abc import Sequence

from harness.campaign.plan.paper_rounds import learned, population
from harness.campaign.plan.stages import AssessmentStage, Drives, ReconfigurationStage, Stage, stage_id
from harness.config.campaign import Campaign


def reconfigured(name: str, seed: int) -> Drives:
    """The given ego as it was reconfigured against a persona or population of this name."""
    return Drives("reconfigured", stage_id(f"reconfigured_{name}", seed))


def plan_searches(campaign: Campaign, personas: Sequence[str], seed: int) -> list[Stage]:
    """The stages of round 2 for one seed, each after what it needs."""
    people = {persona: learned(campaign, persona, seed, persona) for persona in personas}
    people |= {each.name: population(campaign, each.shares, seed) for each in campaign.population}
    stages: list[Stage] = []
    for name, opponent in people.items():
        ego = reconfigured(name, seed)
        stages.append(ReconfigurationStage(f"reconfigured_{name}", seed, name, opponent))
        stages.append(AssessmentStage(f"reconfigured_vs_{name}", seed, name, ego, opponent))
        stages.append(AssessmentStage(f"reconfigured_alone_{name}", seed, name, ego, None))
    return stages
