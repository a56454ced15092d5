"""What a plan consists of: who drives, and stages that train, assess or search."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Drives:
    """Who drives a player.

    | kind | who |
    | --- | --- |
    | sumo | SUMO's own models |
    | given | the campaign's given ego, or the other driver called `stage` |
    | reconfigured | the given ego as the search `stage` reconfigured it |
    | policy | the policy that the training `stage` made |
    | before | the policy that such a stage made before, in another run |
    | mixture | one of `members` in each game, by `shares` or, without, by the equilibrium of the arms in `weighed_by` |
    | best | the one of `members` who earns most in games that are played for this choice alone |
    """

    kind: Literal["sumo", "given", "reconfigured", "policy", "before", "mixture", "best"]
    stage: str = ""
    persona: str = ""
    """Whose human factors it has; empty: the ego's own."""
    members: tuple[Drives, ...] = ()
    shares: tuple[float, ...] = ()
    weighed_by: tuple[tuple[str, ...], ...] = ()
    """Stages of the arms of every ego (rows) against every non-ego (columns)."""

    @property
    def in_words(self) -> str:
        """Who that is, for the card of a policy."""
        if self.kind == "mixture":
            return "one in each game of " + ", ".join(each.stage for each in self.members)
        return self.stage or self.kind

    @property
    def everyone(self) -> tuple[Drives, ...]:
        """Whoever may drive: the members, or this one."""
        return self.members or (self,)


@dataclass(frozen=True)
class Gate:
    """The arms by which an exchange may be found to have settled: a pair, and each player's best response in it."""

    pair: str
    ego_response: str
    non_ego_response: str


@dataclass(frozen=True)
class TrainingStage:
    """One training: who learns, against whom, beginning from what."""

    name: str  # naive, <persona>, retrained_<persona>
    seed: int
    persona: str
    learner: int
    opponent: Drives | None
    initial: str | None
    alone_share: float
    attentive_share: float = 0.0
    responds_in: tuple[str, ...] = ()
    """Of a best response: the arm in which it replaces a player."""
    begins_as: tuple[str, ...] = ()
    """The policy, trained before, that it begins from."""
    unless: tuple[Gate, ...] = ()
    """There is nothing to do where one of them has settled."""

    @property
    def id(self) -> str:
        """What the stage and its policy are called in the run folder."""
        return stage_id(self.name, self.seed)

    @property
    def needs(self) -> tuple[str, ...]:
        """The stages that have to be done before."""
        return _stages(self.unless, self.initial, self.opponent)

    @property
    def reads(self) -> tuple[str, ...]:
        """The policies trained before that it needs, each called after the stage that made it."""
        return tuple(dict.fromkeys((*self.begins_as, *_before(self.opponent))))


@dataclass(frozen=True)
class AssessmentStage:
    """One arm: its pairing, assessed."""

    arm: str
    seed: int
    persona: str
    ego: Drives | None
    non_ego: Drives | None
    unless: tuple[Gate, ...] = ()
    """There is nothing to do where one of them has settled."""

    @property
    def id(self) -> str:
        """What the stage and its files are called in the run folder."""
        return stage_id(self.arm, self.seed)

    @property
    def needs(self) -> tuple[str, ...]:
        """The stages that have to be done before."""
        return _stages(self.unless, None, self.ego, self.non_ego)

    @property
    def reads(self) -> tuple[str, ...]:
        """The policies trained before that drive in it, each called after the stage that made it."""
        return _before(self.ego, self.non_ego)


@dataclass(frozen=True)
class ReconfigurationStage:
    """One search: the given ego's parameters, on its own payoff, against whom."""

    name: str  # reconfigured_<persona>
    seed: int
    persona: str
    opponent: Drives
    unless: tuple[Gate, ...] = ()
    """There is nothing to do where one of them has settled."""

    @property
    def id(self) -> str:
        """What the stage and the driver it finds are called in the run folder."""
        return stage_id(self.name, self.seed)

    @property
    def needs(self) -> tuple[str, ...]:
        """The stages that have to be done before."""
        return _stages(self.unless, None, self.opponent)

    @property
    def reads(self) -> tuple[str, ...]:
        """The policies trained before that drive in it, each called after the stage that made it."""
        return _before(self.opponent)


Stage = TrainingStage | AssessmentStage | ReconfigurationStage


def stage_id(name: str, seed: int) -> str:
    """A stage's name in the run folder."""
    return f"{name}-seed{seed}"


def arm_of(ego: str, non_ego: str) -> str:
    """What the arm of two strategies is called."""
    made = next((made for made in ("retrained", "reconfigured") if ego == f"{made}_{non_ego}"), ego)
    return f"{made}_vs_{non_ego}"


_MADE = ("policy", "reconfigured")  # by a stage of the plan


def _stages(unless: Sequence[Gate], initial: str | None, *drivers: Drives | None) -> tuple[str, ...]:
    players = [each for player in drivers if player is not None for each in player.everyone]
    weighed = [arm for player in drivers if player is not None for row in player.weighed_by for arm in row]
    gates = [stage for gate in unless for stage in (gate.pair, gate.ego_response, gate.non_ego_response)]
    named = [initial or "", *(each.stage for each in players if each.kind in _MADE), *weighed, *gates]
    return tuple(dict.fromkeys(name for name in named if name))


def _before(*drivers: Drives | None) -> tuple[str, ...]:
    players = [each for player in drivers if player is not None for each in player.everyone]
    return tuple(dict.fromkeys(each.stage for each in players if each.kind == "before"))
