"""The paper's rounds 0 to 2: which trainings, searches and arms follow from a campaign, for one training seed.

| round | stages |
| --- | --- |
| 0 | train `naive`; assess `naive_alone`, `naive_vs_sumo` |
| 1 | for each persona: train `<persona>` against the naive ego; assess `<persona>_alone`, `naive_vs_<persona>` |
| 2 | for each persona: train `retrained_<persona>`; assess `retrained_vs_<persona>`, `retrained_alone_<persona>` |

A population or crowd is an opponent like a persona, but its members are trained as personas. `robust` is the ego
retrained against several personas at once. Round 2 of an external ego is a parameter search (`search_rounds`), if it
has tunable parameters. A campaign with a folder of policies has the same arms and no trainings.

On a scene with several people, a persona drives all of them (`naive_vs_<persona>`, `retrained_vs_<persona>`), and one
at a time without the ego (`<persona>_alone`); in a crowd, each has a persona of its own.
"""

from __future__ import annotations

from collections.abc import Sequence

from harness.campaign.plan.competence import alone_bounds
from harness.campaign.plan.planned_drivers import PlannedDriver
from harness.campaign.plan.stages import AssessmentStage, Stage, TrainingStage
from harness.campaign.plan.strategy_drivers import (
    driver_of,
    ego_learns,
    mixed_people,
    population_driver,
    warm_start,
)
from harness.config.campaign import Campaign
from harness.config.training import ATTENTIVE_SHARE
from harness.evaluation.research_questions import Question, ResearchQuestion
from harness.evaluation.strategies import (
    Arm,
    EgoStrategy,
    NaiveEgo,
    PersonaNonEgo,
    ReconfiguredEgo,
    RetrainedEgo,
    RobustEgo,
    SumoNonEgo,
)


def plan_paper_rounds(campaign: Campaign, personas: Sequence[str], seed: int) -> list[Stage]:
    """The stages of rounds 0 to 2, each after those it needs."""
    naive = driver_of(campaign, NaiveEgo(), seed)
    stages: list[Stage] = []
    if ego_learns(campaign):
        stages.append(_naive_training(campaign, seed))
    stages += [_persona_training(campaign, persona, naive, seed) for persona in personas]
    stages.append(AssessmentStage(seed=seed, persona="", arm=Arm(ego=NaiveEgo()), ego=naive, non_ego=None))
    sumo = SumoNonEgo()
    stages.append(
        AssessmentStage(
            seed=seed,
            persona="",
            arm=Arm(ego=NaiveEgo(), non_ego=sumo),
            ego=naive,
            non_ego=driver_of(campaign, sumo, seed),
        )
    )
    for persona in personas:
        non_ego = PersonaNonEgo(persona=persona)
        driver = driver_of(campaign, non_ego, seed)
        stages += _retrainings(campaign, persona, driver, seed)
        stages.append(AssessmentStage(seed=seed, persona=persona, arm=Arm(non_ego=non_ego), ego=None, non_ego=driver))
        stages += _ego_arms(campaign, persona, driver, seed)
    for name, people in mixed_people(campaign, seed).items():
        stages += _retrainings(campaign, name, people, seed)
        stages += _ego_arms(campaign, name, people, seed)
    return stages


def plan_robust(campaign: Campaign, personas: Sequence[str], seed: int) -> list[Stage]:
    """The ego retrained against several personas at once, and its arms against all personas of the campaign."""
    against = campaign.retraining.against
    if not against or not ego_learns(campaign):
        return []
    people = population_driver(campaign, dict.fromkeys(against, 1.0), seed)
    robust = driver_of(campaign, RobustEgo(), seed)
    stages: list[Stage] = [_retraining(campaign, RobustEgo(), "", people, seed)]
    stages.append(AssessmentStage(seed=seed, persona="", arm=Arm(ego=RobustEgo()), ego=robust, non_ego=None))
    for persona in personas:
        non_ego = PersonaNonEgo(persona=persona)
        stages.append(
            AssessmentStage(
                seed=seed,
                persona=persona,
                arm=Arm(ego=RobustEgo(), non_ego=non_ego),
                ego=robust,
                non_ego=driver_of(campaign, non_ego, seed),
            )
        )
    return stages


