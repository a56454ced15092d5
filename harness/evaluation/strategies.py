"""Strategies and arms as records. Their names in tables, files and stages are derived, and read, here alone."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

from harness.game.roles import EGO, NON_EGO, ROLES

_SEED = "-seed"
PAPER_ROUNDS = 2
"""The rounds of the paper: strategies of later rounds carry their round in their name."""


@dataclass(frozen=True, kw_only=True)
class NaiveEgo:
    """The ego of round 0: trained alone or beside SUMO's driver, or an external driver as it is."""


@dataclass(frozen=True, kw_only=True)
class RetrainedEgo:
    """The ego retrained against a persona or population, in an even round."""

    against: str
    round: int = PAPER_ROUNDS


@dataclass(frozen=True, kw_only=True)
class ReconfiguredEgo:
    """The external ego with the parameters that a search against a persona or population found."""

    against: str


@dataclass(frozen=True, kw_only=True)
class RobustEgo:
    """The ego retrained against several personas at once."""


OwnEgo = NaiveEgo | RetrainedEgo | ReconfiguredEgo | RobustEgo


@dataclass(frozen=True, kw_only=True)
class ShieldedEgo:
    """An ego with the campaign's shield: its decisions are kept unless a rule forbids them."""

    of: OwnEgo


@dataclass(frozen=True, kw_only=True)
class ErrorFreeEgo:
    """An ego without the campaign's perception errors."""

    of: OwnEgo


@dataclass(frozen=True, kw_only=True)
class OtherEgo:
    """A driver that takes part in the cross-play beside the campaign's own egos."""

    driver: str


@dataclass(frozen=True, kw_only=True)
class SumoNonEgo:
    """SUMO's own law-abiding driver as non-ego."""


@dataclass(frozen=True, kw_only=True)
class Borrowed:
    """A trait (`config.traits.TRAITS`) that a person has of another one when it plays."""

    trait: str
    of: str
    """The persona that has it; empty: nobody, so that the person is without the trait."""


@dataclass(frozen=True, kw_only=True)
class PersonaNonEgo:
    """The non-ego of a persona, in an odd round; or a population, of which each game has one persona."""

    persona: str
    round: int = 1
    borrowed: Borrowed | None = None
    """The trait that is not its own."""


@dataclass(frozen=True, kw_only=True)
class ManyPersonas:
    """One policy of several personas, which has the persona as a further input. The non-ego of each persona follows
    from it."""

    personas: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class RoundAnswer:
    """What the training of a later round made of a player, before a selection took or rejected it."""

    of: RetrainedEgo | PersonaNonEgo
    """The player's strategy of that round: the answer where it was taken, else a policy that the player had before."""
    is_rejected: bool = False
    """Whether it plays in an arm: only a rejected answer does, under that name."""


@dataclass(frozen=True, kw_only=True)
class BestResponse:
    """One training of a player's best response to the other player of an arm."""

    arm: Arm
    """The arm in which the best response replaces the player."""
    start: int


EgoStrategy = OwnEgo | ShieldedEgo | ErrorFreeEgo | OtherEgo | RoundAnswer
NonEgoStrategy = SumoNonEgo | PersonaNonEgo | RoundAnswer
Strategy = EgoStrategy | NonEgoStrategy | ManyPersonas | BestResponse


@dataclass(frozen=True, kw_only=True)
class Arm:
    """A pairing that is assessed. A player of None does not take part."""

    ego: EgoStrategy | None = None
    non_ego: NonEgoStrategy | None = None
    best_response_of: int | None = None
    """The player (index of `ROLES`) that a best response replaces."""

    @property
    def pair(self) -> Arm:
        """The arm without a best response."""
        return replace(self, best_response_of=None)

    @property
    def is_of_a_trait(self) -> bool:
        """Whether an ego meets a person of which one trait is another person's: a question of `[attribution]`, and no
        person of the campaign."""
        borrows = isinstance(self.non_ego, PersonaNonEgo) and self.non_ego.borrowed is not None
        return self.ego is not None and borrows

    @property
    def name(self) -> str:
        pair = _pair_name(self.ego, self.non_ego)
        return pair if self.best_response_of is None else f"{pair}_{ROLES[self.best_response_of]}_response"


ATTENTIVE = Borrowed(trait="attention", of="")
"""A person without lapses of attention: its eyes stay on the road."""
NAIVE_ALONE = Arm(ego=NaiveEgo())
NAIVE_VS_SUMO = Arm(ego=NaiveEgo(), non_ego=SumoNonEgo())


def persona_alone(persona: str, borrowed: Borrowed | None = None) -> Arm:
    """The arm of a persona's non-ego of round 1 without the ego."""
    return Arm(non_ego=PersonaNonEgo(persona=persona, borrowed=borrowed))


def against_persona(ego: EgoStrategy, persona: str) -> Arm:
    """The arm of an ego against a persona's non-ego of round 1, or against a population."""
    return Arm(ego=ego, non_ego=PersonaNonEgo(persona=persona))


