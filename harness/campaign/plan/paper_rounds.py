"""The paper's rounds 0 to 2: which trainings, searches and arms follow from a campaign, for one training seed.

| round | stages |
| --- | --- |
| 0 | train `naive`; assess `naive_alone`, `naive_vs_sumo` |
| 1 | for each persona: train `<persona>` against the naive ego; assess `<persona>_alone`, `naive_vs_<persona>` |
| 2 | for each persona: train `retrained_<persona>`; assess `retrained_vs_<persona>`, `retrained_alone_<persona>` |

The baseline of `[attribution]` is trained in round 1 as a persona is (`attribution_arms` has its arms).

A persona drives in every place of the non-egos, and in one at a time without the ego (`<persona>_alone`). A persona
with `[attention]` is also assessed alone with its eyes on the road (`<persona>_attentive_alone`). A population or crowd
is an opponent like a persona, but its members are trained as personas. `robust` is the ego retrained against
several personas at once. Round 2 of an external ego is a parameter search, if it has tunable parameters. A campaign
with a folder of policies has the same arms and no trainings.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from harness.campaign.plan.alone_bounds import alone_bounds
from harness.campaign.plan.stages import AssessmentStage, SearchStage, Stage, TrainingStage
from harness.campaign.plan.strategy_stages import SeedStages, ego_learns, has_round_2, robust_is_last
from harness.config.campaign import Campaign
from harness.evaluation.competence import Question, ResearchQuestion
from harness.evaluation.planned_tests import About, PlannedTest
from harness.evaluation.strategies import (
    ATTENTIVE,
    NAIVE_ALONE,
    NAIVE_VS_SUMO,
    Arm,
    NaiveEgo,
    PersonaNonEgo,
    ReconfiguredEgo,
    RetrainedEgo,
    RobustEgo,
    SumoNonEgo,
    against_persona,
    persona_alone,
)
from harness.wording import counted


def plan_paper_rounds(of: SeedStages, personas: Sequence[str]) -> list[Stage]:
    """The stages of rounds 0 to 2, each after those it needs."""
    learns, alone_share = ego_learns(of.campaign), of.campaign.naive_training.alone_share
    learns_again = learns and has_round_2(of.campaign)
    stages: list[Stage] = []
    if learns:
        beside = of.side(SumoNonEgo()) if alone_share < 1.0 else ()
        naive = NaiveEgo()
        stages.append(
            TrainingStage(
                seed=of.seed, persona="", strategy=naive, opponent=beside, initial=None, alone_share=alone_share
            )
        )
    trained = dict.fromkeys(filter(None, (*personas, of.traits.baseline)))
    stages += of.people(tuple(trained))
    stages += [of.assessment(NAIVE_ALONE), of.assessment(NAIVE_VS_SUMO)]
    for name in (*personas, *of.campaign.mixed_people):
        retrained = RetrainedEgo(against=name)
        if learns_again:
            stages.append(of.training(retrained, of.side(PersonaNonEgo(persona=name)), persona=name))
        if name in personas:
            stages.append(of.assessment(persona_alone(name), persona=name))
        if name in of.traits.lapsing:
            stages.append(of.assessment(persona_alone(name, ATTENTIVE), persona=name))
        stages.append(of.assessment(against_persona(NaiveEgo(), name), persona=name))
        stages += _round_2_arms(of, retrained) if learns_again else []
    return stages


def plan_robust(of: SeedStages, personas: Sequence[str]) -> list[Stage]:
    """The ego retrained against several personas at once, and its arms against SUMO's driver and all personas."""
    against = of.campaign.retraining.against
    if not against or not ego_learns(of.campaign):
        return []
    stages: list[Stage] = [of.training(RobustEgo(), (of.robust_opponent(against),))]
    stages += [of.assessment(Arm(ego=RobustEgo(), non_ego=other)) for other in (None, SumoNonEgo())]
    return stages + [of.assessment(against_persona(RobustEgo(), name), persona=name) for name in personas]


def plan_searches(of: SeedStages, personas: Sequence[str]) -> list[Stage]:
    """Round 2 of an external ego with tunable parameters: a search against each persona, population and crowd."""
    stages: list[Stage] = []
    for name in (*personas, *of.campaign.mixed_people):
        stages.append(SearchStage(seed=of.seed, persona=name, opponent=of.side(PersonaNonEgo(persona=name))))
        stages += _round_2_arms(of, ReconfiguredEgo(against=name))
    return stages


def _round_2_arms(of: SeedStages, ego: RetrainedEgo | ReconfiguredEgo) -> list[AssessmentStage]:
    """The arms of the ego of round 2: against the persona, population or crowd of its round, and alone."""
    arms = against_persona(ego, ego.against), Arm(ego=ego)
    return [of.assessment(arm, persona=ego.against) for arm in arms]


def questions(campaign: Campaign, personas: Sequence[str], tunable: bool = False) -> list[Question]:
    """The research questions (paper, section 4.2) for each persona or population and seed; `tunable` as in `plan`. The
    second one is about the ego retrained against the persona; without one, about that retrained against several."""
    asked = []
    for name in [*personas, *campaign.mixed_people]:
        naive = against_persona(NaiveEgo(), name)
        pairs: list[tuple[ResearchQuestion, Arm, Arm]] = [("RQ1", NAIVE_ALONE, naive)]
        if ego_learns(campaign) and has_round_2(campaign):
            pairs.append(("RQ2", naive, against_persona(RetrainedEgo(against=name), name)))
        elif robust_is_last(campaign) and name in personas:
            pairs.append(("RQ2", naive, against_persona(RobustEgo(), name)))
        elif tunable:
            pairs.append(("RQ2", naive, against_persona(ReconfiguredEgo(against=name), name)))
        asked += [
            Question(
                question=question,
                persona=name,
                seed=seed,
                baseline=baseline.name,
                treatment=treatment.name,
                alone=alone_bounds(campaign, baseline, treatment),
            )
            for seed in campaign.seeds
            for question, baseline, treatment in pairs
        ]
    return asked


def family_lines(families: Mapping[About, Sequence[PlannedTest]]) -> Iterator[str]:
    """A line for each family of Holm's correction: its tests, and their training seeds."""
    for about, tests in families.items():
        named = ", ".join(dict.fromkeys(f"{test[0].question} {test[0].persona}" for test in tests))
        seeds = list(dict.fromkeys(str(asked.seed) for test in tests for asked in test))
        each = "each by itself" if len(tests[0]) == 1 else "together"
        trainings = f"training seeds {', '.join(seeds)} {each}" if len(seeds) > 1 else f"training seed {seeds[0]}"
        yield f"Holm's correction over {counted(len(tests), 'test')} about {about.value}: {named} ({trainings})"


def family_records(families: Mapping[About, Sequence[PlannedTest]]) -> list[dict[str, object]]:
    """A record for each family, as `family_lines` tells it."""
    return [{"about": about.value, "tests": list(map(_record, tests))} for about, tests in families.items()]


def _record(test: PlannedTest) -> dict[str, object]:
    return {"question": test[0].question, "persona": test[0].persona, "seeds": [asked.seed for asked in test]}
