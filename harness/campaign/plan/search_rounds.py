"""Round 2 of an external ego with tunable parameters: a search against each persona and population.

`reconfigured_<persona>` and its arms replace `retrained_<persona>` and its arms of an ego that learns.
"""

from __future__ import annotations

from collections.abc import Sequence

from harness.campaign.plan.paper_rounds import round_2_arms
from harness.campaign.plan.stages import SearchStage, Stage
from harness.campaign.plan.strategy_drivers import driver_of, mixed_people
from harness.config.campaign import Campaign
from harness.evaluation.strategies import PersonaNonEgo, ReconfiguredEgo


def plan_searches(campaign: Campaign, personas: Sequence[str], seed: int) -> list[Stage]:
    """The stages of round 2 for one training seed, each after those it needs."""
    opponents = {persona: driver_of(campaign, PersonaNonEgo(persona=persona), seed) for persona in personas}
    stages: list[Stage] = []
    for name, opponent in {**opponents, **mixed_people(campaign, seed)}.items():
        stages.append(SearchStage(seed=seed, persona=name, opponent=opponent))
        stages += round_2_arms(campaign, ReconfiguredEgo(against=name), opponent, seed)
    return stages
