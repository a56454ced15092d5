"""The drivers of a plan: who plays on each side of its stages.

The two sides of a game are the ego and the non-egos. A persona drives in every place of the non-egos, a population is a
mixture of personas in every place, and a crowd has a persona for each place: all are a `Side` of planned drivers, a
closed union of which `execution.player_factory` makes drivers.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import chain
from typing import Literal, TypeAlias

from harness.evaluation.strategies import Borrowed


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
class Learned:
    """The policy that a training made: one of its two subclasses."""

    stage: str
    persona: str = ""
    """The persona with which it drives; empty: the ego's own."""
    borrowed: Borrowed | None = None
    """The trait with which it drives that is not the persona's own."""


@dataclass(frozen=True, kw_only=True)
class Trained(Learned):
    """The policy that a training of this plan makes."""


@dataclass(frozen=True, kw_only=True)
class TrainedBefore(Learned):
    """The policy that a training of this name made in another run, read from the campaign's folder of policies."""


@dataclass(frozen=True, kw_only=True)
class Shipped:
    """The shipped people of the scene that is played, one of them in each game."""

    without: int
    """The number of a training that is left out of those of each person, counted from the first again."""


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


@dataclass(frozen=True, kw_only=True)
class Shielded:
    """A driver with a shield around it."""

    members: tuple[PlannedMember]
    rule: Literal["rss"]


PlannedMember = SumoDriven | External | Reconfigured | Learned | Shipped
"""One driver, the same in every game, or the people of a scene."""
PlannedDriver = PlannedMember | FixedMixture | EquilibriumMixture | BestOf | Shielded
Side: TypeAlias = tuple[PlannedDriver, ...]
"""The drivers of a side: those of the non-egos' places in their order, from the first again where there are more places
than drivers. Empty: the side takes no part."""


def one_of(drivers: Iterable[tuple[PlannedMember, float]]) -> PlannedDriver:
    """Drivers by their shares, one of which is drawn for each game; of one, this one."""
    members, shares = zip(*drivers, strict=True)
    return members[0] if len(members) == 1 else FixedMixture(members=members, shares=shares)


def driver_in(side: Side, place: int) -> PlannedDriver | None:
    """The driver of a side in one of its places; None: no one."""
    return side[place % len(side)] if side else None


def without_shipped(side: Side) -> Side:
    """A side in a scene that has no shipped people: the others, or SUMO's driver, have their games."""
    return tuple(map(_without_shipped, side))


def _without_shipped(driver: PlannedDriver) -> PlannedDriver:
    match driver:
        case Shipped():
            return SumoDriven()
        case FixedMixture(members=members, shares=shares):
            return one_of(pair for pair in zip(members, shares, strict=True) if not isinstance(pair[0], Shipped))
        case _:
            return driver


def by_control(side: Side) -> tuple[tuple[Side, float], ...]:
    """A side, as one or two sides of which the harness drives all members or SUMO does, each with its share of the
    games. A player's control mode is the same in all games of an arena."""
    match side:
        case (FixedMixture(members=members, shares=shares),) if SumoDriven() in members:
            people = [pair for pair in zip(members, shares, strict=True) if pair[0] != SumoDriven()]
            of_people = sum(share for _, share in people)
            return ((one_of(people),), of_people), ((SumoDriven(),), sum(shares) - of_people)
        case _:
            return ((side, 1.0),)


def members_of(*drivers: PlannedDriver) -> tuple[PlannedMember, ...]:
    """The drivers that may play: the members of mixtures, choices and shields, or the drivers themselves."""
    several = FixedMixture | EquilibriumMixture | BestOf | Shielded
    members = (driver.members if isinstance(driver, several) else (driver,) for driver in drivers)
    return tuple(chain.from_iterable(members))


def persona_of(driver: PlannedDriver) -> str:
    """The name of the persona with which a driver drives; empty: the ego's own."""
    match driver:
        case Learned(persona=persona) | BestOf(persona=persona):
            return persona
        case _:
            return ""


def borrowed_of(driver: PlannedDriver) -> Borrowed | None:
    """The trait with which a driver drives that is not its persona's own."""
    return driver.borrowed if isinstance(driver, Learned) else None


def description(driver: PlannedDriver) -> str:
    """The driver as the card of a policy names its opponent."""
    match driver:
        case SumoDriven():
            return "sumo"
        case External(name=name):
            return name or "given"
        case Reconfigured(stage=stage) | Learned(stage=stage):
            return stage
        case Shipped():
            return "the shipped people of the scene"
        case BestOf():
            return "best"
        case Shielded(members=(member,)):
            return description(member)
        case FixedMixture(members=members) | EquilibriumMixture(members=members):
            return "one in each game of " + ", ".join(description(each) for each in members)
