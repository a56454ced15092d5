"""Best responses (equation 2 of the paper): how much can a player gain by changing its strategy alone?

For an arm, each player in turn learns again against the other player, which stays fixed, from several starts: first
from its own present policy, then from nothing. The best of these trainings is chosen by games that are played for this
choice alone, so that its gain in the arm's own games is not due to having been chosen by them.
"""

from __future__ import annotations

from dataclasses import replace

from harness.campaign.plan.alone_bounds import alone_bounds
from harness.campaign.plan.stages import (
    AssessmentStage,
    BestOf,
    EquilibriumGate,
    Stage,
    Trained,
    TrainedBefore,
    TrainingStage,
    persona_of,
    stage_id,
)
from harness.config.campaign import Campaign
from harness.config.training import ATTENTIVE_SHARE
from harness.evaluation.strategies import BestResponse
from harness.game.roles import EGO, NON_EGO


def plan_best_responses(campaign: Campaign, pair: AssessmentStage) -> list[Stage]:
    """The stages that measure how much each player of a pair can still gain: trainings, and an arm for each player."""
    return [stage for learner in (EGO, NON_EGO) for stage in _plan_response(campaign, pair, learner)]


def gate_of(campaign: Campaign, pair: AssessmentStage) -> EquilibriumGate:
    """The gate behind which there is nothing to do when neither player of a pair gains anything, and both can drive."""
    responses = (replace(pair.arm, best_response_of=learner) for learner in (EGO, NON_EGO))
    ego, non_ego = (stage_id(arm.name, pair.seed) for arm in responses)
    bounds = tuple(each for each in alone_bounds(campaign, pair.arm) if each.goal_share > 0)
    alone = tuple(stage_id(each.arm, pair.seed) for each in bounds)
    return EquilibriumGate(pair=pair.id, ego_response=ego, non_ego_response=non_ego, alone=alone, bounds=bounds)


def _plan_response(campaign: Campaign, pair: AssessmentStage, learner: int) -> list[Stage]:
    assert campaign.best_response is not None
    arm = replace(pair.arm, best_response_of=learner)
    (own,), other = pair.sides[learner], pair.sides[1 - learner]
    trainings = []
    for start in range(1, campaign.best_response.starts + 1):
        initial = own if start == 1 and isinstance(own, Trained | TrainedBefore) else None
        from_nothing = learner == NON_EGO and initial is None
        trainings.append(
            TrainingStage(
                seed=pair.seed,
                persona=pair.persona,
                strategy=BestResponse(arm=arm, start=start),
                opponent=other,
                initial=initial,
                alone_share=0.0,
                attentive_share=ATTENTIVE_SHARE if from_nothing else 0.0,
                gates=pair.gates,
            )
        )
    persona = persona_of(own)
    best = BestOf(members=tuple(Trained(stage=each.id, persona=persona) for each in trainings), persona=persona)
    ego, non_ego = ((best,), other) if learner == EGO else (other, (best,))
    return [*trainings, replace(pair, arm=arm, ego=ego, non_ego=non_ego)]
