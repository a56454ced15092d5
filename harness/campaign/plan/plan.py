"""The plan of a campaign: the paper's rounds, the rounds after them, best responses, cross-play and attribution.

`plan` is the only entry: everything else in this package is a part of it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from harness.campaign.plan.attribution_arms import plan_attribution
from harness.campaign.plan.iterated_rounds import PersonaRounds, persona_rounds, plan_best_responses
from harness.campaign.plan.paper_rounds import plan_paper_rounds, plan_robust, plan_searches
from harness.campaign.plan.planned_drivers import Shielded, members_of
from harness.campaign.plan.stages import AssessmentStage, PreventabilityStage, Stage, TrainingStage
from harness.campaign.plan.strategy_stages import SeedStages, crossplay_name, ego_learns, robust_is_last
from harness.config.campaign import Campaign
from harness.config.traits import UNREAD, PersonTraits
from harness.evaluation.strategies import (
    EgoStrategy,
    ErrorFreeEgo,
    OtherEgo,
    OwnEgo,
    PersonaNonEgo,
    ReconfiguredEgo,
    RetrainedEgo,
    RobustEgo,
    RoundAnswer,
    ShieldedEgo,
)
from harness.game.roles import EGO, NON_EGO


def plan(
    campaign: Campaign, personas: Sequence[str], tunable: bool = False, traits: PersonTraits = UNREAD
) -> list[Stage]:
    """Every stage of a campaign with these personas, each after those it needs.

    `tunable`: the campaign's ego is external and has tunable parameters. `traits`: those of the personas. A
    campaign with a folder of policies trains nothing but best responses, and has the player of each round from there:
    nothing is selected.
    """
    seeds = [SeedStages(campaign=campaign, seed=seed, traits=traits) for seed in campaign.seeds]
    stages = list(_with_games_once(stage for of in seeds for stage in _plan_seed(of, personas, tunable)))
    if campaign.policies is not None:
        stages = [each for each in stages if not isinstance(each, TrainingStage) or each.is_best_response]
    return _after_needs(stages)


def _plan_seed(of: SeedStages, personas: Sequence[str], tunable: bool) -> list[Stage]:
    rounds = [persona_rounds(of, persona, tunable) for persona in personas]
    stages = [*plan_paper_rounds(of, personas), *plan_robust(of, personas)]
    stages += plan_searches(of, personas) if tunable else []
    compared = [*_plan_shielded(of.campaign, stages), *_plan_error_free(of.campaign, stages)]
    stages += [stage for each in rounds for stage in each.stages]
    judged = list(stages)
    stages += _plan_crossplay(of, rounds)
    stages += _plan_responses(of, rounds, stages)
    stages += _plan_preventability(of.campaign, judged)
    stages += plan_attribution(of)
    stages += compared
    return list(dict.fromkeys(stages))


def _after_needs(stages: Sequence[Stage]) -> list[Stage]:
    """The stages in their order, but for those of which an earlier one needs something: they come before it."""
    named = {each.id: each for each in stages}
    begun, ordered = set[Stage](), list[Stage]()

    def add(stage: Stage) -> None:
        if stage not in begun:
            begun.add(stage)
            for needed in stage.needs:
                add(named[needed])
            ordered.append(stage)

    for stage in stages:
        add(stage)
    return ordered


def _with_games_once(stages: Iterable[Stage]) -> Iterator[Stage]:
    """The stages, of which an arm without trained players has the games of the first training seed."""
    first = dict[str, str]()
    for stage in stages:
        if isinstance(stage, AssessmentStage) and stage.is_untrained:
            played = first.setdefault(stage.name, stage.id)
            yield stage if played == stage.id else replace(stage, games_of=played)
        else:
            yield stage


def _plan_responses(of: SeedStages, rounds: Sequence[PersonaRounds], stages: Iterable[Stage]) -> list[Stage]:
    """Best responses in the last pair of each persona's rounds, and in the arms that the campaign names."""
    if of.campaign.best_response is None:
        return []
    robust = RobustEgo() if robust_is_last(of.campaign) else None
    last = [of.pair(robust or each.egos[-1], each.non_egos[-1]).name for each in rounds]
    assessments = {stage.name: stage for stage in stages if isinstance(stage, AssessmentStage)}
    names = dict.fromkeys((*last, *of.campaign.best_response.arms))
    pairs = [assessments[name] for name in names if name in assessments and assessments[name].is_pair]
    return [stage for pair in pairs for stage in plan_best_responses(of.campaign, pair)]


