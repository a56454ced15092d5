"""The stages of a plan: trainings, parameter searches and arms. Each is done once, stored, and skipped afterwards.

The two sides of a game are the ego and the non-egos. A persona drives in every place of the non-egos, a population is a
mixture of personas in every place, and a crowd has a persona for each place: all are a `Side` of planned drivers, a
closed union of which `execution.player_factory` makes drivers.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from itertools import chain
from typing import ClassVar, TypeAlias

from harness.evaluation.competence import AloneBound
from harness.evaluation.strategies import (
    Arm,
    BestResponse,
    Borrowed,
    PersonaNonEgo,
    ReconfiguredEgo,
    RetrainedEgo,
    Strategy,
    player_of,
    strategy_name,
)


@dataclass(frozen=True, kw_only=True)
class SumoDriven:
    """SUMO's own models."""


@dataclass(frozen=True, kw_only=True)
class External:
    """The campaign's external ego, or another driver of its cross-play by name."""

    name: str = ""


@dataclass(frozen=True, kw_only=True)
class Reconfigured:
    """The external ego with the parameters that a search of this plan found."""

    stage: str


@dataclass(frozen=True, kw_only=True)
class Trained:
    """The policy that a training of this plan makes."""

    stage: str
    persona: str = ""
    """The persona with which it drives; empty: the ego's own."""
    borrowed: Borrowed | None = None
    """The trait with which it drives that is not the persona's own."""


@dataclass(frozen=True, kw_only=True)
class TrainedBefore:
    """The policy that a training of this name made in another run, read from the campaign's folder of policies."""

    stage: str
    persona: str = ""
    """The persona with which it drives; empty: the ego's own."""
    borrowed: Borrowed | None = None
    """The trait with which it drives that is not the persona's own."""


@dataclass(frozen=True, kw_only=True)
class FixedMixture:
    """One of several drivers in each game, drawn by fixed shares."""

    members: tuple[PlannedMember, ...]
    shares: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class EquilibriumMixture:
    """One of several drivers in each game, drawn by the shares of an equilibrium."""

    members: tuple[PlannedMember, ...]
    arms: tuple[tuple[str, ...], ...]
    """The assessments whose mean payoffs make the game: a row per ego, a column per non-ego."""


@dataclass(frozen=True, kw_only=True)
class BestOf:
    """Of several drivers the one with the highest mean payoff in games played for this choice alone."""

    members: tuple[PlannedMember, ...]
    persona: str = ""


PlannedMember = SumoDriven | External | Reconfigured | Trained | TrainedBefore
"""One driver, the same in every game."""
PlannedDriver = PlannedMember | FixedMixture | EquilibriumMixture | BestOf
Side: TypeAlias = tuple[PlannedDriver, ...]
"""The drivers of a side: those of the non-egos' places in their order, from the first again where there are more places
than drivers. Empty: the side takes no part."""


def driver_in(side: Side, place: int) -> PlannedDriver | None:
    """The driver of a side in one of its places; None: no one."""
    return side[place % len(side)] if side else None


def members_of(*drivers: PlannedDriver) -> tuple[PlannedMember, ...]:
    """The drivers that may play: the members of mixtures and choices, or the drivers themselves."""
    several = FixedMixture | EquilibriumMixture | BestOf
    members = (driver.members if isinstance(driver, several) else (driver,) for driver in drivers)
    return tuple(chain.from_iterable(members))


def persona_of(driver: PlannedDriver) -> str:
    """The name of the persona with which a driver drives; empty: the ego's own."""
    match driver:
        case Trained(persona=persona) | TrainedBefore(persona=persona) | BestOf(persona=persona):
            return persona
        case _:
            return ""


def borrowed_of(driver: PlannedDriver) -> Borrowed | None:
    """The trait with which a driver drives that is not its persona's own."""
    return driver.borrowed if isinstance(driver, Trained | TrainedBefore) else None


def description(driver: PlannedDriver) -> str:
    """The driver as the card of a policy names its opponent."""
    match driver:
        case SumoDriven():
            return "sumo"
        case External(name=name):
            return name or "given"
        case Reconfigured(stage=stage) | Trained(stage=stage) | TrainedBefore(stage=stage):
            return stage
        case BestOf():
            return "best"
        case FixedMixture(members=members) | EquilibriumMixture(members=members):
            return "one in each game of " + ", ".join(description(each) for each in members)


@dataclass(frozen=True, kw_only=True)
class EquilibriumGate:
    """Three assessments that show whether a pair is an approximate equilibrium: the pair itself, and the pair with each
    player replaced by its best response. Where it is one, the stages behind the gate have nothing to do."""

    pair: str
    ego_response: str
    non_ego_response: str
    alone: tuple[str, ...] = ()
    """The assessments that show whether the players of the pair can drive the scene alone."""
    bounds: tuple[AloneBound, ...] = ()
    """What the players have to achieve in these: a pair that can't drive is in no equilibrium."""

    @property
    def stages(self) -> tuple[str, ...]:
        return self.pair, self.ego_response, self.non_ego_response, *self.alone


@dataclass(frozen=True, kw_only=True)
class RejectionGate:
    """A selection: the stages behind the gate are about its new answer, and have nothing to do where it was taken."""

    selection: str
    answer: str

    @property
    def stages(self) -> tuple[str, ...]:
        return (self.selection,)


Gate: TypeAlias = EquilibriumGate | RejectionGate