def _naive_training(campaign: Campaign, seed: int) -> TrainingStage:
    alone_share = campaign.naive_training.alone_share
    opponent = driver_of(campaign, SumoNonEgo(), seed) if alone_share < 1.0 else None
    return TrainingStage(
        seed=seed, persona="", strategy=NaiveEgo(), opponent=opponent, initial=None, alone_share=alone_share
    )


def _persona_training(campaign: Campaign, persona: str, naive: PlannedDriver, seed: int) -> TrainingStage:
    return TrainingStage(
        seed=seed,
        persona=persona,
        strategy=PersonaNonEgo(persona=persona),
        opponent=naive,
        initial=None,
        alone_share=campaign.non_ego_training.alone_share,
        attentive_share=ATTENTIVE_SHARE,
    )


def _retraining(
    campaign: Campaign, strategy: EgoStrategy, persona: str, opponent: PlannedDriver, seed: int
) -> TrainingStage:
    settings = campaign.retraining
    return TrainingStage(
        seed=seed,
        persona=persona,
        strategy=strategy,
        opponent=opponent,
        initial=warm_start(campaign, seed),
        alone_share=settings.alone_share,
    )


def _retrainings(campaign: Campaign, name: str, opponent: PlannedDriver, seed: int) -> list[TrainingStage]:
    """The retraining against a persona or population, if the ego learns."""
    if not ego_learns(campaign):
        return []
    return [_retraining(campaign, RetrainedEgo(against=name), name, opponent, seed)]


def _ego_arms(campaign: Campaign, name: str, opponent: PlannedDriver, seed: int) -> list[AssessmentStage]:
    """The arms of the ego against a persona or population, before and after retraining."""
    non_ego = PersonaNonEgo(persona=name)
    naive = driver_of(campaign, NaiveEgo(), seed)
    arm = Arm(ego=NaiveEgo(), non_ego=non_ego)
    arms = [AssessmentStage(seed=seed, persona=name, arm=arm, ego=naive, non_ego=opponent)]
    return arms + (round_2_arms(campaign, RetrainedEgo(against=name), opponent, seed) if ego_learns(campaign) else [])


def round_2_arms(
    campaign: Campaign, ego: RetrainedEgo | ReconfiguredEgo, opponent: PlannedDriver, seed: int
) -> list[AssessmentStage]:
    """The arms of the ego of round 2: against the persona or population of its round, and alone."""
    driver, non_ego = driver_of(campaign, ego, seed), PersonaNonEgo(persona=ego.against)
    against = Arm(ego=ego, non_ego=non_ego)
    return [
        AssessmentStage(seed=seed, persona=ego.against, arm=against, ego=driver, non_ego=opponent),
        AssessmentStage(seed=seed, persona=ego.against, arm=Arm(ego=ego), ego=driver, non_ego=None),
    ]


def questions(campaign: Campaign, personas: Sequence[str], tunable: bool = False) -> list[Question]:
    """The research questions (paper, section 4.2) for each persona or population and seed; `tunable` as in `plan`."""
    asked = []
    for name in [*personas, *campaign.mixed_people]:
        non_ego = PersonaNonEgo(persona=name)
        naive_alone, naive = Arm(ego=NaiveEgo()), Arm(ego=NaiveEgo(), non_ego=non_ego)
        pairs: list[tuple[ResearchQuestion, Arm, Arm]] = [("RQ1", naive_alone, naive)]
        if ego_learns(campaign):
            pairs.append(("RQ2", naive, Arm(ego=RetrainedEgo(against=name), non_ego=non_ego)))
        elif tunable:
            pairs.append(("RQ2", naive, Arm(ego=ReconfiguredEgo(against=name), non_ego=non_ego)))
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