def _plan_preventability(campaign: Campaign, stages: Iterable[Stage]) -> list[PreventabilityStage]:
    """The judgement of the failures in each arm of an ego against a persona, but for those of the cross-play alone."""
    if not campaign.assessment.reference_drivers:
        return []
    arms = dict.fromkeys(each for each in stages if isinstance(each, AssessmentStage) and each.persona)
    return [
        PreventabilityStage(seed=each.seed, persona=each.persona, gates=each.gates, of=each)
        for each in arms
        if each.ego and each.non_ego and each.arm.best_response_of is None
    ]


def _plan_shielded(campaign: Campaign, stages: Iterable[Stage]) -> list[AssessmentStage]:
    """Each of these arms of an ego with the campaign's shield, too: the same policy in the same games."""
    rule, found = campaign.ego.shield, []
    for stage, ego in _of_own_egos(stages) if rule is not None else ():
        side = (Shielded(members=members_of(*stage.ego), rule=rule),)  # type: ignore[arg-type]
        found.append(replace(stage, arm=replace(stage.arm, ego=ShieldedEgo(of=ego)), ego=side))
    return found


def _plan_error_free(campaign: Campaign, stages: Iterable[Stage]) -> list[AssessmentStage]:
    """Each of these arms of an ego without the campaign's perception errors, too: the same policy in the same games."""
    own = _of_own_egos(stages) if campaign.ego.perception is not None else ()
    return [replace(stage, arm=replace(stage.arm, ego=ErrorFreeEgo(of=ego))) for stage, ego in own]


def _of_own_egos(stages: Iterable[Stage]) -> Iterator[tuple[AssessmentStage, OwnEgo]]:
    """The arms with an ego of the campaign among the stages, each with this ego."""
    for stage in stages:
        if isinstance(stage, AssessmentStage) and isinstance(stage.arm.ego, OwnEgo):
            yield stage, stage.arm.ego


def _plan_crossplay(of: SeedStages, rounds: Sequence[PersonaRounds]) -> list[AssessmentStage]:
    if of.campaign.crossplay is None:
        return []
    egos = dict.fromkeys(ego for each in rounds for ego in each.egos)
    egos |= dict.fromkeys(_egos_of_no_persona(of.campaign, has_round_2=len(egos) > 1))
    egos |= dict.fromkeys(answer for each in rounds for answer in each.rejected(EGO))
    non_egos: list[PersonaNonEgo | RoundAnswer] = [non_ego for each in rounds for non_ego in each.non_egos]
    non_egos += [answer for each in rounds for answer in each.rejected(NON_EGO)]
    return [of.pair(ego, non_ego) for ego in egos for non_ego in non_egos]


def _egos_of_no_persona(campaign: Campaign, has_round_2: bool) -> list[EgoStrategy]:
    """The egos that belong to no single persona: of populations, of several personas, or from outside."""
    round_2 = RetrainedEgo if ego_learns(campaign) else ReconfiguredEgo
    strategies: list[EgoStrategy] = []
    strategies += [round_2(against=each) for each in campaign.mixed_people] if has_round_2 else []
    strategies += [RobustEgo()] if ego_learns(campaign) and campaign.retraining.against else []
    written = campaign.crossplay.egos if campaign.crossplay is not None else []
    return strategies + [OtherEgo(driver=crossplay_name(each)) for each in written]
