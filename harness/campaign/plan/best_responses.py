"""Best responses (equation 2 of the paper): could a player gain by changing its strategy alone?

In an arm each player in turn learns anew against the other held fixed, from several starts: first from its own present
policy, the others from nothing. Which of them is its best response is decided by games played for that choice alone,
so that what it gains in the arm's own games is not the luck of having been chosen by them.
"""

from __future__ import annotations

from harness.campaign.plan.stages import AssessmentStage, Drives, Stage, TrainingStage, stage_id
from harness.config.campaign import Campaign, Training
from harness.game.state import EGO, NON_EGO, ROLES


def is_pair(stage: AssessmentStage) -> bool:
    """Whether an arm is of an ego and a person, each of whom always drives alike: one of several has no payoff to
    gain by, and SUMO's own driver none at all."""
    players = (stage.ego, stage.non_ego)
    return bool(stage.persona) and all(each is not None and each.kind not in ("mixture", "best") for each in players)


def plan_responses(campaign: Campaign, pair: AssessmentStage) -> list[Stage]:
    """The stages that measure how much each player of an arm could still gain."""
    how = campaign.best_response
    assert how is not None
    assert pair.ego is not None
    assert pair.non_ego is not None
    stages: list[Stage] = []
    for learner, own, other in ((EGO, pair.ego, pair.non_ego), (NON_EGO, pair.non_ego, pair.ego)):
        name = response_arm(pair.arm, learner)
        found = []
        for start in range(1, how.starts + 1):
            begins = start == 1 and own.kind in ("policy", "before")
            attentive = campaign.non_ego_training.attentive_share if learner == NON_EGO and not begins else 0.0
            training = TrainingStage(
                f"{name}{start}",
                pair.seed,
                pair.persona,
                learner,
                other,
                own.stage if begins and own.kind == "policy" else None,
                0.0,
                attentive,
                responds_in=(pair.arm,),
                begins_as=(own.stage,) if begins and own.kind == "before" else (),
                unless=pair.unless,
            )
            stages.append(training)
            found.append(Drives("policy", training.id, own.persona))
        best = Drives("best", members=tuple(found), persona=own.persona)
        ego, non_ego = (best, other) if learner == EGO else (other, best)
        stages.append(AssessmentStage(name, pair.seed, pair.persona, ego, non_ego, pair.unless))
    return stages


def response_arms(pair: str, seed: int) -> tuple[str, str]:
    """The stages of the arms in which the ego's and the non-ego's best responses replace them."""
    return stage_id(response_arm(pair, EGO), seed), stage_id(response_arm(pair, NON_EGO), seed)


def response_arm(pair: str, learner: int) -> str:
    """What the arm is called in which a player's best response replaces it."""
    return f"{pair}_{ROLES[learner]}_response"


def arm_responded_in(name: str) -> str:
    """The arm that such an arm is called after."""
    endings = [response_arm("", learner) for learner in (NON_EGO, EGO)]  # the longer one first: it ends like the other
    return next(name.removesuffix(ending) for ending in endings if name.endswith(ending))


def settings_of(campaign: Campaign, stage: TrainingStage) -> Training:
    """How a stage learns: a best response has a budget of its own, and who meets several people has for each the
    budget, and in each segment by which its curve is judged the games, of a training against that one alone."""
    if stage.responds_in:
        assert campaign.best_response is not None
        return campaign.training.model_copy(update={"steps": campaign.best_response.steps})
    met = len({each.persona for each in stage.opponent.everyone}) if stage.opponent is not None else 1
    settings = campaign.training
    more = {"steps": settings.steps * met, "segment_steps": settings.segment_steps * met}
    return settings.model_copy(update=more) if met > 1 else settings
