"""The stages of a plan: trainings, parameter searches, selections and arms. Each is done once, stored, and skipped
afterwards."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import chain
from typing import ClassVar, TypeAlias

from harness.campaign.plan.planned_drivers import (
    EquilibriumMixture,
    External,
    Learned,
    PlannedDriver,
    Reconfigured,
    Side,
    SumoDriven,
    Trained,
    TrainedBefore,
    members_of,
)
from harness.evaluation.competence import AloneBound
from harness.evaluation.strategies import (
    Arm,
    BestResponse,
    ErrorFreeEgo,
    ManyPersonas,
    PersonaNonEgo,
    ReconfiguredEgo,
    RetrainedEgo,
    Strategy,
    SumoNonEgo,
    player_of,
    stage_id,
    strategy_name,
)
from harness.game.roles import EGO


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
    initial: Learned | None
    """The policy that it starts from; None: a new one."""
    alone_share: float
    """The share of its games without the opponent."""
    attentive_share: float = 0.0
    """The share of its budget in which the learner's attention does not lapse."""
    best_known: Learned | None = field(default=None, repr=False)
    """Of an ego that replays starts by regret: the best known ego, with which it is compared. Not a part of the stage's
    text, so that a training without one has the key that it had before there were any."""

    kind, verb, unit = "training", "train", "steps"

    @property
    def name(self) -> str:
        return strategy_name(self.strategy)

    @property
    def personas(self) -> tuple[str, ...]:
        """The personas that learn: one of them in each game."""
        return self.strategy.personas if isinstance(self.strategy, ManyPersonas) else (self.persona,)

    @property
    def is_best_response(self) -> bool:
        return isinstance(self.strategy, BestResponse)

    @property
    def learns_on_roads(self) -> bool:
        """Whether it plays on the `roads` of the campaign too. A best response is one to what is assessed."""
        return self.learner == EGO and not self.is_best_response

    @property
    def learner(self) -> int:
        """The player (index of `ROLES`) that learns."""
        return player_of(self.strategy)

    @property
    def drivers(self) -> tuple[PlannedDriver, ...]:
        policies = (each for each in (self.initial, self.best_known) if each is not None)
        return (*policies, *self.opponent)


@dataclass(frozen=True, kw_only=True)
class ConditioningStage(_Stage):
    """The policy of one persona, from the policy that several learned together."""

    of: Learned

    kind, verb, unit = "conditioning", "derive", "policies"

    @property
    def name(self) -> str:
        return strategy_name(self.strategy)

    @property
    def strategy(self) -> PersonaNonEgo:
        return PersonaNonEgo(persona=self.persona)

    @property
    def drivers(self) -> tuple[PlannedDriver, ...]:
        return (self.of,)


@dataclass(frozen=True, kw_only=True)
class AssessmentStage(_Stage):
    arm: Arm
    ego: Side
    non_ego: Side
    games_of: str = field(default="", repr=False)
    """The same arm of an earlier training seed, whose games it has; empty: it plays its own."""

    kind, verb, unit = "assessment", "assess", "episodes"

    @property
    def name(self) -> str:
        return self.arm.name

    @property
    def drivers(self) -> tuple[PlannedDriver, ...]:
        return (*self.ego, *self.non_ego)

    @property
    def needs(self) -> tuple[str, ...]:
        return (self.games_of,) if self.games_of else super().needs

    @property
    def sides(self) -> tuple[Side, Side]:
        return self.ego, self.non_ego

    @property
    def is_without_people(self) -> bool:
        """Whether a player drives alone, or an ego beside SUMO's driver: what it achieves here is its own doing."""
        return not all(self.sides) or isinstance(self.arm.non_ego, SumoNonEgo)

    @property
    def is_untrained(self) -> bool:
        """Whether no driver depends on the training seed: its games are then the same for each."""
        return all(isinstance(each, SumoDriven | External) for each in members_of(*self.drivers))

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


Stage = TrainingStage | ConditioningStage | AssessmentStage | SearchStage | SelectionStage | PreventabilityStage


def plays_with_errors(stage: Stage) -> bool:
    """Whether an ego plays in a stage with the perception errors of the campaign. Reference drivers have none."""
    match stage:
        case AssessmentStage(arm=arm):
            return arm.ego is not None and not isinstance(arm.ego, ErrorFreeEgo)
        case PreventabilityStage():
            return False
        case _:
            return True


def arms_of(stages: Iterable[Stage]) -> dict[str, Arm]:
    """The arms among stages, by name; one of several seeds once."""
    return {stage.name: stage.arm for stage in stages if isinstance(stage, AssessmentStage)}


def strategies_of(stages: Iterable[Stage]) -> dict[str, Strategy]:
    """The strategies that are trained in stages, by name."""
    return {stage.name: stage.strategy for stage in stages if isinstance(stage, TrainingStage)}