@dataclass(frozen=True, kw_only=True)
class _Stage:
    seed: int
    persona: str
    """The persona or population that the stage belongs to; empty for the naive ego's own."""
    gates: tuple[Gate, ...] = ()

    kind: ClassVar[str]
    """What the manifest calls it."""
    verb: ClassVar[str]
    """What `harness check` says is done."""
    unit: ClassVar[str]
    """What its progress counts."""

    @property
    @abstractmethod
    def name(self) -> str:
        """The stage's name, the same for each seed."""

    @property
    @abstractmethod
    def drivers(self) -> tuple[PlannedDriver, ...]:
        """The drivers that play in it and do not learn."""

    @property
    def id(self) -> str:
        """The name of the stage, and of what it makes, in the run folder."""
        return stage_id(self.name, self.seed)

    @property
    def needs(self) -> tuple[str, ...]:
        """The stages that have to be done before."""
        needed = [each.stage for each in members_of(*self.drivers) if isinstance(each, Trained | Reconfigured)]
        for driver in self.drivers:
            if isinstance(driver, EquilibriumMixture):
                needed += chain.from_iterable(driver.arms)
        for gate in self.gates:
            needed += gate.stages
        return tuple(dict.fromkeys(needed))

    @property
    def reads(self) -> tuple[str, ...]:
        """The policies of another run that it reads, each named after the stage that made it."""
        read = (each.stage for each in members_of(*self.drivers) if isinstance(each, TrainedBefore))
        return tuple(dict.fromkeys(read))


@dataclass(frozen=True, kw_only=True)
class TrainingStage(_Stage):
    """One training: which strategy is learned, against which driver, from which parameters."""

    strategy: Strategy
    opponent: Side
    initial: Trained | TrainedBefore | None
    """The policy that it starts from; None: a new one."""
    alone_share: float
    """The share of its games without the opponent."""
    attentive_share: float = 0.0
    """The share of its budget in which the learner's attention does not lapse."""

    kind, verb, unit = "training", "train", "steps"

    @property
    def name(self) -> str:
        return strategy_name(self.strategy)

    @property
    def is_best_response(self) -> bool:
        return isinstance(self.strategy, BestResponse)

    @property
    def learner(self) -> int:
        """The player (index of `ROLES`) that learns."""
        return player_of(self.strategy)

    @property
    def drivers(self) -> tuple[PlannedDriver, ...]:
        return (*((self.initial,) if self.initial is not None else ()), *self.opponent)


@dataclass(frozen=True, kw_only=True)
class AssessmentStage(_Stage):
    arm: Arm
    ego: Side
    non_ego: Side

    kind, verb, unit = "assessment", "assess", "episodes"

    @property
    def name(self) -> str:
        return self.arm.name

    @property
    def drivers(self) -> tuple[PlannedDriver, ...]:
        return (*self.ego, *self.non_ego)

    @property
    def sides(self) -> tuple[Side, Side]:
        return self.ego, self.non_ego

    @property
    def is_pair(self) -> bool:
        """Whether an ego meets a persona's non-ego, and both drive the same way in every game. A mixture has no payoff
        of its own, SUMO's driver none at all."""
        fixed = all(len(each) == 1 and members_of(*each) == each for each in self.sides)
        return fixed and bool(self.persona)


@dataclass(frozen=True, kw_only=True)
class SearchStage(_Stage):
    """One search: the external ego's parameters, on its own payoff, against one opponent."""

    opponent: Side

    kind, verb, unit = "reconfiguration", "tune", "trials"

    @property
    def name(self) -> str:
        """The name of the strategy that the search finds."""
        return strategy_name(ReconfiguredEgo(against=self.persona))

    @property
    def drivers(self) -> tuple[PlannedDriver, ...]:
        return self.opponent


@dataclass(frozen=True, kw_only=True)
class SelectionStage(_Stage):
    """The end of a player's turn in a later round: it goes on with the best of the policies that it has."""

    strategy: RetrainedEgo | PersonaNonEgo
    """The player's strategy of this round, which the selection makes."""
    candidates: tuple[Trained, ...]
    """All policies of the player so far, the oldest first and the new answer last."""
    opponent: Side
    """What the training of the answer played against."""
    alone_share: float
    """The share of that training's games without the opponent."""

    kind, verb, unit = "selection", "select", "episodes"

    @property
    def name(self) -> str:
        return strategy_name(self.strategy)

    @property
    def learner(self) -> int:
        """The player (index of `ROLES`) that goes on."""
        return player_of(self.strategy)

    @property
    def round(self) -> int:
        return self.strategy.round

    @property
    def answer(self) -> Trained:
        """The policy of this round's training."""
        return self.candidates[-1]

    @property
    def drivers(self) -> tuple[PlannedDriver, ...]:
        return (*self.candidates, *self.opponent)


@dataclass(frozen=True, kw_only=True)
class PreventabilityStage(_Stage):
    """The judgement of an arm's failures: which of them the reference drivers prevent."""

    of: AssessmentStage

    kind, verb, unit = "preventability", "judge", "games"

    @property
    def name(self) -> str:
        """The name of the arm, and that its failures are judged."""
        return f"{self.of.name}_preventability"

    @property
    def drivers(self) -> tuple[PlannedDriver, ...]:
        return self.of.drivers

    @property
    def needs(self) -> tuple[str, ...]:
        return (self.of.id, *super().needs)


Stage = TrainingStage | AssessmentStage | SearchStage | SelectionStage | PreventabilityStage


def stage_id(name: str, seed: int) -> str:
    """A stage's name in the run folder."""
    return f"{name}-seed{seed}"