def counterparts(arm: Arm) -> list[Arm]:
    """The arms to compare an arm with: the ego of round 2 with the naive ego, against the persona of its training; a
    shielded ego with the same one without its shield, one without perception errors with the same one with them."""
    if isinstance(arm.ego, ShieldedEgo | ErrorFreeEgo):
        return [replace(arm, ego=arm.ego.of)]
    if not isinstance(arm.non_ego, PersonaNonEgo):
        return []
    persona = arm.non_ego.persona
    naive = against_persona(NaiveEgo(), persona)
    round_2 = [against_persona(ego(against=persona), persona) for ego in (RetrainedEgo, ReconfiguredEgo)]
    if arm == naive:
        return round_2
    return [naive] if arm in round_2 else []


def strategy_name(strategy: Strategy) -> str:
    """The strategy's name in tables, stages and policy folders."""
    match strategy:
        case NaiveEgo():
            return "naive"
        case RetrainedEgo(against=against, round=round_):
            return f"retrained_{against}" + (f"_round{round_}" if round_ > PAPER_ROUNDS else "")
        case ReconfiguredEgo(against=against):
            return f"reconfigured_{against}"
        case RobustEgo():
            return "robust"
        case ShieldedEgo(of=of):
            return f"shielded_{strategy_name(of)}"
        case ErrorFreeEgo(of=of):
            return f"error_free_{strategy_name(of)}"
        case OtherEgo(driver=driver):
            return driver
        case SumoNonEgo():
            return "sumo"
        case PersonaNonEgo(persona=persona, round=round_, borrowed=borrowed):
            return persona + (f"_round{round_}" if round_ > 1 else "") + _borrowed_name(borrowed)
        case ManyPersonas():
            return "people"
        case RoundAnswer(of=of, is_rejected=is_rejected):
            return f"{strategy_name(of)}_{'rejected' if is_rejected else 'answer'}"
        case BestResponse(arm=arm, start=start):
            return f"{arm.name}{start}"


def _borrowed_name(borrowed: Borrowed | None) -> str:
    if borrowed is None:
        return ""
    return "_attentive" if borrowed == ATTENTIVE else f"_with_{borrowed.trait}_of_{borrowed.of or 'nobody'}"


_BORROWED_NAME = re.compile(r"_attentive|_with_\w+_of_\w+")


def is_named_of_a_trait(arm: str, persona: str) -> bool:
    """`Arm.is_of_a_trait` by the name of an arm and the persona that it belongs to."""
    return bool(persona) and _BORROWED_NAME.fullmatch(arm.rpartition(f"_vs_{persona}")[2]) is not None


def is_named_of_the_naive_ego(arm: str) -> bool:
    """Whether a `NaiveEgo` drives in an arm, by the name of the arm: not its best response."""
    naive, answers = strategy_name(NaiveEgo()), [f"_{role}_response" for role in ROLES]
    is_of_response = arm.endswith(answers[EGO]) and not arm.endswith(answers[NON_EGO])
    return arm.startswith((NAIVE_ALONE.name, f"{naive}_vs_")) and not is_of_response


def stage_id(name: str, seed: int) -> str:
    """What a stage is called in a run folder, by the name of its strategy or arm and its training seed."""
    return f"{name}{_SEED}{seed}"


def name_and_seed(stage: str) -> tuple[str, int | None]:
    """The name and the training seed of a stage's id; of any other text, no name and no seed."""
    name, _, seed = stage.rpartition(_SEED)
    return (name, int(seed)) if name and seed.isdecimal() else ("", None)


def player_of(strategy: Strategy) -> int:
    """The player (index of `ROLES`) that plays a strategy."""
    match strategy:
        case BestResponse(arm=arm):
            assert arm.best_response_of is not None
            return arm.best_response_of
        case RoundAnswer(of=of):
            return player_of(of)
        case SumoNonEgo() | PersonaNonEgo() | ManyPersonas():
            return NON_EGO
        case _:
            return EGO


def round_of(strategy: Strategy) -> int:
    """The round that made a strategy; 0 for one that no round made."""
    match strategy:
        case RetrainedEgo(round=round_) | PersonaNonEgo(round=round_):
            return round_
        case ReconfiguredEgo():
            return PAPER_ROUNDS
        case RoundAnswer(of=of) | ShieldedEgo(of=of) | ErrorFreeEgo(of=of):
            return round_of(of)
        case _:
            return 0


def egos_made_against(arms: Iterable[Arm], persona: str) -> list[EgoStrategy]:
    """The egos that rounds or searches against a persona made, of those in some arms, from the first round on."""
    egos = [arm.ego for arm in arms if isinstance(arm.ego, RetrainedEgo | ReconfiguredEgo)]
    return sorted((ego for ego in egos if ego.against == persona), key=round_of)


def _pair_name(ego: EgoStrategy | None, non_ego: NonEgoStrategy | None) -> str:
    if isinstance(ego, ShieldedEgo):
        return f"shielded_{_pair_name(ego.of, non_ego)}"
    if isinstance(ego, ErrorFreeEgo):
        return f"error_free_{_pair_name(ego.of, non_ego)}"
    if ego is None:
        assert non_ego is not None, "an arm has at least one player"
        return f"{strategy_name(non_ego)}_alone"
    name = strategy_name(ego)
    match ego:
        case RetrainedEgo(against=against, round=2) | ReconfiguredEgo(against=against):
            made = name.removesuffix(f"_{against}")
            if non_ego is None:
                return f"{made}_alone_{against}"
            if strategy_name(non_ego) == against:
                return f"{made}_vs_{against}"
    return f"{name}_alone" if non_ego is None else f"{name}_vs_{strategy_name(non_ego)}"
