"""Who met whom in the arms of a plan: what the game's findings are made from."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from harness.campaign.plan.best_responses import arm_responded_in, is_pair
from harness.campaign.plan.iterated_rounds import PAPER_ROUNDS, exchange
from harness.campaign.plan.plan import plan
from harness.campaign.plan.stages import AssessmentStage, Drives, stage_id
from harness.config.campaign import ROBUST, Campaign
from harness.evaluation.game_theory.records import Pairing, Response
from harness.game.state import ROLES

_MADE = ("retrained", "reconfigured")


@dataclass(frozen=True)
class Met:
    """The arms of a campaign as a game between strategies."""

    pairings: Sequence[Pairing]
    responses: Sequence[Response]
    personas_of: Mapping[str, Collection[str]]
    """Of each ego that was retrained or reconfigured the personas against whom it was."""


def who_met(campaign: Campaign, personas: Sequence[str], done: Collection[str], tunable: bool = False) -> Met | None:
    """What of a campaign is a game between strategies, among the stages that are done; None where it plays the paper's
    rounds and nothing more. `tunable` as in `plan`."""
    asks = (campaign.crossplay, campaign.best_response, campaign.retraining.against or None)
    if all(each is None for each in asks) and campaign.rounds.count == PAPER_ROUNDS:
        return None
    arms = [each for each in plan(campaign, personas, tunable) if isinstance(each, AssessmentStage) and each.id in done]
    exchanges = {persona: exchange(campaign, persona, 0, tunable) for persona in personas}
    rounds = {each.name: each.round for found in exchanges.values() for each in (*found.egos, *found.non_egos)}
    return Met(
        [_pairing(arm) for arm in arms if is_pair(arm)],
        [response for arm in arms for response in _responses(arm, arms, rounds)],
        {ROBUST: campaign.retraining.against}
        | {f"{made}_{each.name}": list(each.shares) for made in _MADE for each in campaign.population}
        | {ego.name: [persona] for persona, found in exchanges.items() for ego in found.egos if ego.round},
    )


def _name(drives: Drives, seed: int) -> str:
    if drives.kind == "given":
        return drives.stage or "naive"
    return drives.kind if drives.kind == "sumo" else drives.stage.removesuffix(stage_id("", seed))


def _pairing(arm: AssessmentStage) -> Pairing:
    assert arm.ego is not None
    assert arm.non_ego is not None
    ego = "naive" if arm.arm.startswith("naive_vs_") else _name(arm.ego, arm.seed)
    return Pairing(arm.arm, arm.seed, ego, _name(arm.non_ego, arm.seed), arm.persona)


def _responses(arm: AssessmentStage, arms: Sequence[AssessmentStage], rounds: Mapping[str, int]) -> list[Response]:
    for role, player in zip(ROLES, (arm.ego, arm.non_ego), strict=True):
        if player is not None and player.kind == "best":
            name = arm_responded_in(arm.arm)
            pair = next((_pairing(each) for each in arms if (each.arm, each.seed) == (name, arm.seed)), None)
            if pair is None:
                return []
            last = max(rounds.get(pair.ego, 0), rounds.get(pair.non_ego, 0))
            who = (pair.ego, pair.non_ego)
            return [Response(arm.seed, role, arm.persona, last, pair.arm, arm.arm, *who)]  # type: ignore[arg-type]
    return []
