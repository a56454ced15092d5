"""The arms in which the players of a campaign drive without people, and what they have to achieve there."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from harness.config.campaign import LEARNED, Campaign, ego_called
from harness.evaluation.competence import AloneBound
from harness.evaluation.strategies import (
    NAIVE_VS_SUMO,
    Arm,
    BestResponse,
    EgoStrategy,
    ErrorFreeEgo,
    ManyPersonas,
    NaiveEgo,
    OtherEgo,
    PersonaNonEgo,
    ReconfiguredEgo,
    RetrainedEgo,
    RoundAnswer,
    ShieldedEgo,
    Strategy,
    SumoNonEgo,
    strategy_name,
)

BESIDE_SUMO = "beside an ordinary road user"


def alone_bounds(campaign: Campaign, *arms: Arm) -> tuple[AloneBound, ...]:
    """What the players of these arms have to achieve alone, each once.

    A naive ego that learned beside SUMO's driver is asked the same beside this driver. A population or crowd stands for
    its members. SUMO's own driver as non-ego, the further egos of a cross-play and rejected answers have no arm alone.
    A shielded ego is judged by the one without its shield, and one without perception errors by the one with them:
    nothing is asked of them. A best response is a change of a player's strategy: its arm asks what the pair asks.
    """
    found = [
        bound
        for arm in arms
        for strategy in (arm.ego, arm.non_ego)
        if strategy is not None
        for bound in bounds_of(campaign, strategy)
    ]
    return tuple(dict.fromkeys(found))


def bounds_of(campaign: Campaign, strategy: Strategy) -> Iterator[AloneBound]:
    """What the player of a strategy has to achieve alone; none of a best response, an answer, and several personas.

    A best response is trained in games with its opponent only. It is the answer to one opponent, and not a driver for
    the empty road. An answer of a later round is judged by its selection, and the player that goes on by its arm alone.
    Of several personas that learned together, each is judged by its own policy.
    """
    asked = campaign.competence
    match strategy:
        case SumoNonEgo() | OtherEgo() | ShieldedEgo() | ErrorFreeEgo():
            return
        case BestResponse() | RoundAnswer() | ManyPersonas():
            return
        case PersonaNonEgo(persona=persona):
            mixed = campaign.mixed_people.get(persona, ())
            members = [PersonaNonEgo(persona=each) for shares in mixed for each in shares]
            for non_ego in dict.fromkeys(members or [strategy]):
                words, arm = f"the {strategy_name(non_ego)} driver", Arm(non_ego=non_ego).name
                yield AloneBound(player="non_ego", words=words, arm=arm, goal_share=asked.non_ego_goal_share)
        case _:
            words, arm = _ego_in_words(strategy, campaign.ego.driver), Arm(ego=strategy).name
            alone = AloneBound(player="ego", words=words, arm=arm, goal_share=asked.ego_goal_share)
            yield alone
            learned = campaign.ego.driver == LEARNED and campaign.naive_training.alone_share < 1.0
            if learned and isinstance(strategy, NaiveEgo):
                yield replace(alone, arm=NAIVE_VS_SUMO.name, where=BESIDE_SUMO)


def _ego_in_words(strategy: EgoStrategy, driver: str) -> str:
    match strategy:
        case NaiveEgo():
            return f"the {ego_called(driver)}"
        case RetrainedEgo(round=2):
            return "the retrained ego"
        case ReconfiguredEgo():
            return "the reconfigured ego"
        case _:
            return f"the ego {strategy_name(strategy)}"
