"""Each arm of a campaign in words: who drives with whom."""

from __future__ import annotations

from dataclasses import replace

from harness.config.traits import TRAITS
from harness.evaluation.strategies import (
    ATTENTIVE,
    Arm,
    Borrowed,
    EgoStrategy,
    ErrorFreeEgo,
    NaiveEgo,
    NonEgoStrategy,
    PersonaNonEgo,
    ReconfiguredEgo,
    RetrainedEgo,
    RoundAnswer,
    ShieldedEgo,
    SumoNonEgo,
    strategy_name,
)
from harness.reports.run_tables import RunTables


def glossary(tables: RunTables) -> list[tuple[str, str]]:
    """Each arm of the summary that is planned, and what it pairs."""
    return [
        (name, _in_words(tables.arms[name], tables)) for name in tables.summary["arm"].unique() if name in tables.arms
    ]


def _in_words(arm: Arm, tables: RunTables) -> str:
    if arm.best_response_of is not None:
        player = ("the ego", "the non-ego")[arm.best_response_of]
        return f"{arm.pair.name}, {player} replaced by its best response"
    match arm:
        case Arm(ego=ShieldedEgo(of=of)):
            return f"{_in_words(replace(arm, ego=of), tables)}; the ego has a shield"
        case Arm(ego=ErrorFreeEgo(of=of)):
            return f"{_in_words(replace(arm, ego=of), tables)}; the ego has no perception errors"
        case Arm(ego=None, non_ego=non_ego) if non_ego is not None:
            return f"{_non_ego_in_words(non_ego)} without the ego"
        case Arm(ego=NaiveEgo(), non_ego=None):
            return f"the {tables.naive} on the road without the non-ego"
        case Arm(ego=ego, non_ego=None) if ego is not None:
            return f"{_ego_in_words(ego, tables.naive)}, without the non-ego"
        case Arm(ego=NaiveEgo(), non_ego=SumoNonEgo()):
            return f"the {tables.naive} with an ordinary {tables.person} in the non-ego's place"
        case Arm(ego=RetrainedEgo(against=against) | ReconfiguredEgo(against=against) as ego, non_ego=non_ego) if (
            non_ego is not None and against == strategy_name(non_ego)
        ):
            same = tables.who(against).removeprefix("the ") or against
            return f"{_ego_in_words(ego, tables.naive)}, against the same {same}"
        case Arm(ego=ego, non_ego=non_ego) if ego is not None and non_ego is not None:
            person = tables.who(strategy_name(non_ego)) or _non_ego_in_words(non_ego)
            return f"{_ego_in_words(ego, tables.naive)} against {person}"
    raise ValueError("an arm has at least one player")


def _non_ego_in_words(non_ego: NonEgoStrategy) -> str:
    match non_ego:
        case PersonaNonEgo(persona=persona, borrowed=borrowed) if borrowed == ATTENTIVE:
            return f"the non-ego {persona} with its eyes on the road"
        case PersonaNonEgo(persona=persona, borrowed=Borrowed(trait=trait, of=of)):
            return f"the non-ego {persona} with the {TRAITS[trait].words} of {of}"
        case RoundAnswer(of=of):
            return f"the rejected answer of the non-ego {strategy_name(of)}"
        case _:
            return f"the non-ego {strategy_name(non_ego)}"


def _ego_in_words(ego: EgoStrategy, naive: str) -> str:
    match ego:
        case NaiveEgo():
            return f"the {naive}"
        case ReconfiguredEgo(against=against):
            return f"the ego tuned against {against}"
        case RetrainedEgo(against=against, round=2):
            return f"the ego retrained against {against}"
        case RoundAnswer(of=of):
            return f"the rejected answer of the ego {strategy_name(of)}"
        case _:
            return f"the ego {strategy_name(ego)}"
