"""How much a training may learn: the campaign's budget, that of a best response, or that against several personas."""

from __future__ import annotations

from harness.campaign.plan.planned_drivers import members_of, persona_of
from harness.campaign.plan.stages import TrainingStage
from harness.config.campaign import Campaign
from harness.config.training import Training
from harness.game.roles import EGO


def training_settings(campaign: Campaign, stage: TrainingStage) -> Training:
    """The settings of one training.

    A person has no demonstrator, unless the campaign says so. A best response has a budget of its own. A training
    that meets one of several personas in each game has the budget, and the segment length by which its learning curve
    is judged, times their number.
    """
    settings = campaign.training
    if stage.learner != EGO and not campaign.non_ego_training.imitation:
        settings = settings.model_copy(update={"demonstration_steps": 0})
    if stage.is_best_response:
        assert campaign.best_response is not None
        return settings.model_copy(update={"steps": campaign.best_response.steps})
    personas = max((len({persona_of(each) for each in members_of(driver)}) for driver in stage.opponent), default=1)
    more = {"steps": settings.steps * personas, "segment_steps": settings.segment_steps * personas}
    return settings.model_copy(update=more)
