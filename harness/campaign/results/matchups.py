"""Which strategy meets which in the arms of a plan: what the findings of game theory are made from."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

from harness.campaign.plan.alone_bounds import alone_bounds
from harness.campaign.plan.plan import plan
from harness.campaign.plan.stages import AssessmentStage
from harness.config.campaign import Campaign
from harness.evaluation.game_theory.best_response_gap import Response
from harness.evaluation.game_theory.crossplay import Pairing
from harness.evaluation.strategies import (
    PAPER_ROUNDS,
    Arm,
    EgoStrategy,
    NonEgoStrategy,
    PersonaNonEgo,
    ReconfiguredEgo,
    RetrainedEgo,
    RobustEgo,
    RoundAnswer,
    SumoNonEgo,
    round_of,
    strategy_name,
)
from harness.game.roles import ROLES


@dataclass(frozen=True, kw_only=True)
class Matchups:
    """The arms of a campaign as a game between strategies."""

    pairings: Sequence[Pairing]
    responses: Sequence[Response]
    training_personas: Mapping[str, Collection[str]]
    """By ego of round 2 or later: the personas against which it was retrained or reconfigured."""


def matchups_of(
    campaign: Campaign, personas: Sequence[str], done: Collection[str], tunable: bool = False
) -> Matchups | None:
    """The game between strategies, of the stages that are done. `tunable` as in `plan`.

    None for a campaign that plays the paper's rounds and nothing more.
    """
    extras = (campaign.crossplay, campaign.best_response, campaign.retraining.against or None)
    if all(each is None for each in extras) and campaign.rounds.count <= PAPER_ROUNDS:
        return None
    stages = plan(campaign, personas, tunable)
    arms = [each for each in stages if isinstance(each, AssessmentStage) and each.id in done]
    return Matchups(
        pairings=[_pairing(campaign, arm) for arm in arms if arm.is_pair],
        responses=_responses(campaign, arms),
        training_personas=_training_personas(campaign, arms),
    )


def _pairing(campaign: Campaign, stage: AssessmentStage) -> Pairing:
    ego, non_ego = _pair(stage.arm)
    return Pairing(
        arm=stage.name,
        seed=stage.seed,
        ego=strategy_name(ego),
        non_ego=strategy_name(non_ego),
        persona=stage.persona,
        alone=alone_bounds(campaign, stage.arm),
    )


def _pair(arm: Arm) -> tuple[EgoStrategy, NonEgoStrategy]:
    assert arm.ego is not None
    assert arm.non_ego is not None
    return arm.ego, arm.non_ego


def _responses(campaign: Campaign, stages: Sequence[AssessmentStage]) -> list[Response]:
    """The arms in which a best response replaces a player, of pairs that are done too."""
    done = {(stage.arm, stage.seed) for stage in stages}
    search, found = campaign.best_response, []
    for stage in stages:
        arm = stage.arm
        if search is None or arm.best_response_of is None or (arm.pair, stage.seed) not in done:
            continue
        ego, non_ego = _pair(arm)
        found.append(
            Response(
                seed=stage.seed,
                role=ROLES[arm.best_response_of],  # type: ignore[arg-type]
                persona=stage.persona,
                round=max(round_of(ego), round_of(non_ego)),
                pair_arm=arm.pair.name,
                response_arm=stage.name,
                ego=strategy_name(ego),
                non_ego=strategy_name(non_ego),
                search_steps=search.steps,
                search_starts=search.starts,
                known_arms=_known_arms(stage, stages),
                alone=alone_bounds(campaign, arm.pair),
            )
        )
    return found


def _known_arms(response: AssessmentStage, stages: Sequence[AssessmentStage]) -> dict[str, str]:
    """By the name of another strategy of the player that the response replaces: the arm in which it meets the same
    other player, with the same payoff. A best response is named after its arm."""
    learner, pair = response.arm.best_response_of, _pair(response.arm)
    assert learner is not None
    own, other = pair[learner], pair[1 - learner]
    known = {}
    for stage in stages:
        arm = stage.arm
        if stage.seed != response.seed or not all(stage.sides) or arm.best_response_of not in (None, learner):
            continue
        strategy, met = _pair(arm)[learner], _pair(arm)[1 - learner]
        if met == other and strategy != own and _same_payoff(strategy, own):
            known[strategy_name(strategy) if arm.best_response_of is None else arm.name] = arm.name
    return known


def _same_payoff(one: EgoStrategy | NonEgoStrategy, other: EgoStrategy | NonEgoStrategy) -> bool:
    """Whether two strategies of a player have one payoff: those of egos, or of one person in several rounds."""
    one, other = (each.of if isinstance(each, RoundAnswer) else each for each in (one, other))
    match one, other:
        case PersonaNonEgo(round=round_), PersonaNonEgo():
            return one == replace(other, round=round_)
        case _:
            return SumoNonEgo() not in (one, other)


def _training_personas(campaign: Campaign, stages: Sequence[AssessmentStage]) -> dict[str, list[str]]:
    members = {each.name: list(each.shares) for each in campaign.population}
    found = {strategy_name(RobustEgo()): list(campaign.retraining.against)}
    for stage in stages:
        if isinstance(ego := stage.arm.ego, RetrainedEgo | ReconfiguredEgo):
            found[strategy_name(ego)] = members.get(ego.against, [ego.against])
    return found
