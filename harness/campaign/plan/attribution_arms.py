"""`[attribution]`: the arms that show which trait of a person makes the naive ego fail.

| arm | the person |
| --- | --- |
| `naive_vs_<persona>` | with all of its traits; an arm of round 1 |
| `naive_vs_<baseline>` | the baseline, trained in round 1 as a persona; `<baseline>_alone` shows whether it can drive |
| `naive_vs_<persona>_with_<trait>_of_<baseline>` | the persona without a trait |
| `naive_vs_<baseline>_with_<trait>_of_<persona>` | the baseline with this trait alone |

Traits are exchanged when the games are played; nothing but the baseline is trained. A person that differs from the
baseline in one trait alone is the baseline without it, and has no arms of its own.
"""

from __future__ import annotations

from dataclasses import replace

from harness.campaign.plan.alone_bounds import alone_bounds
from harness.campaign.plan.stages import AssessmentStage
from harness.campaign.plan.strategy_stages import SeedStages
from harness.config.campaign import Campaign
from harness.config.traits import PersonTraits
from harness.evaluation.competence import ALL_TRAITS, TraitQuestion
from harness.evaluation.strategies import Arm, Borrowed, NaiveEgo, PersonaNonEgo, against_persona, persona_alone


def plan_attribution(of: SeedStages) -> list[AssessmentStage]:
    """The arms of a campaign's attribution for one seed, those of round 1 among them; empty without `[attribution]`."""
    traits = of.traits
    if not traits.baseline:
        return []
    naive, baseline = NaiveEgo(), PersonaNonEgo(persona=traits.baseline)
    people = [
        person
        for persona, differing in traits.differing.items()
        for trait in differing
        for person in _exchanged(persona, trait, traits)
    ]
    alone = of.assessment(persona_alone(traits.baseline), persona=traits.baseline)
    return [alone, *(of.pair(naive, each) for each in dict.fromkeys((baseline, *people)))]


def trait_questions(campaign: Campaign, traits: PersonTraits) -> list[TraitQuestion]:
    """The rows of the table `attribution`: for each persona and seed all traits together, then each by itself."""
    return [
        _question(campaign, traits, persona, trait, seed)
        for persona, differing in traits.differing.items()
        for seed in campaign.seeds
        for trait in (ALL_TRAITS, *differing)
    ]


def _question(campaign: Campaign, traits: PersonTraits, persona: str, trait: str, seed: int) -> TraitQuestion:
    own, baseline = (against_persona(NaiveEgo(), name) for name in (persona, traits.baseline))
    without, alone = baseline.name, ""
    if trait != ALL_TRAITS:
        without, alone = (Arm(ego=NaiveEgo(), non_ego=each).name for each in _exchanged(persona, trait, traits))
    return TraitQuestion(
        persona=persona,
        seed=seed,
        trait=trait,
        arm=own.name,
        without_arm=without,
        baseline_arm=baseline.name,
        alone_arm=alone,
        bounds=alone_bounds(campaign, own, baseline),
    )


def _exchanged(persona: str, trait: str, traits: PersonTraits) -> tuple[PersonaNonEgo, PersonaNonEgo]:
    """A persona with the baseline's value of a trait, and the baseline with the persona's."""
    own, baseline = PersonaNonEgo(persona=persona), PersonaNonEgo(persona=traits.baseline)
    if traits.differing[persona] == (trait,):
        return baseline, own
    without = replace(own, borrowed=Borrowed(trait=trait, of=traits.baseline))
    return without, replace(baseline, borrowed=Borrowed(trait=trait, of=persona))
